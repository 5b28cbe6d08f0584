//! Against the error of the sampling step: the same recording at h, 2h and 4h, extrapolated to none (Richardson 1911).
//!
//! Under weak noise the mid-point's error is of second order in the step and (4 c_h − c_2h)/3 is free of it; under strong noise it is
//! of first order and 2 c_h − c_2h is. Decimated recordings are taken in all phases, which overlap: their coefficients are as good as
//! those of all rows, their covariance is not used. Read next: `stream.rs`.

use std::sync::Arc;

use nalgebra::DVector;

use super::{Basis, Estimate, InferenceError, Posterior, Stream, Sums, Value};

/// Ratio of the changes from 4h to 2h and from 2h to h that is halfway between first order (2) and second (4).
const HALFWAY: f64 = 2.828_427_124_746_19;

/// A recording on its way into sums at h, 2h and so on.
#[derive(Debug)]
pub struct Decimation {
    /// One stream per phase of every level.
    levels: Vec<Vec<Stream>>,
    row: usize,
}

impl Decimation {
    /// An empty recording with steps of length `step`, at `n_level` steps that double.
    ///
    /// # Errors
    /// `NotPositive`.
    pub fn new(basis: &Arc<Basis>, step: f64, n_level: u32) -> Result<Self, InferenceError> {
        let level = |k: u32| {
            let factor = 1_u32 << k;
            (0..factor).map(|_| Stream::new(Arc::clone(basis), step * f64::from(factor))).collect()
        };
        Ok(Self { levels: (0..n_level).map(level).collect::<Result<_, _>>()?, row: 0 })
    }

    /// Takes the next row.
    ///
    /// # Errors
    /// As for [`Stream::push`].
    pub fn push(&mut self, time: f64, values: &[f64]) -> Result<(), InferenceError> {
        for phases in &mut self.levels {
            let phase = self.row % phases.len();
            phases[phase].push(time, values)?;
        }
        self.row += 1;
        Ok(())
    }

    /// The sums at every step so far, the smallest step first.
    ///
    /// # Errors
    /// As for [`Stream::sums`].
    pub fn sums(&mut self) -> Result<Vec<Sums>, InferenceError> {
        let level = |phases: &mut Vec<Stream>| {
            let (first, rest) = phases.split_at_mut(1);
            let mut whole = first[0].sums()?.clone();
            if !rest.is_empty() {
                whole = whole.detach();
            }
            for phase in rest {
                whole.merge(&phase.sums()?.clone().detach())?;
            }
            Ok(whole)
        };
        self.levels.iter_mut().map(level).collect()
    }
}

/// How strong the noise is, which decides the order of the error.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Strength {
    /// Errors of second order in the step.
    Weak,
    /// Errors of first order.
    Strong,
}

/// Coefficients extrapolated to no step.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Extrapolated {
    /// The P coefficients. Standard deviations are those at h.
    pub estimates: Vec<Estimate>,
    /// The combination that was used.
    pub used: Strength,
    /// Change from 4h to 2h over that from 2h to h, 2 for first order and 4 for second; `None` of two levels.
    pub ratio: Option<f64>,
}

/// Extrapolates posteriors at h, 2h and, to find the order where it is not given, 4h.
///
/// # Errors
/// `Shape` for fewer posteriors than that, `Incompatible` when they do not hold the same coefficients.
pub fn extrapolate(levels: &[Posterior], strength: Option<Strength>) -> Result<Extrapolated, InferenceError> {
    let expected = if strength.is_some() { 2 } else { 3 };
    if levels.len() < expected {
        return Err(InferenceError::Shape { what: "steps to extrapolate from", expected, got: levels.len() });
    }
    if levels.iter().any(|p| p.active != levels[0].active || p.estimates.len() != levels[0].estimates.len()) {
        return Err(InferenceError::Incompatible { what: "the coefficients that they hold" });
    }
    let (fine, coarse) = (&levels[0], &levels[1]);
    let ratio = levels.get(2).map(|coarsest| order(fine, coarse, coarsest));
    let found = ratio.map(|r| if r >= HALFWAY { Strength::Weak } else { Strength::Strong });
    let used = strength.or(found).unwrap_or(Strength::Strong);
    let mean: DVector<f64> = match used {
        Strength::Weak => (&fine.mean * 4.0 - &coarse.mean) / 3.0,
        Strength::Strong => &fine.mean * 2.0 - &coarse.mean,
    };
    let mut estimates = fine.estimates.clone();
    for (p, mean) in fine.active.iter().zip(&mean) {
        estimates[*p].value = estimates[*p].value.map(|v| Value { mean: *mean, ..v });
    }
    Ok(Extrapolated { estimates, used, ratio })
}

/// The change from the coarsest to the coarse step along that from the coarse to the fine one, in posterior sd.
fn order(fine: &Posterior, coarse: &Posterior, coarsest: &Posterior) -> f64 {
    let sd = fine.covariance.diagonal().map(f64::sqrt);
    let change = |a: &Posterior, b: &Posterior| (&a.mean - &b.mean).component_div(&sd);
    let (small, large) = (change(coarse, fine), change(coarsest, coarse));
    large.dot(&small) / small.norm_squared().max(f64::MIN_POSITIVE)
}
