//! The study with an effect in it: it keeps the author's text, runs as it is, and has the same model as the variant.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use starlings_coordinator::explain::result::Coefficient;
use starlings_coordinator::explain::{PatchEffect, PatchError, explained_study};
use starlings_coordinator::study::Study;
use starlings_coordinator::study::trial::trial;
use starlings_models::EffectDef;
use starlings_models::effect::{Addition, EffectParameter, library};

const WINDKESSEL: &str = r#"# A pig's aorta.
[study]
name = "aorta"   # short

[model]
kind = "windkessel-2"

[[parameters]]
name = "R"
prior = { transform = "log", median = 3.0, factor = 2.0 }

# Compliance of the whole tree.
[[parameters]]
name = "C"
prior = { transform = "log", median = 1.0, factor = 2.0 }

[[records]]
name = "beat"
file = "data/beat.csv"
inputs = { flow = "pump.csv:flow.in" }
channels = [ { column = "pressure", output = "pressure", noise = 2.0 } ]
train = [0.0, 0.3]
every = 3

[explain]
library = "built-in"
budget = 400
"#;

const SPRING: &str = r#"[study]
name = "spring"

[model]
kind = "equations"
constants = { m = 1.0 }
outputs = [ { name = "position", unit = "m", value = "x" } ]
replaceable = ["viscous"]

[[model.states]]
name = "x"
unit = "m"
initial = 0.1
rate = "v"

[[model.states]]
name = "v"
unit = "m/s"
initial = 0.0
rate = { "spring.1" = "-k*x/m", viscous = "-c*v/m" } # two forces

[[parameters]]
name = "k"
prior = { transform = "log", median = 4.0, factor = 2.0 }

[[parameters]]
name = "c"
prior = { transform = "log", median = 0.2, factor = 2.0 }

[[effects]]
name = "dry"
says = "the mass rubs"
adds = [ { to = "v", term = "-mu*tanh(v/vs)" } ]
parameters = [ { name = "mu", unit = "m/s^2", range = [0, 5] }, { name = "vs", grid = [0.01, 0.02, 0.05], range = [0.001, 1], rounds = true } ]

[[effects]]
name = "thick"
adds = [ { to = "v", term = "-c3*c*v^3" } ]
parameters = [ { name = "c3", range = [0, 5] } ]

[[records]]
name = "one"
file = "spring.csv"
channels = [ { column = "position", output = "position", noise = 0.01 } ]
"#;

/// A folder with a study in `studies/` and its recordings, and a run folder beside it.
struct Case {
    dir: tempfile::TempDir,
}

impl Case {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        for folder in ["studies/data", "runs/one"] {
            fs::create_dir_all(dir.path().join(folder)).unwrap();
        }
        let write =
            |name: &str, text: String| fs::write(dir.path().join("studies").join(name), text).unwrap();
        let rows = |heading: &str, of: &dyn Fn(f64) -> f64| {
            let row = |i: usize| format!("{},{}\n", 0.1 * i as f64, of(0.1 * i as f64));
            format!("{heading}\n{}", (0..8).map(row).collect::<String>())
        };
        write("data/beat.csv", rows("time,pressure", &|t| 100.0 + 10.0 * t));
        write("pump.csv", rows("time,flow.in", &|t| 50.0 * t.sin()));
        write("spring.csv", rows("time,position", &|t| 0.1 * (2.0 * t).cos()));
        Self { dir }
    }

    fn run_folder(&self) -> PathBuf {
        self.dir.path().join("runs/one")
    }

    fn study(&self, text: &str) -> Study {
        load(&self.dir.path().join("studies/study.toml"), text)
    }

    /// The patched study as it stands in the run folder.
    fn patched(&self, text: &str, effects: &[PatchEffect], removed: &[&str]) -> Study {
        let removed: Vec<String> = removed.iter().map(|term| (*term).to_owned()).collect();
        let patched = explained_study(&self.study(text), effects, &removed, &self.run_folder()).unwrap();
        load(&self.run_folder().join("explained.toml"), &patched)
    }
}

fn load(file: &Path, text: &str) -> Study {
    Study::from_text(file, text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn value(name: &str, estimate: f64, sd: f64) -> Coefficient {
    let interval95 = [estimate - 2.0 * sd, estimate + 2.0 * sd];
    Coefficient { name: name.to_owned(), unit: String::new(), estimate, sd, interval95 }
}

/// The misfit of a run at the prior medians: equal for equal models with equal medians.
fn misfit(study: &Study) -> Vec<f64> {
    trial(study).unwrap().iter().map(|channel| channel.rmse).collect()
}

fn dry(study: &Study) -> EffectDef {
    study.candidates.iter().find(|effect| effect.name == "dry").unwrap().clone()
}

#[test]
fn a_built_in_effect_is_written_out_and_runs_as_if_written_by_hand() {
    let case = Case::new();
    let study = case.study(WINDKESSEL);
    let def = library(&study.spec).into_iter().find(|e| e.adds.iter().any(|a| a.to == "pressure")).unwrap();
    let amplitude = def.parameters[0].name.clone();
    let values = vec![value(&amplitude, 0.08, 0.01)];
    let name = def.name.clone();
    let patched = case.patched(WINDKESSEL, &[PatchEffect { def, values }], &[]);
    assert_eq!(patched.name, "aorta-explained");
    assert_eq!(patched.setup.effects.len(), 1);
    assert_eq!(patched.explain.budget, Some(400));
    assert_eq!(patched.records[0].every, 3);
    for kept in
        ["# A pig's aorta.", "# short", "# Compliance of the whole tree.", "[explain]", "train = [0.0, 0.3]"]
    {
        assert!(patched.text.contains(kept), "no `{kept}` in\n{}", patched.text);
    }
    let by_hand = format!(
        "{WINDKESSEL}\n[[effects]]\nname = \"{name}\"\nbuilt_in = \"{name}\"\n[[parameters]]\nname = \"{amplitude}\"\nprior = {{ transform = \"log\", median = 0.08, factor = 2.0 }}\n"
    );
    let by_hand = case.study(&by_hand);
    // The same model with the same medians gives the same bits.
    assert_eq!(misfit(&patched), misfit(&by_hand));
    assert_ne!(misfit(&patched), misfit(&study));
}

#[test]
fn files_are_found_from_the_new_place() {
    let case = Case::new();
    let patched = case.patched(WINDKESSEL, &[], &[]);
    assert!(patched.text.contains("\"../../studies/data/beat.csv\""), "{}", patched.text);
    assert!(patched.text.contains("\"../../studies/pump.csv:flow.in\""), "{}", patched.text);
    assert_eq!(misfit(&patched), misfit(&case.study(WINDKESSEL)));
}

#[test]
fn an_effect_that_the_study_describes_is_not_described_twice() {
    let case = Case::new();
    let study = case.study(SPRING);
    let found =
        PatchEffect { def: dry(&study), values: vec![value("mu", 0.3, 0.02), value("vs", 0.02, 0.0)] };
    let patched = case.patched(SPRING, &[found], &[]);
    assert_eq!(patched.text.matches("name = \"dry\"").count(), 1);
    assert!(dry(&study).parameters[1].is_rounding && !dry(&study).parameters[0].is_rounding);
    assert_eq!(patched.setup.effects.len(), 1);
    // It was not estimated, and so it is a constant.
    assert!((patched.setup.model.constants["vs"] - 0.02).abs() < 1e-15);
    let by_hand = SPRING.replace("m = 1.0", "m = 1.0, vs = 0.02")
        + "[[parameters]]\nname = \"mu\"\nprior = { transform = \"log\", median = 0.3, factor = 2.0 }\n";
    let of_hand = misfit(&case.study(&by_hand));
    for (a, b) in misfit(&patched).iter().zip(&of_hand) {
        // The logit of the range and the logarithm round differently.
        assert!((a - b).abs() < 1e-9 * b, "{a} {b}");
    }
}

#[test]
fn a_replaced_term_goes_with_the_parameters_that_only_it_used() {
    let case = Case::new();
    let study = case.study(SPRING);
    let found =
        PatchEffect { def: dry(&study), values: vec![value("mu", 0.3, 0.02), value("vs", 0.02, 0.004)] };
    let patched = case.patched(SPRING, &[found], &["viscous"]);
    let names: Vec<&str> = patched.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["k", "mu", "vs"]);
    assert!(patched.candidates.is_empty(), "an effect that needs `c` cannot stay: {}", patched.text);
    assert!(!patched.text.contains("viscous"), "{}", patched.text);
    assert!(patched.text.contains("# two forces"), "{}", patched.text);
}

#[test]
fn a_rate_that_loses_its_only_term_is_zero() {
    let case = Case::new();
    let text = SPRING.replace("[\"viscous\"]", "[\"x\"]").replace("initial = 0.1", "initial = \"0.1\"");
    let patched = case.patched(&text, &[], &["x"]);
    let equations = patched.setup.model.equations.unwrap();
    assert_eq!(equations.states[0].rate, [("x".to_owned(), "0".to_owned())]);
}

#[test]
fn names_with_dots_and_several_equations_survive() {
    let case = Case::new();
    let parameter =
        |name: &str, range| EffectParameter { name: name.to_owned(), range, ..EffectParameter::default() };
    let add = |to: &str, term: &str| Addition { to: to.to_owned(), term: term.to_owned() };
    let def = EffectDef {
        name: "leak:x.v".to_owned(),
        says: "a \"quoted\" sentence".to_owned(),
        adds: vec![add("v", "-q*x*a"), add("position", "0.1*q")],
        parameters: vec![
            parameter("q", [f64::NEG_INFINITY, 0.0]),
            EffectParameter { is_rounding: true, ..parameter("a", [0.0, 1.0]) },
        ],
        ..EffectDef::default()
    };
    let values = vec![value("q", -0.4, 0.1), value("a", 1.0, 0.3)];
    let patched = case.patched(SPRING, &[PatchEffect { def: def.clone(), values }], &[]);
    assert_eq!(patched.setup.effects, [def]);
    assert_eq!(patched.setup.model.equations.unwrap().states[1].rate[0].0, "spring.1");
}

#[test]
fn lists_written_in_brackets_stay_so() {
    let case = Case::new();
    let head = SPRING.split("[[parameters]]").next().unwrap();
    let tail = &SPRING[SPRING.find("[[records]]").unwrap()..];
    let lists = r#"
parameters = [
  { name = "k", prior = { transform = "log", median = 4.0, factor = 2.0 } },
  { name = "c", prior = { transform = "log", median = 0.2, factor = 2.0 } },
]
effects = []
"#;
    let text = format!("{lists}{head}{tail}");
    let def = dry(&case.study(SPRING));
    let values = vec![value("mu", 0.3, 0.02), value("vs", 0.02, 0.01)];
    let patched = case.patched(&text, &[PatchEffect { def, values }], &[]);
    assert_eq!(patched.setup.effects.len(), 1);
    assert!(!patched.text.contains("[[parameters]]"), "{}", patched.text);
}

#[test]
fn a_term_that_is_nowhere_is_named() {
    let case = Case::new();
    let study = case.study(SPRING);
    let refused = explained_study(&study, &[], &["drag".to_owned()], &case.run_folder());
    assert!(matches!(&refused, Err(PatchError::NoTerm(term)) if term == "drag"), "{refused:?}");
}
