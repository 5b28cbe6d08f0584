//! Where the fit of a scenario begins: at its prior median, or at the best points of its grid.
//!
//! A fit finds what is near its start; a place in a plate has to be known to a quarter of a wave length. Of every point of the grid the
//! model is run once at the prior median of the severity. What that adds to the model without a fault, times the factor that explains
//! the recording best, lowers χ² by (r·s)²/(s·s) with the residual r and the signal s in units of the noise: the matched filter. The best
//! points are refined. Next file to read: [`super::run`].

use nalgebra::DVector;
use starlings_study::diagnosis::Scenario;

use crate::error::DiagnoseError;
use crate::hypothesis::{Hypothesis, theta};
use crate::runs::{Runnable, Runs};

/// Points of a grid that are refined.
pub(crate) const REFINED: usize = 3;
/// Points that are run and held at a time.
const PORTION: usize = 256;
/// Largest factor on the severity of a start, and smallest as its inverse.
const FACTOR: f64 = 20.0;

/// The starts of a scenario's fit, in z; `severity` is the index of that parameter, behind those of the model without a fault.
pub(crate) fn starts(
    runs: &mut Runs<'_>,
    healthy: &Hypothesis<'_>,
    (scenario, model): (&Scenario, &Runnable),
    severity: usize,
) -> Result<Vec<DVector<f64>>, DiagnoseError> {
    let points = points(scenario, healthy.z());
    if scenario.grid.is_empty() {
        return Ok(points);
    }
    let mut ranked: Vec<(f64, DVector<f64>)> = Vec::new();
    for some in points.chunks(PORTION) {
        let asked: Vec<_> = some.iter().map(|z| (model, theta(&model.study, z))).collect();
        for (z, answer) in some.iter().zip(runs.run(&asked)?) {
            let Ok(predicted) = answer else { continue };
            let signal = healthy.residual() - runs.residual(&predicted);
            let (match_, size) = (healthy.residual().dot(&signal), signal.norm_squared());
            if size > 0.0 && match_ > 0.0 {
                ranked.push((match_ * match_ / size, scaled(scenario, z, severity, match_ / size)));
            }
        }
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        ranked.truncate(REFINED);
    }
    if ranked.is_empty() {
        // Nothing on the grid explains any of it: the fit says so from its middle.
        return Ok(vec![points[points.len() / 2].clone()]);
    }
    Ok(ranked.into_iter().map(|(_, z)| z).collect())
}

/// Every combination of the grid, the other parameters at their prior medians and those of the study where the model without a fault has
/// them.
fn points(scenario: &Scenario, healthy: &DVector<f64>) -> Vec<DVector<f64>> {
    let theta = &scenario.study.theta;
    let mut first = DVector::zeros(theta.len());
    first.rows_mut(0, healthy.len()).copy_from(healthy);
    let mut points = vec![first];
    for (at, values) in &scenario.grid {
        let entry = &theta[*at];
        let z = |value: &f64| (entry.transform.to_transformed(*value) - entry.prior_mean) / entry.prior_sd;
        let with = |point: &DVector<f64>, value: &f64| {
            let mut point = point.clone();
            point[*at] = z(value);
            point
        };
        points = points.iter().flat_map(|point| values.iter().map(move |value| with(point, value))).collect();
    }
    points
}

/// A point with its severity multiplied, as far as its prior allows.
fn scaled(scenario: &Scenario, z: &DVector<f64>, severity: usize, factor: f64) -> DVector<f64> {
    let entry = &scenario.study.theta[severity];
    let value = entry.transform.to_physical(entry.prior_mean + entry.prior_sd * z[severity]);
    let wanted = value * factor.clamp(1.0 / FACTOR, FACTOR);
    let mut z = z.clone();
    if entry.transform.contains(wanted) {
        z[severity] = (entry.transform.to_transformed(wanted) - entry.prior_mean) / entry.prior_sd;
    }
    z
}
