//! By how much the uncertainty of the parameters moves the free run: a standard deviation of every prediction, to first order.
//!
//! The slopes are those of an ensemble beside the estimate: without an observer the one that the intervals given the residuals have
//! anyway, which then goes on to the records' ends; with one, whose corrections are in that ensemble, a free one of as many runs. None of
//! this enters the posterior. Next file to read: [`crate::given_residuals`].

use std::sync::Arc;

use nalgebra::DVector;
use starlings_estimators::Gaussian;

use super::Study;
use super::fit::runner::StepWindows;
use super::given_residuals::Points;

/// Every record from its start to its end, with the values that train.
pub(crate) fn whole_windows(study: &Study) -> StepWindows {
    let window = |record: usize| {
        let trained = study.records[record].is_trained();
        let training = if trained { study.whole(record, true) } else { study.whole(record, false) };
        (record, Arc::new(study.with_values(record, &training)))
    };
    (0..study.records.len()).map(window).collect()
}

/// Standard deviations of the predictions under a covariance of the estimated vector in transformed units, in the order of the
/// predictions that a run stores; `None` where a slope is no finite number.
pub(crate) fn spread(
    study: &Study,
    windows: &StepWindows,
    Points { theta, outputs }: &Points,
    posterior: &Gaussian,
) -> Vec<Option<f32>> {
    let root = posterior.factor();
    let n_obs = study.setup.outputs.len();
    let (mut all, mut first) = (Vec::new(), 0);
    for (record, window) in windows {
        let of_record = &study.records[*record];
        let slope = |at: usize, j: usize| {
            let entry = &study.theta[j];
            let column = entry.parameter + 1;
            let step = theta[(j, column)] - theta[(j, 0)];
            if entry.record.is_some_and(|own| own != *record) || step.is_nan() || step == 0.0 {
                return 0.0;
            }
            (outputs[(at, column)] - outputs[(at, 0)]) / step
        };
        for channel in &of_record.channels {
            for (j, time) in window.times.iter().enumerate() {
                if channel.node.is_some() && of_record.observed(channel, *time).is_none() {
                    continue;
                }
                let at = first + j * n_obs + channel.row;
                let slopes = DVector::from_fn(study.theta.len(), |j, _| slope(at, j));
                let sd = root.tr_mul(&slopes).norm() as f32;
                all.push(Some(sd).filter(|sd| sd.is_finite()));
            }
        }
        first += window.observed.len();
    }
    all
}
