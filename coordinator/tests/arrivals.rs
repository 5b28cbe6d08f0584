//! Runs that arrived before their batch was over are not made again by a resume.
#![allow(clippy::unwrap_used, clippy::print_stdout)] // a failed unwrap is a failed test; timings are printed

mod study_kit;

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::time::Instant;

use starlings_coordinator::fleet::{Arrived, Fleet, FleetError, Held, InProcess, Outcome, SetupId, job_key};
use starlings_coordinator::study::store::table;
use starlings_models::{Job, Setup};
use study_kit::{Case, Done, linear};

/// Tells of outcomes in portions, as a fleet does whose batches are long, and dies once it has told of so many.
struct Telling {
    inner: InProcess,
    portion: usize,
    /// Outcomes that it may still tell of.
    left: usize,
    /// Runs made, by setup and parameters.
    made: Vec<(SetupId, Job<Held>)>,
}

impl Telling {
    fn new(portion: usize, left: usize) -> Self {
        Self { inner: InProcess::new(2), portion, left, made: Vec::new() }
    }
}

impl Fleet for Telling {
    fn install(&mut self, setup: &Setup) -> Result<SetupId, FleetError> {
        self.inner.install(setup)
    }

    fn run_mixed(&mut self, _: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError> {
        unreachable!("states are held")
    }

    fn run_held(&mut self, jobs: Vec<(SetupId, Job<Held>)>) -> Result<Vec<Outcome<Held>>, FleetError> {
        self.run_telling(jobs, &mut |_| ControlFlow::Continue(()))
    }

    fn run_telling(
        &mut self,
        jobs: Vec<(SetupId, Job<Held>)>,
        arrived: Arrived<'_>,
    ) -> Result<Vec<Outcome<Held>>, FleetError> {
        let outcomes = self.inner.run_held(jobs.clone())?;
        // The last first: whoever keeps them must go by their places.
        let mut told: Vec<(usize, Outcome<Held>)> = outcomes.iter().cloned().enumerate().collect();
        told.reverse();
        told.truncate(self.left);
        self.left -= told.len();
        self.made.extend(told.iter().map(|(index, _)| jobs[*index].clone()));
        while !told.is_empty() {
            let some = told.drain(..self.portion.min(told.len())).collect();
            if arrived(some).is_break() {
                return Err(FleetError::Cancelled);
            }
        }
        if self.left == 0 { Err(FleetError::Cancelled) } else { Ok(outcomes) }
    }

    fn n_workers(&self) -> usize {
        1
    }

    fn slots(&self) -> usize {
        2
    }
}

fn rows(done: &Done) -> usize {
    table(&done.folder.store, "jobs", "particle").unwrap().len()
}

/// A study of so many recordings, fitted in one or two ensembles.
fn records(n: usize) -> Case {
    let (times, z) = linear::data(12, 8);
    let one = |i: usize| linear::record(&format!("r{i}"), "line.csv", linear::NOISE, "");
    let records = (0..n).map(one).collect::<String>();
    let study = linear::study_of("kind = \"batch\"", &records);
    Case::new(&study, &[("line.csv", linear::file(&times, &z))])
}

#[test]
fn a_run_that_arrived_is_not_made_again_wherever_the_coordinator_dies() {
    let (times, z) = linear::data(6, 8);
    let case = Case::new(&linear::study("passes = 2"), &[("line.csv", linear::file(&times, &z))]);
    let mut unharmed = Telling::new(usize::MAX, usize::MAX);
    let whole = case.run_on(&mut unharmed).unwrap();
    // In the middle of a batch of every stage: of the fit, the forward run, the constants.
    for dies_after in (1..unharmed.made.len()).step_by(3) {
        let path = case.fresh();
        let mut first = Telling::new(2, dies_after);
        assert!(case.go(&path, &mut first).is_err());
        let mut second = Telling::new(2, usize::MAX);
        let resumed = case.go(&path, &mut second).unwrap();
        assert_eq!(resumed.csv, whole.csv, "after {dies_after} runs");
        assert_eq!(first.made.len() + second.made.len(), unharmed.made.len(), "after {dies_after} runs");
        assert_eq!(resumed.summary.runs, whole.summary.runs);
        assert_eq!(rows(&resumed), rows(&whole), "each run has its row");
        let left = resumed.folder.store.arrived_keys().unwrap();
        assert_eq!(left.len(), 0, "what the result was made of is not kept twice");
    }
}

#[test]
fn a_batch_that_is_cut_short_many_times_makes_each_run_once() {
    let case = records(5);
    let mut unharmed = Telling::new(usize::MAX, usize::MAX);
    let whole = case.run_on(&mut unharmed).unwrap();
    let path = case.fresh();
    let mut made = Vec::new();
    let done = loop {
        let mut fleet = Telling::new(3, 4);
        let went = case.go(&path, &mut fleet);
        made.extend(fleet.made);
        if let Ok(done) = went {
            break done;
        }
        assert!(made.len() <= unharmed.made.len(), "it goes on for ever");
    };
    assert_eq!(done.csv, whole.csv);
    let key = |(setup, job): &(SetupId, Job<Held>)| job_key(setup, job);
    assert_eq!(made.iter().map(key).collect::<BTreeSet<_>>(), unharmed.made.iter().map(key).collect());
    assert_eq!(made.len(), unharmed.made.len());
}

/// The same with parameters that all recordings share: without a starting value for each.
fn shared(n: usize) -> Case {
    let (times, z) = linear::data(12, 8);
    let one = |i: usize| linear::record(&format!("r{i}"), "line.csv", linear::NOISE, "");
    let study = linear::study_of("kind = \"batch\"", &(0..n).map(one).collect::<String>());
    let (head, tail) = study.split_once("[[parameters]]\nname = \"initial:x\"").unwrap();
    let tail = tail.split_once('\n').unwrap().1.split_once('\n').unwrap().1;
    Case::new(&format!("{head}{tail}"), &[("line.csv", linear::file(&times, &z))])
}

/// How long a resume takes that finds so many runs.
fn resumed_after(n_run: usize) {
    // Three runs or more of each recording: the coordinator dies in the middle of the first ensemble.
    let case = shared(n_run / 2);
    let path = case.fresh();
    let started = Instant::now();
    case.study();
    println!("the study is read in {:.2} s", started.elapsed().as_secs_f64());
    let started = Instant::now();
    assert!(case.go(&path, &mut Telling::new(500, n_run)).is_err());
    println!("{n_run} runs made and kept in {:.2} s", started.elapsed().as_secs_f64());
    let started = Instant::now();
    let mut fleet = First { inner: Telling::new(500, usize::MAX), started, after: None };
    assert!(case.go(&path, &mut fleet).is_err(), "it is over when it is asked");
    let (after, asked) = fleet.after.unwrap();
    println!("resumed: the first runs are asked for after {after:.2} s, {asked} of them");
    assert!(after < 5.0, "{after} s");
}

/// Notes when it is first asked for runs.
struct First {
    inner: Telling,
    started: Instant,
    after: Option<(f64, usize)>,
}

impl Fleet for First {
    fn install(&mut self, setup: &Setup) -> Result<SetupId, FleetError> {
        self.inner.install(setup)
    }

    fn run_mixed(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError> {
        self.after.get_or_insert((self.started.elapsed().as_secs_f64(), jobs.len()));
        Err(FleetError::Cancelled)
    }

    fn n_workers(&self) -> usize {
        1
    }

    fn slots(&self) -> usize {
        2
    }
}

#[test]
#[ignore = "times a release build: `just deaths`"]
fn a_resume_that_finds_ten_thousand_runs_computes_again_within_five_seconds() {
    resumed_after(10_000);
}
