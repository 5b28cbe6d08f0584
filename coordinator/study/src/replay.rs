//! One run of a sigma point made again, with the inputs that it had: are the bits the same here?
//!
//! The store keeps of every run of a fit a hash of its answer, and of some analyses what their particles were given
//! ([`crate::store`]). A run between two of those has its inputs rebuilt by the analyses before it, each compared on the way: where one
//! of them gives other bits, that run is the answer, since nothing after it can be given the same inputs. Next files to read:
//! [`target`], which run is meant, and [`result`], what is said of it.

mod error;
mod result;
mod target;

use std::ops::ControlFlow;

use starlings_fleet::Fleet;

use crate::fit::replay::{Given, rebuild};
use crate::fit::runner::{AnalysisIndex, EnsembleRunner};
use crate::store::{JobRow, KeptRun};
use crate::{RunFolder, Study};

pub use error::ReplayError;
pub use result::{Agreement, Ended, RemadeRun, Replay};
pub use target::{Asked, Target};

/// Makes the run again on the fleet and compares it with the store.
///
/// # Errors
/// When the recordings are others than those of the run, or the fleet, the estimator or the store fails.
pub fn replay(
    study: &Study,
    fleet: &mut dyn Fleet,
    folder: &RunFolder,
    target: &Target,
) -> Result<Replay, ReplayError> {
    let changed = folder.changed(study)?.map_err(|which| ReplayError::OtherRecordings { which })?;
    let &Target { particle, pass, analysis, from } = target;
    let inputs = folder.store.inputs(pass, from, study.records.len())?;
    let kept = folder.store.kept_runs(pass, from, analysis)?;
    let mut runner = EnsembleRunner::new(study, fleet)?;
    let mut earlier = None;
    let mut check = |jobs: &[JobRow]| {
        earlier = first_other(&kept, jobs);
        if earlier.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let given = rebuild(study.estimator.kind, &mut runner, inputs, analysis, &mut check)?;
    let runs = match given {
        Some(given) => again(&mut runner, &kept, target, &given)?,
        None => Vec::new(),
    };
    Ok(Replay { particle, pass, analysis, from, n_run: runner.counts.total, runs, earlier, changed })
}

/// The runs of the particle, by record, each beside the first that the store has of it: later ones are of a point that was moved.
fn again(
    runner: &mut EnsembleRunner<'_>,
    kept: &[KeptRun],
    target: &Target,
    given: &Given,
) -> Result<Vec<RemadeRun>, ReplayError> {
    let study = runner.study();
    let at = AnalysisIndex { pass: target.pass, step: target.analysis };
    let particle = target.particle as usize;
    if particle >= given.theta.ncols() {
        return Err(ReplayError::NoParticle {
            particle: target.particle,
            last: given.theta.ncols().saturating_sub(1),
        });
    }
    // Whether a program that ends abnormally fails for its parameters is known beside those that do not fail.
    let failed =
        |run: &KeptRun| run.step == at.step && run.particle == target.particle && run.error.is_some();
    let alone = !kept.iter().any(failed);
    let particles = if alone { vec![particle] } else { (0..given.theta.ncols()).collect() };
    runner.run(at, &particles, &given.theta, &given.states, &given.windows)?;
    let column: Vec<f64> = given.theta.column(particle).iter().copied().collect();
    let of_particle = runner.take_rows().into_iter().filter(|job| job.particle == target.particle);
    let beside = |(job, (record, _)): (JobRow, &(usize, _))| {
        let before = kept
            .iter()
            .find(|run| run.step == job.step && run.particle == job.particle && run.record == job.record)?;
        let names = study.setup.parameters.iter().cloned();
        let values = names.zip(study.theta_for(*record, &column)).collect();
        Some(RemadeRun::new(before, &job, values))
    };
    Ok(of_particle.zip(&given.windows).filter_map(beside).collect())
}

/// The first run of an analysis that is not what the store has.
fn first_other(kept: &[KeptRun], jobs: &[JobRow]) -> Option<RemadeRun> {
    let step = jobs.first()?.step;
    let before = kept.iter().filter(|run| run.step == step);
    let mut pairs = before.zip(jobs).map(|(before, now)| RemadeRun::new(before, now, Vec::new()));
    pairs.find(|run| !run.agreement.is_same())
}
