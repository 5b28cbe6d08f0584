//! What the fitted parameters change in the rate of a state: as much of a missing term they have taken up.
//!
//! Next file to read: [`super::recovered`].

use nalgebra::DVector;
use starlings_models::EffectDef;

use crate::fit::candidate::Candidate;
use crate::screen::natural_amplitude::{ReferenceRun, along_run};

/// Step of a difference, as a share of a parameter.
const STEP: f64 = 1e-4;

/// What the parameters change in the rate of a state at these steps of a record, one series for each that does; none where the model
/// has no equations that can be read.
pub(super) fn slopes(run: &ReferenceRun<'_>, state: &str, record: usize, steps: &[usize]) -> Vec<Vec<f64>> {
    let equations = run.study.setup.model.equations.as_ref();
    let Some(of) = equations.and_then(|e| e.states.iter().find(|s| s.name == state)) else {
        return Vec::new();
    };
    let plain = Candidate::new(EffectDef::default());
    let rate = |theta: &[f64]| -> Option<DVector<f64>> {
        let moved = ReferenceRun { study: run.study, theta, tracks: run.tracks };
        let mut sum = DVector::zeros(steps.len());
        for (_, term) in &of.rate {
            sum += DVector::from_vec(along_run(&moved, &plain, &[], term, record, steps)?);
        }
        Some(sum)
    };
    let slope = |i: usize| {
        let (mut up, mut down) = (run.theta.to_vec(), run.theta.to_vec());
        let step = STEP * run.theta[i].abs().max(STEP);
        (up[i], down[i]) = (up[i] + step, down[i] - step);
        let slope = (rate(&up)? - rate(&down)?) / (2.0 * step);
        (slope.amax() > 0.0 && slope.iter().all(|v| v.is_finite())).then(|| slope.as_slice().to_vec())
    };
    (0..run.theta.len()).filter_map(slope).collect()
}
