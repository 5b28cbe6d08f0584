//! Faults of the place change no number: whatever fails around a study, its result is that of an undisturbed run, or an error
//! that names the cause and a resume to that result. The whole battery is ignored unless asked for: `just faults`.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod fault_kit;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use common::repository;
use fault_kit::disk;
use fault_kit::judge::{Outcome, clean, judge, nothing_left};
use fault_kit::plan::{Case, Fault, Lasts, Must, Reached, Verb, all, few};
use fault_kit::study_folder::StudyFolder;
use fault_kit::table::{PAGE, Table};

/// Lets all cases happen, as many at a time as there are cores; what is wrong with them.
fn together(cases: &[Case], table: &Mutex<Table>) -> Vec<String> {
    let (next, wrong) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
            match judge(case) {
                Ok(outcome) => table.lock().unwrap().add(case, outcome),
                Err(fault) => wrong.lock().unwrap().push(fault),
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    wrong.into_inner().unwrap()
}

fn told(wrong: &[String], n: usize) {
    assert!(wrong.is_empty(), "{} of {n} cases:\n{}", wrong.len(), wrong.join("\n\n"));
}

#[test]
fn a_fault_of_every_kind_changes_no_byte_or_is_an_error_that_resume_goes_on_from() {
    let (cases, table) = (few(), Mutex::default());
    told(&together(&cases, &table), cases.len());
    assert_eq!(table.into_inner().unwrap().n(), cases.len());
}

/// A fault that the study of the test by hand meets.
fn met(kind: &'static str, lasts: Lasts, must: Must, causes: &'static [&'static str]) -> Fault {
    Fault { kind, lasts, must, causes, says: "" }
}

#[test]
fn a_scratch_root_that_is_removed_in_the_middle_of_a_run_changes_no_byte() {
    let fault = met("scratch", Lasts::Once, Must::GoOn, &[]);
    for seed in 0..3 {
        let case = Case { seed, verb: Verb::Run, reached: Reached::Command, fault };
        assert_eq!(judge(&case), Ok(Outcome::WentOn));
    }
}

#[test]
fn a_licence_outage_in_an_explanation_is_forgotten_once_it_is_repaired() {
    let fault = met("licence", Lasts::UntilRepaired, Must::Stop, &["licence server refused: no free seat"]);
    for seed in 0..3 {
        let case = Case { seed, verb: Verb::Explain, reached: Reached::Command, fault };
        assert_eq!(judge(&case), Ok(Outcome::Resumed));
    }
}

#[test]
fn ctrl_c_ends_a_command_with_130_and_all_that_it_started_and_resume_goes_on() {
    let interrupt = met("interrupt", Lasts::Once, Must::Stop, &[]);
    for (verb, what) in [(Verb::Run, "run"), (Verb::Explain, "explanation")] {
        let undisturbed = clean(verb, Reached::Command);
        // After the trial runs, of which nothing is stored.
        for at in [undisturbed.n_run / 4, undisturbed.n_run / 2] {
            let place = StudyFolder::new(verb, Reached::Command, "");
            place.break_at(&interrupt, (at, at));
            let ended = place.go(&[]).unwrap();
            assert_eq!(ended.code, Some(130), "{}", ended.stderr);
            let out = place.out();
            let out = out.display();
            let wanted = format!(
                "error: interrupted by Ctrl-C: everything that was started is ended\n  the {what} so far is in {out}: \
                 continue it with --out {out} --resume\n"
            );
            assert!(ended.stderr.ends_with(&wanted), "{}", ended.stderr);
            nothing_left(&place, &[&ended]).unwrap();
            place.repair();
            let resumed = place.go(&["--resume"]).unwrap();
            assert_eq!(resumed.code, Some(0), "{}", resumed.stderr);
            assert!(place.result().unwrap() == undisturbed.result, "{what} at run {at}");
        }
    }
}

#[test]
fn another_program_in_the_place_of_this_one_starts_no_worker_of_the_run() {
    let undisturbed = clean(Verb::Run, Reached::Command);
    let place = StudyFolder::new(Verb::Run, Reached::Command, "");
    let own = place.path("starlings");
    std::fs::copy(env!("CARGO_BIN_EXE_starlings"), &own).unwrap();
    let half = undisturbed.n_run / 2;
    place.break_at(&met("starlings-replaced", Lasts::Once, Must::GoOn, &[]), (half, half));
    let mut command = std::process::Command::new(&own);
    command.args(place.command(&[]).get_args()).env("FAULT_STARLINGS", &own);
    place.furnish(&mut command);
    let ended = place.to_the_end(&mut command).unwrap();
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert!(place.result().unwrap() == undisturbed.result);
    assert!(std::fs::read_to_string(&own).unwrap().contains("another program"), "it was replaced");
    nothing_left(&place, &[&ended]).unwrap();
}

#[test]
fn ctrl_c_before_anything_is_computed_leaves_nothing() {
    let place = StudyFolder::new(Verb::Run, Reached::Command, "");
    place.break_at(&met("interrupt", Lasts::Once, Must::Stop, &[]), (1, 1));
    let ended = place.go(&[]).unwrap();
    assert_eq!(ended.code, Some(130), "{}", ended.stderr);
    assert!(
        ended.stderr.ends_with("error: interrupted by Ctrl-C before anything was computed: start again\n")
    );
    nothing_left(&place, &[&ended]).unwrap();
    assert!(!place.out().exists());
}

#[test]
#[ignore = "needs the Python package and MPI: .ci/solvers; and may mount file systems"]
fn two_hundred_faults_of_the_place_change_no_byte() {
    // Those whose name holds a text, such as FAULTS="Grpc paused", while one looks for the cause of a failure.
    let chosen = std::env::var("FAULTS").ok();
    let is_chosen = |case: &Case| chosen.as_ref().is_none_or(|text| case.name().contains(text));
    let (cases, table): (Vec<Case>, _) = (all().into_iter().filter(is_chosen).collect(), Mutex::default());
    let mut wrong = together(&cases, &table);
    if chosen.is_some() {
        println!("{}", table.into_inner().unwrap().page());
        return told(&wrong, cases.len());
    }
    let refused = "the full disk needs a mounted file system: `unshare -rm mount` is refused here";
    assert!(disk::may_mount(), "{refused}");
    for verb in [Verb::Run, Verb::Explain] {
        for room in disk::ROOM {
            match disk::judge(verb, room) {
                Ok(outcome) => table.lock().unwrap().add_disk(outcome),
                Err(fault) => wrong.push(fault),
            }
        }
    }
    told(&wrong, cases.len() + 2 * disk::ROOM.len());
    let table = table.into_inner().unwrap();
    assert!(table.n() >= 200, "{} cases", table.n());
    if std::env::var_os("STARLINGS_WRITE_PAGES").is_some() {
        std::fs::write(repository(PAGE), table.page()).unwrap();
    }
}
