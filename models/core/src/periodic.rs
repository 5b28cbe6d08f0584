//! The periodic state of a driven model: the state that one period of its inputs returns to itself.
//!
//! Repeating the period removes the effect of a start only as fast as the slowest mode decays, which takes many beats in a
//! Windkessel. Anderson mixing (Anderson 1965; Walker & Ni 2011, algorithm AA) combines the last periods so that their changes
//! cancel best, which removes the few slow modes after about as many periods. Next file to read: [`start`], runs that begin there.

mod start;

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector, SVD};

use crate::{ParticleError, Spec};

pub use start::{PeriodicStart, beginning};

/// Change over one period, in units of each state quantity's size, at which the state counts as periodic.
const TOLERANCE: f64 = 1e-10;
/// Change that is as good as none where it does not shrink any more: the tolerance of a solver holds it up.
const HELD_UP: f64 = 1e-7;
/// Periods in which the change has to halve; else it is held up.
const PATIENCE: usize = 4;
/// Distance from zero, in units of each state quantity's size, beyond which no mixture is taken: there rounding hides a change.
const FAR: f64 = 1e6;
/// Periods at most.
const LIMIT: usize = 60;
/// Earlier periods that are combined.
const DEPTH: usize = 10;
/// Sweeps of a decomposition at most.
const SWEEPS: usize = 1000;
/// Singular values of the combined changes below this share of the largest are rounding errors.
const RANK: f64 = 1e-13;

/// Runs one period from a state to the one at its end.
pub type Period<'a> = dyn FnMut(&[f64]) -> Result<Vec<f64>, ParticleError> + 'a;

/// A state that returns to itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Periodic {
    /// The state at the period's start.
    pub state: Vec<f64>,
    /// Periods that were run.
    pub n_period: usize,
}

/// Why there is none.
#[derive(Debug)]
pub enum NotPeriodic {
    /// The model fails on the way.
    Model(ParticleError),
    /// The state still changes by this share of its size after that many periods.
    StillMoving {
        /// Periods that were run.
        n_period: usize,
        /// Change of the last one.
        change: f64,
    },
}

/// Finds the fixed point of `period`, which maps a state to the one a period later; `size` scales its entries.
///
/// # Errors
/// When the model fails on the way, or the state does not settle.
pub fn fixed_point(period: &mut Period<'_>, start: Vec<f64>, size: &[f64]) -> Result<Periodic, NotPeriodic> {
    let scaled = |a: &DVector<f64>| a.zip_map(&DVector::from_column_slice(size), |a, s| a / s);
    let mut x = DVector::from_vec(start);
    let mut mixing = Mixing::default();
    let mut change = f64::INFINITY;
    // The smallest change so far, and the period in which it last halved.
    let mut least = (f64::INFINITY, 0);
    for n_period in 1..=LIMIT {
        let image = match period(x.as_slice()) {
            Ok(image) => DVector::from_vec(image),
            // The model may refuse a mixture of states: go on from the last state in which a run ended.
            Err(error) => match mixing.last_image.take() {
                Some(image) if n_period < LIMIT => {
                    x = image;
                    mixing = Mixing::default();
                    continue;
                }
                _ => return Err(NotPeriodic::Model(error)),
            },
        };
        let residual = scaled(&(&image - &x));
        change = residual.amax();
        if change <= 0.5 * least.0 {
            least = (change, n_period);
        }
        if change <= TOLERANCE || (change <= HELD_UP && n_period >= least.1 + PATIENCE) {
            return Ok(Periodic { state: image.as_slice().to_vec(), n_period });
        }
        x = mixing.next(image, residual);
        if scaled(&x).iter().any(|v| v.is_nan() || v.abs() > FAR) {
            // Changes that differ by rounding alone make a mixture of any size: the last image is the state to go on from.
            if let Some(image) = mixing.last_image.take() {
                x = image;
            }
            mixing = Mixing::default();
        }
    }
    Err(NotPeriodic::StillMoving { n_period: LIMIT, change })
}

/// The last periods: differences of successive images and of their scaled residuals.
#[derive(Default)]
struct Mixing {
    images: VecDeque<DVector<f64>>,
    residuals: VecDeque<DVector<f64>>,
    last_image: Option<DVector<f64>>,
    last_residual: Option<DVector<f64>>,
}

impl Mixing {
    /// x⁺ = g − ΔG γ with γ = argmin |f − ΔF γ|.
    fn next(&mut self, image: DVector<f64>, residual: DVector<f64>) -> DVector<f64> {
        if let (Some(g), Some(f)) = (&self.last_image, &self.last_residual) {
            self.images.push_back(&image - g);
            self.residuals.push_back(&residual - f);
            if self.images.len() > DEPTH {
                self.images.pop_front();
                self.residuals.pop_front();
            }
        }
        let mut next = image.clone();
        if !self.residuals.is_empty() {
            let differences: Vec<DVector<f64>> = self.residuals.iter().cloned().collect();
            // Differences that cannot be decomposed are a plain step.
            if let Some(gamma) = least_squares(DMatrix::from_columns(&differences), &residual) {
                for (difference, share) in self.images.iter().zip(gamma.iter()) {
                    next.axpy(-share, difference, 1.0);
                }
            }
        }
        self.last_image = Some(image);
        self.last_residual = Some(residual);
        next
    }
}

/// The shares of the columns that come closest to a vector; singular values that are rounding errors count as zero.
fn least_squares(columns: DMatrix<f64>, vector: &DVector<f64>) -> Option<DVector<f64>> {
    let svd = SVD::try_new(columns, true, true, f64::EPSILON, SWEEPS)?;
    let least = RANK * svd.singular_values.max();
    svd.solve(vector, least).ok()
}

/// The size of every state component: the largest value of its quantity among some states.
pub fn sizes(spec: &Spec, states: &[Vec<f64>]) -> Vec<f64> {
    let mut size = vec![0.0_f64; spec.n_state()];
    let mut first = 0;
    for quantity in &spec.states {
        let block = first..first + quantity.size;
        let largest = |x: &Vec<f64>| x[block.clone()].iter().fold(0.0_f64, |max, v| max.max(v.abs()));
        let largest = states.iter().map(largest).fold(0.0, f64::max);
        size[block.clone()].fill(if largest > 0.0 { largest } else { 1.0 });
        first += quantity.size;
    }
    size
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Modes that decay by e^−rate per period towards a state of very unequal entries.
    fn modes(rates: &[f64]) -> impl FnMut(&[f64]) -> Result<Vec<f64>, ParticleError> {
        let rates = rates.to_vec();
        move |x| {
            Ok(rates
                .iter()
                .zip(x)
                .zip(1..)
                .map(|((r, x), k)| {
                    let fixed = 10_f64.powi(k);
                    fixed + (-r).exp() * (x - fixed)
                })
                .collect())
        }
    }

    #[test]
    fn slow_modes_are_gone_after_about_as_many_periods_as_there_are() {
        let rates = [0.37, 0.4, 0.9, 3.0, 20.0];
        let size = [1e1, 1e2, 1e3, 1e4, 1e5];
        let found = fixed_point(&mut modes(&rates), vec![0.0; 5], &size).expect("contracting");
        // Five modes: six periods span them, one more sees that it is so; rounding may cost a few. Repeating alone needs 62.
        assert!(found.n_period <= 12, "{}", found.n_period);
        for (x, s) in found.state.iter().zip(size) {
            // The change of the last period, amplified by 1/(1 − e^−0.37) = 3.2.
            assert!((x / s - 1.0).abs() < 4e-10, "{x} of {s}");
        }
    }

    #[test]
    fn a_change_that_a_tolerance_holds_up_counts_as_none_and_a_larger_one_does_not() {
        // Halves its distance from 1, with an error in the last digits that a solver keeps.
        let held = |error: f64| {
            let mut sign = 1.0;
            move |x: &[f64]| {
                sign = -sign;
                Ok(vec![0.5 * (x[0] + 1.0) + sign * error])
            }
        };
        let found = fixed_point(&mut held(1e-9), vec![0.0], &[1.0]).expect("as good as periodic");
        assert!(found.n_period < 20 && (found.state[0] - 1.0).abs() < 1e-7, "{found:?}");
        assert!(fixed_point(&mut held(1e-5), vec![0.0], &[1.0]).is_err());
    }

    #[test]
    fn a_state_that_grows_without_end_is_refused_with_the_change_per_period() {
        let mut drift = |x: &[f64]| Ok(vec![x[0] + 1.0]);
        match fixed_point(&mut drift, vec![0.0], &[1.0]) {
            Err(NotPeriodic::StillMoving { n_period, change }) => {
                assert_eq!(n_period, LIMIT);
                assert!((change - 1.0).abs() < 1e-9, "{change}");
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_drift_that_rounding_alone_varies_is_no_periodic_state_far_away() {
        // Mixing two changes that differ by 1e-13 would step to 1e13 and beyond, where adding one to a number leaves it as it is.
        let mut drift = |x: &[f64]| Ok(vec![x[0] + 1.0 + 1e-13 * (1e3 * x[0]).sin()]);
        match fixed_point(&mut drift, vec![0.0], &[1.0]) {
            Err(NotPeriodic::StillMoving { change, .. }) => assert!((change - 1.0).abs() < 1e-9, "{change}"),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_mixture_that_the_model_refuses_is_left_out() {
        // Far from its fixed point 0.1 the map points at −10, where it fails; repeated alone it never goes there.
        let mut n_failed = 0;
        let mut kinked = |x: &[f64]| {
            if x[0] < 0.0 {
                n_failed += 1;
                return Err(ParticleError::BadJob("below zero".to_owned()));
            }
            Ok(vec![if x[0] > 0.3 { 0.99 * x[0] - 0.1 } else { 0.5 * x[0] + 0.05 }])
        };
        let found = fixed_point(&mut kinked, vec![1.0], &[1.0]).expect("0.1");
        assert!(n_failed > 0, "the mixture was never refused");
        assert!((found.state[0] - 0.1).abs() < 1e-9, "{:?}", found.state);
    }
}
