//! Runs that are given up after their limit of time: a decision that a resume repeats, and that the result reports.
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod study_kit;

use starlings_coordinator::fleet::{Fleet, FleetError, InProcess, Outcome, SetupId};
use starlings_models::{Job, Setup, Timeout};
use study_kit::{Case, linear};

/// Gives up a run of one call, and stops for good after some calls.
struct Late {
    inner: InProcess,
    call: usize,
    left: usize,
    calls: usize,
}

impl Late {
    fn new(late: usize, left: usize) -> Self {
        Self { inner: InProcess::new(1), call: late, left, calls: 0 }
    }
}

impl Fleet for Late {
    fn install(&mut self, setup: &Setup) -> Result<SetupId, FleetError> {
        self.inner.install(setup)
    }

    fn run_mixed(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError> {
        if self.calls == self.left {
            return Err(FleetError::Cancelled);
        }
        let mut outcomes = self.inner.run_mixed(jobs)?;
        if self.calls == self.call {
            let says = "it did not answer within 5 s".to_owned();
            outcomes[1].result = Err(Timeout { limit: 5.0, says }.into());
        }
        self.calls += 1;
        Ok(outcomes)
    }

    fn n_workers(&self) -> usize {
        1
    }

    fn slots(&self) -> usize {
        1
    }
}

const WARNING: &str = "1 run of the fit was given up after 5 s (`timeout`), which a faster or quieter machine may have finished";

#[test]
fn a_timeout_is_kept_before_the_run_goes_on_and_repeated_by_a_resume() {
    let (times, z) = linear::data(12, 8);
    let case = Case::new(&linear::study("passes = 2"), &[("line.csv", linear::file(&times, &z))]);
    let in_time = case.run();
    let whole = case.run_on(&mut Late::new(3, usize::MAX)).unwrap();
    assert!(whole.summary.warnings.iter().any(|w| w.starts_with(WARNING)), "{:?}", whole.summary.warnings);
    assert!(in_time.summary.warnings.iter().all(|w| !w.contains("`timeout`")));
    assert_ne!(whole.csv, in_time.csv, "the point was pulled in");
    // Killed right after the decision, before anything was made of it; continued where nothing is late.
    let path = case.fresh();
    assert!(case.go(&path, &mut Late::new(3, 4)).is_err());
    let resumed = case.go(&path, &mut InProcess::new(1)).unwrap();
    assert_eq!(resumed.csv, whole.csv);
    assert!(resumed.summary.warnings.iter().any(|w| w.starts_with(WARNING)));
}
