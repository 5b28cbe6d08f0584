//! A budget is kept at every stage of the search, and a run that was lost with its workers is an error and not a failure of the
//! model.
#![allow(clippy::unwrap_used)]

mod budget_kit;
mod study_kit;

use budget_kit::{Counting, brink, go, stage, vessel};
use starlings_coordinator::explain::locate::MOST_RUNS;
use starlings_coordinator::explain::{ExplainError, Explanation, Verdict};
use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::RunError;
use study_kit::Case;

/// Every budget from one run to more than the full search needs. From that of the fit on they share a folder: remembered runs are
/// not computed again, and still count against the budget.
fn kept(case: &Case) -> Vec<Explanation> {
    let full = go(case, &case.fresh(), &mut InProcess::new(2), None).unwrap();
    let folder = case.fresh();
    let mut found = Vec::new();
    // The search for unknown inputs starts only if the budget suffices for the most runs that it may need.
    for budget in 1..=full.runs + (MOST_RUNS + 2 * 2) as u64 {
        let mut fleet = Counting::new(None);
        let path = if budget <= stage(&full, "fit") { case.fresh() } else { folder.clone() };
        match go(case, &path, &mut fleet, Some(budget)) {
            Ok(cut) => {
                assert!(cut.runs <= budget, "{} of {budget}: {:?}", cut.runs, cut.runs_by_stage);
                // An unknown input is followed window by window: many jobs for one run of a record.
                assert!(
                    fleet.jobs <= budget || stage(&cut, "locate") > 1,
                    "{} computed of {budget}",
                    fleet.jobs
                );
                found.push(cut);
            }
            // The fit, and one run for the courses of the fitted model.
            Err(ExplainError::Budget { .. }) => {
                assert!(fleet.jobs <= budget && budget <= stage(&full, "fit"), "{} of {budget}", fleet.jobs);
            }
            Err(error) => panic!("{error}"),
        }
    }
    assert_eq!(found.last().unwrap().runs_by_stage, full.runs_by_stage);
    found
}

#[test]
fn no_budget_is_exceeded_with_a_model_that_has_a_step_of_its_own() {
    let found = kept(&vessel());
    let full = found.last().unwrap();
    assert_ne!(full.verdict, Verdict::NoGap, "{}", full.headline);
    assert!(stage(full, "refit") > 0 && stage(full, "locate") > 1, "{:?}", full.runs_by_stage);
}

#[test]
fn no_budget_is_exceeded_where_the_model_fails_on_one_side_and_a_candidate_is_measured_again() {
    let found = kept(&brink());
    let full = found.last().unwrap();
    assert!(matches!(full.verdict, Verdict::Named | Verdict::Tie), "{}", full.headline);
    // A refit that the budget cut off may still be the best; then a warning says that it has not converged.
    let told =
        |e: &Explanation| e.warnings.iter().any(|w| w.contains("has not converged") || w.contains("secant"));
    assert!(found.iter().any(|e| !e.effects.is_empty() && told(e)));
    assert!(!told(full), "{:?}", full.warnings);
}

#[test]
fn a_run_that_was_lost_ends_the_explanation_whatever_it_was_for() {
    let case = brink();
    let mut fleet = Counting::new(None);
    let folder = case.fresh();
    let full = go(&case, &folder, &mut fleet, None).unwrap();
    assert!(full.experiment.is_some() && stage(&full, "add") > 0, "{:?}", full.runs_by_stage);
    for lost in 0..fleet.calls {
        let found = go(&case, &case.fresh(), &mut Counting::new(Some(lost)), None);
        let Err(ExplainError::Run(RunError::NoAnswer { record, reason, .. })) = found else {
            panic!("call {lost} of {}: {found:?}", fleet.calls)
        };
        assert!(record == "emptying" && reason.contains("the machine went away"), "{record}: {reason}");
    }
}

#[test]
fn the_runs_of_an_experiment_are_remembered_too() {
    let case = brink();
    let folder = case.fresh();
    let full = go(&case, &folder, &mut InProcess::new(1), None).unwrap();
    let mut again = Counting::new(None);
    let mut found = go(&case, &folder, &mut again, None).unwrap();
    found.workers = full.workers;
    assert_eq!(found, full);
    // Unknown inputs are followed window by window, and these runs are not remembered; all others are.
    let followed = again.jobs;
    assert!(followed > 0, "one state's input is felt");
    let windows = 61;
    assert_eq!(
        again.calls,
        2 + 1 + windows,
        "two batches for all equations, then the start and every window of one"
    );
}

#[test]
fn a_budget_that_leaves_nothing_to_be_tried_is_told_with_one_that_would_do() {
    let case = vessel();
    let full = go(&case, &case.fresh(), &mut InProcess::new(2), None).unwrap();
    let least = stage(&full, "fit") + 1;
    let cut = go(&case, &case.fresh(), &mut InProcess::new(2), Some(least)).unwrap();
    let told = format!(
        "The budget of {least} runs is too small: nothing was tried; a first look at every effect needs "
    );
    let (_, needed) = cut.headline.split_once(&told).unwrap_or_else(|| panic!("{}", cut.headline));
    let needed: u64 = needed.split(',').next().unwrap().parse().unwrap();
    let less = go(&case, &case.fresh(), &mut InProcess::new(2), Some(needed - 1)).unwrap();
    assert!(less.headline.contains("nothing was tried"), "{}", less.headline);
    let enough = go(&case, &case.fresh(), &mut InProcess::new(2), Some(needed)).unwrap();
    assert!(
        !enough.headline.contains("nothing was tried") && !enough.screened.is_empty(),
        "{}",
        enough.headline
    );
}
