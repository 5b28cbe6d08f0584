//! The periodic state of a driven model: the state that one period of its inputs returns to itself.
//!
//! Repeating the period removes the effect of a start only as fast as the slowest mode decays, which takes many beats in a
//! Windkessel. Anderson mixing (Anderson 1965; Walker & Ni 2011, algorithm AA) combines the last periods so that their changes
//! cancel best, which removes the few slow modes after about as many periods. Next file to read: [`super`].

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector};
use starlings_estimators::svd;
use starlings_models::ParticleError;

/// Change over one period, in units of each state quantity's size, at which the state counts as periodic.
const TOLERANCE: f64 = 1e-10;
/// Periods at most.
const LIMIT: usize = 60;
/// Earlier periods that are combined.
const DEPTH: usize = 10;
/// Singular values of the combined changes below this share of the largest are rounding errors.
const RANK: f64 = 1e-13;

/// Runs one period from a state to the one at its end.
pub(super) type Period<'a> = dyn FnMut(&[f64]) -> Result<Vec<f64>, ParticleError> + 'a;

/// A state that returns to itself.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Periodic {
    /// The state at the period's start.
    pub(super) state: Vec<f64>,
    /// Periods that were run.
    pub(super) n_period: usize,
}

/// Why there is none.
#[derive(Debug)]
pub(super) enum NotPeriodic {
    /// The model fails on the way.
    Model(ParticleError),
    /// The state still changes by this share of its size after that many periods.
    StillMoving { n_period: usize, change: f64 },
}

/// Finds the fixed point of `period`, which maps a state to the one a period later; `size` scales its entries.
pub(super) fn fixed_point(
    period: &mut Period<'_>,
    start: Vec<f64>,
    size: &[f64],
) -> Result<Periodic, NotPeriodic> {
    let scaled = |a: &DVector<f64>| a.zip_map(&DVector::from_column_slice(size), |a, s| a / s);
    let mut x = DVector::from_vec(start);
    let mut mixing = Mixing::default();
    let mut change = f64::INFINITY;
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
        if change <= TOLERANCE {
            return Ok(Periodic { state: image.as_slice().to_vec(), n_period });
        }
        x = mixing.next(image, residual);
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
            if let Ok((u, values, v_t)) = svd(&DMatrix::from_columns(&differences), "changes per period") {
                let least = RANK * values.max();
                let inverse = values.map(|s| if s > least { 1.0 / s } else { 0.0 });
                let gamma = v_t.tr_mul(&u.tr_mul(&residual).component_mul(&inverse));
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
