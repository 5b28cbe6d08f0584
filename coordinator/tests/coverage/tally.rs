//! Counts over the draws: intervals that hold the truth, distances from it, warnings, passes, runs.

use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::predicted::{self, PredictedCourse};
use starlings_coordinator::study::store::Purpose;
use starlings_coordinator::study::{RunContext, RunFolder, Study, Summary, run::run as run_study};

use crate::systems::System;

/// An estimate in transformed units.
#[derive(Clone, Debug)]
pub(crate) struct Estimate {
    pub(crate) name: String,
    pub(crate) mean: f64,
    pub(crate) sd: f64,
}

/// One run.
pub(crate) struct Done {
    pub(crate) summary: Summary,
    pub(crate) estimates: Vec<Estimate>,
    pub(crate) passes: usize,
    pub(crate) courses: Vec<PredictedCourse>,
}

/// Warnings that say that the intervals may be wrong.
const ALARMS: [&str; 4] = ["NIS is", "are autocorrelated", "still moved", "a free run with the estimate"];

impl Done {
    /// The warnings that say that the intervals may be wrong.
    pub(crate) fn alarms(&self) -> Vec<&String> {
        self.summary.warnings.iter().filter(|w| ALARMS.iter().any(|a| w.contains(a))).collect()
    }

    /// Distance of an estimate from the truth, in its sd.
    pub(crate) fn z(&self, study: &Study, name: &str, truth: f64) -> f64 {
        let at = self.estimates.iter().position(|e| e.name == name).unwrap();
        let e = &self.estimates[at];
        (e.mean - study.theta[at].transform.to_transformed(truth)) / e.sd
    }
}

/// Runs a study in a folder of its own.
pub(crate) fn run(study: &Study) -> Done {
    let folder = tempfile::tempdir().unwrap();
    let mut folder =
        RunFolder::create(Purpose::Run, &folder.path().join("run"), study, "test", "today").unwrap();
    let mut context =
        RunContext { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0, threads: 1 };
    let summary = run_study(study, &mut InProcess::new(2), &mut folder, &mut context)
        .unwrap_or_else(|error| panic!("{error}"));
    let posterior = folder.store.meta("posterior").unwrap().unwrap();
    let rows: Vec<Vec<&str>> = posterior.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let estimate = |(j, row): (usize, &Vec<&str>)| Estimate {
        name: row[0].to_owned(),
        mean: row[7].parse().unwrap(),
        sd: row[8 + j].parse::<f64>().unwrap().sqrt(),
    };
    let passes = starlings_coordinator::study::store::table(&folder.store, "analyses", "pass").unwrap();
    let passes = passes.iter().map(|row| row[0].parse().unwrap()).max().unwrap();
    let courses = predicted::read(&folder.store).unwrap();
    Done { courses, estimates: rows.iter().enumerate().map(estimate).collect(), summary, passes }
}

/// Over the draws of one system.
#[derive(Default)]
pub(crate) struct Tally {
    covered: usize,
    counted: usize,
    largest: f64,
    pub(crate) largest_silent: f64,
    pub(crate) alarmed: usize,
    pub(crate) runs: usize,
    passes: Vec<usize>,
    model_runs: u64,
}

impl Tally {
    pub(crate) fn add(&mut self, study: &Study, system: &System, seed: u64) {
        let done = run(study);
        let alarms = done.alarms();
        for (name, truth) in &system.truth {
            let z = done.z(study, name, *truth);
            self.counted += 1;
            self.covered += usize::from(z.abs() < 1.959_964);
            self.largest = self.largest.max(z.abs());
            if alarms.is_empty() {
                self.largest_silent = self.largest_silent.max(z.abs());
            }
            if z.abs() > 4.0 {
                println!("  {}, seed {seed}: {name} is {z:.1} sd off; {alarms:?}", system.name);
            }
        }
        if !alarms.is_empty() {
            println!("  {}, seed {seed}: {alarms:?}", system.name);
        }
        self.alarmed += usize::from(!alarms.is_empty());
        self.runs += 1;
        self.passes.push(done.passes);
        self.model_runs += done.summary.runs.total;
    }

    pub(crate) fn coverage(&self) -> f64 {
        self.covered as f64 / self.counted as f64
    }

    /// A row of the table in docs/coverage.md.
    pub(crate) fn row(&self, name: &str) -> String {
        format!(
            "| {name} | {} | {} of {} ({:.3}) | {:.1} | {:.1} | {} | {} to {} | {} |",
            self.runs,
            self.covered,
            self.counted,
            self.coverage(),
            self.largest,
            self.largest_silent,
            self.alarmed,
            self.passes.iter().min().unwrap(),
            self.passes.iter().max().unwrap(),
            self.model_runs / self.runs as u64,
        )
    }
}
