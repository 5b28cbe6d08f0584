//! Explanations end to end, in process: what is named, what is refused, and that neither depends on the fleet that computed it.
#![allow(missing_docs, clippy::unwrap_used)]

mod explain_kit;
mod study_kit;

use explain_kit::{cubic, explained, go, recording, sets, study, watched};
use starlings_coordinator::explain::{ExplainError, Options, Verdict};
use starlings_coordinator::fleet::{Fleet, InProcess};
use starlings_coordinator::study::store::Store;
use starlings_coordinator::study::{Stage, Study};
use study_kit::Case;
use study_kit::fleets::{Mortal, Shuffled};

#[test]
fn a_hidden_effect_is_named_added_and_the_gap_shrinks_where_nothing_was_fitted() {
    let (text, data) = cubic();
    let case = Case::new(&text, &[("free.csv", data)]);
    let folder = case.fresh();
    let findings = go(&case, &folder, &mut InProcess::new(2), &Options::default()).unwrap();
    let found = &findings.explanation;
    assert_eq!(found.verdict, Verdict::Named, "{}", found.headline);
    assert_eq!(found.effects[0].name, "cubic-stiffness", "{}", found.headline);
    let amplitude = &found.effects[0].parameters[0];
    // Five posterior sd, for one draw of the noise.
    assert!((amplitude.estimate - 2.0).abs() < 5.0 * amplitude.sd && amplitude.sd < 0.2, "{amplitude:?}");
    let held_out = found.gap.iter().find(|row| row.usage == "held-out").unwrap();
    assert!(held_out.after < 1.15 * held_out.noise && held_out.before > 2.0 * held_out.noise, "{held_out:?}");
    let k = found.parameter_shifts.iter().find(|p| p.name == "k").unwrap();
    assert!((k.before - 10.0).abs() > (k.after - 10.0).abs(), "{k:?}");
    // The study that it proposes runs as it is and knows the effect as part of its model.
    let text = findings.explained_study.unwrap();
    let path = folder.join("explained.toml");
    std::fs::write(&path, &text).unwrap();
    let explained = Study::load(&path).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert!(explained.setup.effects.iter().any(|e| e.name == "cubic-stiffness"));
}

#[test]
fn an_effect_that_only_the_study_describes_is_named_like_any_other() {
    let text = study("", "");
    let data = recording(&text, &[("wind", 0.6)], &[], 2);
    let found = explained(&text, data).explanation;
    assert!(sets(&found).contains(&vec!["wind".to_owned()]), "{}", found.headline);
}

#[test]
fn nothing_is_named_where_nothing_is_missing() {
    let text = study("", "");
    for seed in 0..4 {
        let found = explained(&text, recording(&text, &[], &[], seed)).explanation;
        assert_eq!(found.verdict, Verdict::NoGap, "seed {seed}: {}", found.headline);
        assert!(found.effects.is_empty() && found.explained_study.is_none());
        // By chance the largest of a few dozen scores exceeds most of the decoys, but not all.
        assert!(found.false_alarm.decoys < 0.5, "seed {seed}: {}", found.false_alarm.decoys);
    }
}

#[test]
fn the_same_study_gives_the_same_explanation_whoever_computes_it() {
    let (text, data) = cubic();
    let case = Case::new(&text, &[("free.csv", data)]);
    let once = |fleet: &mut dyn Fleet| {
        let mut found = go(&case, &case.fresh(), fleet, &Options::default()).unwrap();
        found.explanation.workers = 0;
        (serde_json::to_string(&found.explanation).unwrap(), serde_json::to_string(&found.figures).unwrap())
    };
    let one = once(&mut InProcess::new(1));
    assert!(one == once(&mut InProcess::new(4)), "four threads");
    assert!(one == once(&mut Shuffled::new(2)), "another order of computation");
}

#[test]
fn a_killed_explanation_is_continued_without_a_run_made_twice() {
    let (text, data) = cubic();
    let case = Case::new(&text, &[("free.csv", data)]);
    let mut once = Mortal::new(usize::MAX);
    let whole = go(&case, &case.fresh(), &mut once, &Options::default()).unwrap().explanation;
    for left in [1, 4, 9] {
        let folder = case.fresh();
        let killed = go(&case, &folder, &mut Mortal::new(left), &Options::default());
        assert!(killed.is_err(), "killed after {left} batches");
        let before = Store::open(&folder.join("run.db")).unwrap().remembered_runs().unwrap().len();
        assert!(before > 0);
        let mut again = Mortal::new(usize::MAX);
        let mut found = go(&case, &folder, &mut again, &Options::default()).unwrap().explanation;
        found.workers = whole.workers;
        assert_eq!(found, whole, "after {left} batches");
        // The runs of the batches before the kill are not made a second time.
        assert_eq!(again.answered, once.answered - left, "after {left} batches");
    }
}

#[test]
fn a_budget_ends_the_search_and_says_what_was_left_untried() {
    let (text, data) = cubic();
    let case = Case::new(&text, &[("free.csv", data)]);
    let full = go(&case, &case.fresh(), &mut InProcess::new(2), &Options::default()).unwrap().explanation;
    let options = Options { budget: Some(full.runs / 2), ..Options::default() };
    let cut = go(&case, &case.fresh(), &mut InProcess::new(2), &options).unwrap().explanation;
    assert!(cut.runs <= full.runs / 2, "{} of {}", cut.runs, full.runs / 2);
    assert!(
        !cut.untried.is_empty() && cut.warnings.iter().any(|w| w.contains("budget")),
        "{:?}",
        cut.warnings
    );
    let options = Options { budget: Some(3), ..Options::default() };
    let error = go(&case, &case.fresh(), &mut InProcess::new(2), &options).unwrap_err();
    assert!(matches!(error, ExplainError::Budget { budget: 3, stage: "fit", .. }), "{error}");
}

/// Gate and reason of a further candidate that adds `term`; what is missing is named in spite of it.
fn refusal(term: &str) -> (String, String) {
    let useless = format!(
        "\n[[effects]]\nname = \"useless\"\nsays = \"It explains nothing.\"\nadds = [ {{ to = \"v\", term = \"{term}\" }} ]\nparameters = [ {{ name = \"b_useless\", range = [0, 1] }} ]\n"
    );
    let (text, data) = cubic();
    let found = explained(&(text + &useless), data).explanation;
    assert_eq!(found.effects[0].name, "cubic-stiffness", "the others go on: {}", found.headline);
    let refused = found.rejected.into_iter().find(|r| r.name == "useless").unwrap();
    (refused.gate, refused.reason)
}

#[test]
fn a_candidate_that_changes_nothing_has_no_influence_and_has_not_failed() {
    assert_eq!(refusal("b_useless*max(0, -1 - t)").0, "no influence");
}

#[test]
fn a_candidate_whose_runs_all_fail_is_refused_with_the_reason() {
    let (gate, reason) = refusal("b_useless/max(0, -1 - t)");
    assert_eq!(gate, "failed");
    assert!(reason.contains("not a finite number"), "{reason}");
}

#[test]
fn a_term_of_the_model_is_swapped_where_only_a_replacement_is_right() {
    // The truth has dry friction and no viscous one; the model's viscous term may be replaced.
    let text = study(
        "replaceable = [\"viscous\"]",
        "only = [\"coulomb-friction\", \"cubic-stiffness\", \"quadratic-drag\"]",
    );
    let data = recording(&text, &[("coulomb-friction", 0.35)], &[("c", 1e-6)], 5);
    let case = Case::new(&text, &[("free.csv", data)]);
    let mut told = Vec::new();
    let watch = &mut |stage: &Stage| told.push(stage.says.clone());
    let found = watched(&case, &case.fresh(), &mut InProcess::new(2), &Options::default(), watch);
    let found = found.unwrap_or_else(|error| panic!("{error}")).explanation;
    assert!(told.iter().any(|detail| detail.contains("without viscous")), "{told:?}");
    assert!(sets(&found).contains(&vec!["coulomb-friction".to_owned()]), "{}", found.headline);
    let held_out = found.gap.iter().find(|row| row.usage == "held-out").unwrap();
    assert!(held_out.after < 1.2 * held_out.noise, "{held_out:?}");
}

#[test]
fn two_missing_effects_are_found_as_a_pair() {
    let text = study("", "only = [\"coulomb-friction\", \"cubic-stiffness\", \"quadratic-stiffness\"]");
    let data = recording(&text, &[("coulomb-friction", 0.2), ("quadratic-stiffness", 0.8)], &[], 6);
    let found = explained(&text, data).explanation;
    let mut names: Vec<&str> = found.effects.iter().map(|e| e.name.as_str()).collect();
    names.sort_unstable();
    assert_eq!(names, ["coulomb-friction", "quadratic-stiffness"], "{}", found.headline);
}

#[test]
fn a_tie_lists_its_class_and_proposes_an_experiment() {
    // Two effects with nearly the same force: the data of a decaying swing cannot tell them apart.
    let twin = "\n[[effects]]\nname = \"breeze\"\nsays = \"A wind a little weaker.\"\nadds = [ { to = \"v\", term = \"-w_breeze*(v + 0.499)*abs(v + 0.499)\" } ]\nparameters = [ { name = \"w_breeze\", unit = \"1/m\", range = [0, 10] } ]\n";
    let text = study("", "only = [\"wind\", \"breeze\", \"cubic-stiffness\"]") + twin;
    let data = recording(&text, &[("wind", 0.6)], &[], 7);
    let found = explained(&text, data).explanation;
    assert_eq!(found.verdict, Verdict::Tie, "{}", found.headline);
    let all: Vec<String> = sets(&found).concat();
    assert!(all.contains(&"wind".to_owned()) && all.contains(&"breeze".to_owned()), "{all:?}");
    let experiment = found.experiment.unwrap();
    assert!(
        experiment.separation > experiment.separation_now && !experiment.says.is_empty(),
        "{experiment:?}"
    );
}

#[test]
fn the_false_alarm_rate_is_measured_on_recordings_without_a_gap() {
    let (text, data) = cubic();
    let case = Case::new(&text, &[("free.csv", data)]);
    let options = Options { nulls: 6, ..Options::default() };
    let found = go(&case, &case.fresh(), &mut InProcess::new(2), &options).unwrap().explanation;
    let nulls = found.false_alarm.nulls.unwrap();
    // The search names at half a percent by chance: six recordings without a name are nearly certain.
    assert_eq!((nulls.names, nulls.of), (0, 6));
    assert!(nulls.upper95 > 0.3 && nulls.runs > 0 && found.runs > nulls.runs, "{nulls:?}");
}
