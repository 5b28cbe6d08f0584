//! What an explanation says where a name would be wrong: held-out data that still fail, equations to which no candidate adds a
//! term, data that cannot tell effects apart. The sentences are those that the user reads.
#![allow(missing_docs, clippy::unwrap_used)]

mod explained_kit;
mod reactor_kit;
mod study_kit;

use explained_kit::explained;
use reactor_kit::{NOISE, reactor, recorded};
use starlings_coordinator::explain::{ExplainError, Explanation, Verdict};
use starlings_coordinator::study::Study;
use study_kit::{Case, csv, grid, normals};

#[test]
fn a_name_is_withheld_while_a_held_out_channel_fails_and_what_could_not_be_tried_is_told() {
    for (span, train, held_out) in
        [(25.0, 25.0, "biomass"), (25.0, 25.0, "substrate"), (15.0, 10.5, "product"), (25.0, 17.5, "biomass")]
    {
        let study = reactor(NOISE, train, held_out, false);
        let study = study.replace("[explain]", "[explain]\nwithout = [\"generic\", \"proposals\"]");
        let found = explained(&Case::new(&study, &[("batch.csv", recorded(NOISE, span, 0.05))])).unwrap();
        let said = &found.headline;
        assert_eq!(found.verdict, Verdict::Unexplained, "{held_out}: {said}");
        assert!(found.effects.is_empty() && found.explained_study.is_none(), "{held_out}: {said}");
        let failing: Vec<_> = found.held_out.iter().filter(|h| h.fails).collect();
        assert!(!failing.is_empty(), "{held_out}: {said}");
        let worst = failing.iter().max_by(|a, b| a.beyond.total_cmp(&b.beyond)).unwrap();
        let figure =
            format!("{} ({}) at {:.2} times its noise", worst.channel, words(&worst.usage), worst.after);
        assert!(
            said.contains("Held out and failing") && said.contains(&figure),
            "{held_out}: {figure} in {said}"
        );
        assert!(
            said.contains(
                "No candidate adds a term to the equations of X, S and P: none of these states has a role from which effects of the \
                 library grow; give roles or list effects in [[effects]]."
            ),
            "{held_out}: {said}"
        );
        let why = |kind: &str| found.not_tried.iter().find(|n| n.kind == kind).map(|n| n.reason.as_str());
        assert!(
            why("mechanics").unwrap().contains("a state with the role velocity"),
            "{:?}",
            found.not_tried
        );
        assert!(why("the equation of X").unwrap().contains("no role"), "{:?}", found.not_tried);
        assert_eq!(why("sensors"), None, "sensors were tried");
    }
}

fn words(usage: &str) -> &'static str {
    if usage == "held-out-channel" { "never fitted" } else { "held out" }
}

#[test]
fn with_the_effect_described_the_same_data_give_its_name() {
    let study = reactor(NOISE, 25.0, "biomass", true);
    let found = explained(&Case::new(&study, &[("batch.csv", recorded(NOISE, 25.0, 0.05))])).unwrap();
    let names: Vec<&str> = found.effects.iter().map(|e| e.name.as_str()).collect();
    assert_eq!(names, ["death"], "{}", found.headline);
    assert!(found.held_out.iter().all(|h| !h.fails), "{:?}", found.held_out);
}

/// A level that decays; a test chooses the rest.
fn decay(noise: &str, train: &str, more: &str) -> String {
    format!(
        r#"
[study]
name = "decay"
seed = 1

[model]
kind = "equations"
outputs = [ {{ name = "y", unit = "m", value = "x" }} ]

[[model.states]]
name = "x"
unit = "m"
role = "level"
initial = 1.0
rate = "-k*x"

[[parameters]]
name = "k"
unit = "1/s"
prior = {{ transform = "log", median = 0.5, factor = 1.5 }}

[[parameters]]
name = "initial:x"
unit = "m"
prior = {{ transform = "linear", median = 1.0, sd = 0.2 }}

[[records]]
name = "a"
file = "a.csv"
time = "time"
channels = [ {{ column = "y", output = "y", noise = {noise} }} ]
{train}

{more}
"#
    )
}

fn of_series(
    noise: &str,
    train: &str,
    more: &str,
    times: &[f64],
    values: &[f64],
) -> Result<Explanation, ExplainError> {
    explained(&Case::new(&decay(noise, train, more), &[("a.csv", csv("time,y", &[times, values]))]))
}

/// Decay at 0.6 1/s with noise of this size.
fn decaying(n: usize, noise: f64) -> (Vec<f64>, Vec<f64>) {
    let times = grid(n, 5.0 / 59.0);
    let values = times.iter().zip(normals(n, 3)).map(|(t, e)| (-0.6 * t).exp() + noise * e).collect();
    (times, values)
}

const TRAIN: &str = "train = [0.0, 3.0]";

/// What must not be said beside these figures.
fn assert_true(found: &Explanation, case: &str) {
    let (left, said) = (&found.remaining, format!("{} {}", found.headline, found.remaining.shape));
    if said.contains("at their noise") {
        assert!((0.6..1.3).contains(&left.rmse_over_noise), "{case}: {said} beside {left:?}");
    }
    if said.contains("and correlated in time") {
        assert!(left.whiteness_tested && left.whiteness_p < 1e-3, "{case}: {said} beside {left:?}");
    }
    assert!(!said.contains("NaN") && !said.contains("inf "), "{case}: {said}");
    assert_eq!(found.effects.is_empty(), !matches!(found.verdict, Verdict::Named | Verdict::Tie), "{case}");
}

/// A case, its noise, its training span, times, values, the verdict, and words of the answer.
type Row<'a> = (&'a str, &'a str, &'a str, &'a [f64], &'a [f64], Verdict, &'a str);

#[test]
fn degenerate_data_get_a_sentence_of_their_own_and_no_name() {
    let (times, clean) = decaying(60, 0.0);
    let (_, noisy) = decaying(60, 0.02);
    let rounded: Vec<f64> = clean.iter().map(|v| (v * 100.0).round() / 100.0).collect();
    let jump: Vec<f64> = noisy.iter().zip(&times).map(|(v, t)| if *t < 3.0 { *v } else { v + 0.3 }).collect();
    let nine_digits: Vec<f64> = clean.iter().map(|v| (v * 1e9).round() / 1e9).collect();
    let ones = vec![1.0; 60];
    let zeros = vec![0.0; 60];
    let (no_gap, open) = (Verdict::NoGap, Verdict::Unexplained);
    let table: Vec<Row<'_>> = vec![
        (
            "as it should be",
            "0.02",
            TRAIN,
            &times,
            &noisy,
            no_gap,
            "No gap: the model explains the training data at their noise",
        ),
        ("nothing held out", "0.02", "", &times, &noisy, no_gap, "they could be noise"),
        ("without noise", "0.02", TRAIN, &times, &clean, no_gap, "the stated noise alone would hide as much"),
        (
            "noise below the digits of the file",
            "1e-12",
            TRAIN,
            &times,
            &nine_digits,
            no_gap,
            "error of integration or of the digits",
        ),
        (
            "rounded",
            "0.001",
            TRAIN,
            &times,
            &rounded,
            open,
            "the noise is larger than stated, or what is missing changes",
        ),
        ("noise too large", "0.08", TRAIN, &times, &noisy, no_gap, "the noise is smaller than stated"),
        ("noise of 1e5", "1e5", TRAIN, &times, &noisy, no_gap, "the stated noise"),
        ("constant", "0.02", TRAIN, &times, &ones, open, "data at rest cannot tell one effect from another"),
        ("constant zero", "0.02", TRAIN, &times, &zeros, no_gap, "data at rest tell little"),
        ("one sample", "0.02", "", &times[..1], &noisy[..1], no_gap, "too few in a row"),
        ("one sample far off", "0.02", "", &times[..1], &[5.0], open, "1 value is fitted with 3 parameters"),
        ("two samples", "0.02", "", &times[..2], &noisy[..2], no_gap, "too few in a row"),
        ("three rows", "0.02", "", &times[..3], &noisy[..3], no_gap, "too few in a row"),
        ("held out by a jump", "0.02", TRAIN, &times, &jump, open, "Held out and failing"),
    ];
    for (case, noise, train, times, values, verdict, words) in table {
        let found =
            of_series(noise, train, "", times, values).unwrap_or_else(|error| panic!("{case}: {error}"));
        assert_true(&found, case);
        let said = format!("{} {}", found.headline, found.remaining.shape);
        assert_eq!(found.verdict, verdict, "{case}: {said}");
        assert!(said.contains(words), "{case}: {words} in {said}");
    }
}

#[test]
fn three_rows_of_which_no_two_agree_get_no_name() {
    let found = of_series("0.02", "", "", &[0.0, 1.0, 2.0], &[1.0, 3.0, 0.2]).unwrap();
    assert_true(&found, "three rows");
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.headline);
    assert!(found.warnings.iter().any(|w| w.contains("check the noise")), "{:?}", found.warnings);
}

#[test]
fn a_noise_that_has_nothing_to_do_with_the_values_is_told_before_the_first_run() {
    let (times, noisy) = decaying(60, 0.02);
    for (noise, words) in [
        (
            "1e140",
            "the noise of y in record `a`, 1.00e140, lies so far above its values, the largest of which is",
        ),
        (
            "1e30",
            "that nothing could show: give the standard deviation of the measurement error in the channel's unit",
        ),
        ("1e-30", "the noise of y in record `a`, 1.00e-30, lies below the last digit of its values"),
        ("1e-90", "lies below the last digit of its values"),
    ] {
        let error = of_series(noise, TRAIN, "", &times, &noisy).unwrap_err();
        assert!(error.is_input() && error.to_string().contains(words), "{noise}: {error}");
        assert!(!error.to_string().contains("damaged"), "{error}");
    }
}

fn effect(name: &str, term: &str, parameter: &str) -> String {
    format!(
        "[[effects]]\nname = \"{name}\"\nsays = \"{name}.\"\nadds = [ {{ to = \"x\", term = \"{term}\" }} ]\nparameters = [ {{ name = \
         \"{parameter}\", unit = \"1/s\", range = [-1, 1] }} ]\n"
    )
}

#[test]
fn two_effects_of_the_same_function_are_told_to_be_one() {
    let (times, noisy) = decaying(60, 0.02);
    let lifted: Vec<f64> =
        times.iter().zip(&noisy).map(|(t, v)| v + 0.25 * (1.0 - (-0.6 * t).exp())).collect();
    let more = format!(
        "[explain]\nlibrary = \"study\"\n{}{}",
        effect("in1", "q1*1", "q1"),
        effect("in2", "q2", "q2")
    );
    let found = of_series("0.02", TRAIN, &more, &times, &lifted).unwrap();
    let shown = found.effects[0].name.as_str();
    let other = if shown == "in1" { "in2" } else { "in1" };
    let says = format!("The same effect by another name: `{other}`.");
    assert!(["in1", "in2"].contains(&shown) && found.headline.contains(&says), "{}", found.headline);
    let tied = found.tied_with.concat();
    assert!(!tied.iter().any(|name| name == other) && found.experiment.is_none(), "{tied:?}");
}

#[test]
fn an_effect_equal_to_a_term_of_the_model_is_absorbed_and_not_named() {
    let (times, noisy) = decaying(60, 0.02);
    let found = of_series("0.02", TRAIN, &effect("more-loss", "-q1*x", "q1"), &times, &noisy).unwrap();
    assert_eq!(found.verdict, Verdict::NoGap, "{}", found.headline);
    let refused = found.rejected.iter().find(|r| r.name == "more-loss").unwrap();
    assert_eq!(refused.gate, "absorbed");
    assert!(refused.reason.contains("the model's parameters imitate it"), "{}", refused.reason);
}

#[test]
fn a_series_without_a_value_is_refused_by_its_name() {
    let (times, _) = decaying(60, 0.02);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.csv"), csv("time,y", &[&times, &vec![f64::NAN; 60]])).unwrap();
    std::fs::write(folder.path().join("study.toml"), decay("0.02", TRAIN, "")).unwrap();
    let text = Study::load(&folder.path().join("study.toml")).unwrap_err().to_string();
    assert!(text.contains("column `y` of record `a` has no value"), "{text}");
}

#[test]
fn a_baseline_that_cannot_run_is_told() {
    let (times, values) = decaying(60, 0.02);
    let text = decay("0.02", TRAIN, "").replace("\"-k*x\"", "\"-k*x/max(0, -1 - t)\"");
    let error = explained(&Case::new(&text, &[("a.csv", csv("time,y", &[&times, &values]))])).unwrap_err();
    assert!(matches!(error, ExplainError::Baseline(_)) && error.is_input(), "{error}");
}
