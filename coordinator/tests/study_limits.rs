//! Limits of the cost of a run: too many steps are refused, with how many there would be and what to do.
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

use std::fmt::Write as _;

use starlings_coordinator::study::Study;
use starlings_coordinator::study::trial::trial;

/// Eight seconds of an output `y`, a field's component, and an input `flow`.
fn recording() -> String {
    let mut text = "time,y,displacement[3],flow\n".to_owned();
    for i in 0..=80 {
        writeln!(text, "{:.1},1.0,0.1,{}", 0.1 * f64::from(i), i % 5).unwrap();
    }
    text
}

/// The messages of loading a study and of its trial run; empty for a sound one.
fn told(study: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("data.csv"), recording()).unwrap();
    let file = folder.path().join("study.toml");
    std::fs::write(&file, study).unwrap();
    match Study::load(&file) {
        Ok(study) => trial(&study).err().map_or(String::new(), |error| error.to_string()),
        Err(error) => {
            let told = |p: &starlings_coordinator::study::Problem| {
                format!("{}; {}", p.message, p.help.as_deref().unwrap_or_default())
            };
            error.problems.iter().map(told).collect::<Vec<_>>().join("\n")
        }
    }
}

fn equations(rate: &str, model: &str) -> String {
    format!(
        "[study]\nname = \"a\"\n[model]\nkind = \"equations\"\noutputs = [ {{ name = \"y\", value = \"x\" }} ]\n{model}\n\
         [[model.states]]\nname = \"x\"\ninitial = 1\nrate = \"{rate}\"\n\
         [[parameters]]\nname = \"k\"\nprior = {{ transform = \"log\", median = 1.0, factor = 2.0 }}\n\
         [[records]]\nname = \"r\"\nfile = \"data.csv\"\nchannels = [ {{ column = \"y\", output = \"y\", noise = 0.1 }} ]\n"
    )
}

fn vessel(kind: &str, model: &str) -> String {
    format!(
        "[study]\nname = \"a\"\n[model]\nkind = \"{kind}\"\n{model}\n\
         [[parameters]]\nname = \"p0\"\nprior = {{ transform = \"log\", median = 1e5, factor = 2.0 }}\n\
         [[records]]\nname = \"r\"\nfile = \"data.csv\"\ninputs = {{ flow = \"flow\" }}\n\
         channels = [ {{ column = \"displacement[3]\", output = \"displacement[3]\", noise = 0.1 }} ]\n"
    )
}

const REMEDY: &str = "a `step` of the model, a time constant or a tolerance is too short for the record; change it, or allow more \
                      with `max_steps` in `[model]`";

#[test]
fn a_delay_too_short_for_its_record_is_refused_before_a_run() {
    assert_eq!(
        told(&equations("-k*delay(x, 1e-300)", "")),
        "the delay of `x` is at most 1e-300 s: over the 8 s of record `r` a run would take 9.9e302 steps, more than 2000000; leave a \
         delay out that is so short, or allow more with `max_steps` in `[model]`"
    );
    let short = told(&equations("-k*delay(x, 1e-7)", ""));
    assert!(short.starts_with("the delay of `x` is at most 1e-7 s: over the 8 s of record `r`"), "{short}");
    assert_eq!(told(&equations("-k*delay(x, 0.5)", "")), "");
    // 8 s in steps of 1/124 of the delay.
    let most = |n: u64| told(&equations("-k*delay(x, 0.5)", &format!("max_steps = {n}")));
    assert!(most(1000).contains("more than 1000;"), "{}", most(1000));
}

#[test]
fn a_step_too_short_for_its_record_is_refused_at_the_start_of_the_trial_run() {
    let fixed = equations("-k*x", "solver = { method = \"fixed\", step = 1e-6 }");
    let tube = vessel("fsi-tube", "layout = { step = 1e-6 }");
    // Cells of 1e-10 cm, which waves cross in 1e-13 s.
    let artery = vessel(
        "artery-1d",
        "layout = { segments = [ { name = \"a\", from = \"i\", to = \"o\", length = 1e-6, radius = 1, thickness = 0.1, cells = \
         10000 } ], nodes = [ { name = \"i\", kind = \"inlet\" }, { name = \"o\", kind = \"rcr\" } ] }",
    );
    let many = "many times as many";
    for (study, steps) in [(fixed, "about 8.0e6"), (tube, "about 8.0e6"), (artery, many)] {
        let told = told(&study);
        let said =
            format!("more than 2000000 steps of integration, at t = 0; to t = 8 there would be {steps}: ");
        assert!(told.contains(&said) && told.ends_with(REMEDY), "{told}");
    }
}

#[test]
fn a_run_that_reaches_its_limit_says_how_many_steps_there_would_be() {
    let fast = |n: u64| told(&equations("cos(3e3*t) - k*x", &format!("max_steps = {n}")));
    let few = fast(1000);
    assert!(few.contains("more than 1000 steps of integration, at t = "), "{few}");
    assert!(few.contains("; to t = 8 there would be about ") && few.ends_with(REMEDY), "{few}");
    assert_eq!(fast(1_000_000), "");
    let none = fast(0);
    assert!(
        none.contains("a run takes at least one step; give the steps that one run may take at most"),
        "{none}"
    );
}

#[test]
fn a_run_that_computes_for_longer_than_it_may_is_given_up_with_the_limit() {
    let limited = |seconds: &str| told(&equations("cos(3e2*t) - k*x", &format!("timeout = {seconds}")));
    let late = limited("1e-9");
    assert!(
        late.contains("the run computed for more than 0.000000001 s (`timeout` in `[model]` sets the limit)"),
        "{late}"
    );
    assert_eq!(limited("60"), "");
    assert!(
        limited("0").contains("`timeout` must be above zero and at most 3.2e9 s, found 0"),
        "{}",
        limited("0")
    );
}

#[test]
fn a_fixed_step_that_is_too_long_for_the_model_is_named() {
    // Of x' = -100 k x a step of 0.05 of the classic method is 5 time constants long, nearly twice what it bears.
    let unstable = |method: &str| told(&equations("-100*k*x", &format!("solver = {{ method = {method} }}")));
    let said = unstable("\"fixed\", step = 0.05");
    let words = "shorten `solver.step` in `[model]`, 0.05, or take `method = \"auto\"`";
    assert!(said.contains("out of all proportion: a fixed step") && said.contains(words), "{said}");
    let said = told(&equations("-1e4*k*x*x", "solver = { method = \"fixed\", step = 0.05 }"));
    assert!(said.contains("is not a finite number") && said.contains(words), "{said}");
    assert_eq!(unstable("\"auto\""), "");
}
