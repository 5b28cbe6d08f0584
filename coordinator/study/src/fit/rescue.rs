//! What happens to a sigma point whose run failed on every worker: it is pulled towards the mean and run again.
//!
//! A pulled point is run at its nearer place; the analysis takes its distance into account and stays exact for a linear model.
//! A point that fails even close to the mean is dropped where the others still span the parameters. Both are reported as lost
//! information. Next file to read: [`super::filter`].

use starlings_estimators::{Filter, Particles};

use super::runner::{AnalysisIndex, EnsembleRunner, Predicted, Results, StepWindows};
use crate::RunError;
use crate::states::States;

/// Distances from the mean at which a failed sigma point is tried again, as fractions of its own.
const DISTANCES: [f64; 5] = [0.5, 0.25, 0.125, 0.0625, 0.03125];

/// An ensemble that ran over one step: every column is a prediction, or dropped.
pub(crate) struct Forecast {
    /// The particles, with their pulls.
    pub(crate) particles: Particles,
    /// Predictions and end states by particle and window; a dropped particle keeps its error.
    pub(crate) results: Results,
    /// Sigma points that were pulled or dropped.
    pub(crate) rescued: u64,
}

/// Runs all particles over the step's windows and rescues those that fail.
///
/// `states[record]` (at the windows' start) is pulled along with the parameters.
///
/// # Errors
/// When the fleet fails, or too few particles survive for an analysis; the message says which parameters could not be run.
pub(crate) fn forecast(
    runner: &mut EnsembleRunner<'_>,
    filter: &dyn Filter,
    particles: Particles,
    states: &mut [Option<States>],
    windows: &StepWindows,
    at: AnalysisIndex,
) -> Result<Forecast, RunError> {
    let everyone: Vec<usize> = (0..particles.theta.ncols()).collect();
    let results = runner.run(at, &everyone, &particles.theta, states, windows)?;
    let mut forecast = Forecast { particles, results, rescued: 0 };
    for particle in everyone {
        if forecast.results[particle].iter().any(Result::is_err) {
            rescue(runner, filter, &mut forecast, states, windows, at, particle)?;
            forecast.rescued += 1;
        }
    }
    Ok(forecast)
}

fn rescue(
    runner: &mut EnsembleRunner<'_>,
    filter: &dyn Filter,
    forecast: &mut Forecast,
    states: &mut [Option<States>],
    windows: &StepWindows,
    at: AnalysisIndex,
    particle: usize,
) -> Result<(), RunError> {
    let cause = cause(runner, windows, &forecast.results[particle]);
    for distance in DISTANCES {
        let (pulled, transform) = filter.pull(&forecast.particles, particle, distance);
        for x in states.iter_mut().flatten() {
            x.pull(&transform)?;
        }
        forecast.particles = pulled;
        let mut retried = runner.run(at, &[particle], &forecast.particles.theta, states, windows)?;
        let of_particle = retried.swap_remove(0);
        let failed = of_particle.iter().any(Result::is_err);
        forecast.results[particle] = of_particle;
        if !failed {
            return Ok(());
        }
    }
    forecast.particles =
        filter.drop(&forecast.particles, particle).map_err(|source| RunError::SigmaPointLost {
            particle,
            pass: at.pass,
            step: at.step,
            values: describe(runner, &forecast.particles, particle),
            cause,
            source,
        })?;
    Ok(())
}

/// The first failure among a particle's windows, with its record.
fn cause(runner: &EnsembleRunner<'_>, windows: &StepWindows, of_particle: &[Predicted]) -> String {
    let mut failed =
        windows.iter().zip(of_particle).filter_map(|((record, _), r)| Some((*record, r.as_ref().err()?)));
    let Some((record, error)) = failed.next() else { return String::new() };
    format!("over record `{}`, {error}", runner.study().records[record].name)
}

fn describe(runner: &EnsembleRunner<'_>, particles: &Particles, particle: usize) -> String {
    let theta = particles.theta.column(particle);
    runner
        .study()
        .theta
        .iter()
        .zip(theta.iter())
        .map(|(entry, value)| format!("{} = {:.6}", entry.name, entry.transform.to_physical(*value)))
        .collect::<Vec<_>>()
        .join(", ")
}
