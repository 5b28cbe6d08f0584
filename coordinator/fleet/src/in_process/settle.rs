//! Outcomes of runs made in one place: an abnormal end is decided as the dispatcher decides it, by a run that is known to work.
//!
//! Next file to read: `dispatcher/doubt.rs`, for the rule.

use starlings_models::{Failure, Forward, Job, ModelFailure, ParticleError, Prediction};
use starlings_proto::SetupId;

use super::run_one;
use crate::job_name::JobName;
use crate::{FleetError, Outcome};

type Ran = Result<Prediction, ParticleError>;

/// Outcomes of runs that ended like this, in the order of the jobs.
///
/// # Errors
/// When this place cannot make a run, or nobody can tell whether it can.
pub(super) fn settled(
    jobs: &[(SetupId, Job)],
    tasks: &[(&dyn Forward, &Job)],
    mut results: Vec<Ran>,
    threads: Vec<usize>,
) -> Result<Vec<Outcome>, FleetError> {
    let mut attempts = vec![1; results.len()];
    for index in 0..results.len() {
        if let Err(ParticleError::Undecided(_)) = &results[index] {
            attempts[index] = 2;
            results[index] = decided(jobs, tasks, &results, index)?;
        }
    }
    let outcome = |(index, (result, thread)): (usize, (Ran, usize))| {
        let result = match result {
            Ok(prediction) => Ok(prediction),
            Err(ParticleError::Model(failed)) => Err(Failure::Model(failed)),
            Err(ParticleError::Timeout(timeout)) => Err(Failure::Timeout(timeout)),
            Err(ParticleError::Infrastructure(reasons)) => {
                return Err(FleetError::Unavailable { waited: 0.0, reasons });
            }
            Err(error @ (ParticleError::BadJob(_) | ParticleError::Undecided(_))) => {
                let (job, reason) = (&jobs[index].1, error.to_string());
                let (particle, record) = (job.particle, job.record);
                return Err(FleetError::NoAnswer { job: index, particle, record, reason });
            }
        };
        Ok(Outcome { result, attempts: attempts[index], worker: format!("thread {thread}") })
    };
    results.into_iter().zip(threads).enumerate().map(outcome).collect()
}

/// A run that ended abnormally, tried once more, and again after one that is known to work.
fn decided(
    jobs: &[(SetupId, Job)],
    tasks: &[(&dyn Forward, &Job)],
    results: &[Ran],
    index: usize,
) -> Result<Ran, FleetError> {
    let rerun = |at: usize| run_one(tasks[at].0, tasks[at].1);
    let reason = match rerun(index) {
        Err(ParticleError::Undecided(reason)) => reason,
        other => return Ok(other),
    };
    let (setup, job) = &jobs[index];
    let (place, of) = (JobName::of(job), |at: usize| JobName::of(&jobs[at].1));
    let alike =
        |at: &usize| results[*at].is_ok() && (of(*at).record, of(*at).span) == (place.record, place.span);
    let same = (0..jobs.len()).filter(alike).find(|at| jobs[*at].0 == *setup);
    let Some(control) = same.or_else(|| (0..jobs.len()).find(alike)) else {
        let (particle, record, parameters) = (job.particle, job.record, String::new());
        return Err(FleetError::NoControl { particle, record, parameters, reason });
    };
    if let Err(error) = rerun(control) {
        let reasons = format!("a run that worked before fails: {error}");
        return Err(FleetError::Unavailable { waited: 0.0, reasons });
    }
    Ok(rerun(index).map_err(|error| match error {
        ParticleError::Undecided(text) => ModelFailure::Solver(text).into(),
        other => other,
    }))
}
