//! What is left, and whether the end is told, from course to course.

use super::*;

fn foreseen(nulls: f64) -> Foreseen {
    Foreseen {
        course: Course::Fit,
        done: [0.0; 7],
        before: [0.0; 7],
        at: FIT,
        records: 2.0,
        moved: 3.0,
        candidates: [30.0, 50.0],
        values: 1000.0,
        nulls,
    }
}

fn left(of: &Foreseen, kind: usize) -> f64 {
    of.work(0).parts[kind].left
}

/// The search has screened its candidates, and scores them again with one that passed the gates.
fn again() -> Foreseen {
    let mut of = foreseen(0.0);
    of.count(60);
    of.goes(Course::Screen);
    of.stage("screen");
    of.count(110);
    of.goes(Course::Refit);
    of.stage("refit");
    of.count(200);
    of.goes(Course::Again(30));
    of.stage("screen");
    of
}

#[test]
fn the_end_is_told_from_where_something_passed_the_gates() {
    let mut of = foreseen(0.0);
    assert!(!of.work(0).ends, "the fit");
    of.goes(Course::Refit);
    assert!(!of.work(0).ends, "refits, after which pairs may be tried");
    of.stage("verdict");
    assert!(!of.work(0).ends, "a verdict on what did not pass");
    let mut of = again();
    assert!(of.work(0).ends);
    of.stage("verdict");
    assert!(of.work(0).ends && left(&of, SCREEN).abs() < 1e-9, "what is not scored again is not left");
    of.stage("fit");
    assert!(!of.work(0).ends, "all of it in units of another noise");
}

#[test]
fn what_is_scored_again_is_done_run_by_run() {
    let mut of = again();
    let all = left(&of, SCREEN);
    // All of them now, and once more where something is refitted beside it.
    assert!((all - 1.5 * 2.0 * 30.0 * 1.3).abs() < 1e-9, "{all}");
    of.count(40);
    assert!((left(&of, SCREEN) - (all - 40.0)).abs() < 1e-9);
    let next = of.work(10);
    assert!((next.parts[SCREEN].left - (all - 30.0)).abs() < 1e-9 && next.at == SCREEN, "{next:?}");
    of.goes(Course::Last(30));
    assert!((left(&of, SCREEN) - 2.0 * 30.0 * 1.3).abs() < 1e-9 && left(&of, REFIT).abs() < 1e-9);
}

#[test]
fn the_coordinators_own_work_is_left_until_its_stage_ends() {
    let mut of = again();
    of.stage("verdict");
    assert!((left(&of, VERDICT) - 1.0).abs() < 1e-9);
    of.stage("add");
    assert!(left(&of, VERDICT).abs() < 1e-9 && (left(&of, FILES) - 1.0).abs() < 1e-9);
    of.stage("show");
    assert!((left(&of, FILES) - 1.0).abs() < 1e-9 && left(&of, OTHER).abs() < 1e-9);
}

#[test]
fn recordings_without_a_gap_are_foreseen_by_those_before() {
    let of = foreseen(4.0);
    assert!(!of.null(0, 0).ends, "no one was searched");
    let after = of.null(1, 90);
    assert!(after.ends && (after.parts[NULLS].left - 270.0).abs() < 1e-9, "{after:?}");
}
