//! Damped least squares over runs that the caller makes: it says which run it needs next and takes the result.
//!
//! Levenberg (1944) and Marquardt (1963) within a region of trust (Moré 1978), with the secant update of Broyden (1965) between
//! Jacobians, for models whose runs are the only cost: a Jacobian is asked for at the start, where the secant no longer predicts the
//! cost, and once at the end. In scaled parameters z of the caller's choice, with an independent Gaussian prior and bounds on each. Read next:
//! `block_angular.rs`, what a Jacobian is, and `score.rs`, which computes what another parameter would add to a finished fit.

mod damped;
mod need;
mod outcome;
mod step;
#[cfg(test)]
mod tests;

use nalgebra::DVector;

pub use need::{End, Need, Scaled};

use crate::block_angular::BlockAngular;

/// Share of the cost that derivatives from differences of runs resolve.
const RESOLUTION: f64 = 1e-8;

/// A fit under way.
#[derive(Debug, Clone)]
pub struct LeastSquares {
    prior: Scaled,
    tolerance: f64,
    /// Measure the Jacobian where it is in doubt, and at the end.
    thorough: bool,
    trials_left: usize,
    z: DVector<f64>,
    residual: DVector<f64>,
    cost: f64,
    jacobian: BlockAngular,
    fresh: bool,
    /// The Jacobian that was measured at this point, while the secant changes `jacobian`.
    measured: Option<BlockAngular>,
    /// Length that a step may have, every component over what moves the residual by one ...
    radius: f64,
    /// ... and that of the last step.
    length: f64,
    /// The last step, in the units of z where it began.
    step: DVector<f64>,
    /// Whether it was as long as the linear model would have it.
    is_whole: bool,
    rejected: usize,
    predicted: f64,
    need: Need,
}

impl LeastSquares {
    /// A fit from a point that was not run yet, or the nearest one within the bounds. It ends when no step promises a fall of the cost
    /// (chi-square plus prior) above `tolerance`, in units of the mean square of the residuals where that is above one, and what the digits
    /// of the cost resolve, or after `trials` steps.
    pub fn new(mut start: DVector<f64>, prior: Scaled, tolerance: f64, trials: usize) -> Self {
        for (value, [lo, hi]) in start.iter_mut().zip(&prior.bounds) {
            *value = value.max(*lo).min(*hi);
        }
        let need = Need::Residual(start.clone());
        Self {
            prior,
            tolerance,
            thorough: true,
            trials_left: trials,
            z: start,
            residual: DVector::zeros(0),
            cost: f64::INFINITY,
            jacobian: BlockAngular::default(),
            fresh: false,
            measured: None,
            radius: f64::INFINITY,
            length: 0.0,
            step: DVector::zeros(0),
            is_whole: true,
            rejected: 0,
            predicted: 0.0,
            need,
        }
    }

    /// A fit from a point whose residual (m) and approximate Jacobian (m x p) are known: its first step costs one run. It ends
    /// as soon as the secant predicts no further fall of the cost; [`LeastSquares::polish`] goes on from there. Components whose
    /// column is zero stay where they are until a Jacobian is measured.
    pub fn from_known(
        z: DVector<f64>,
        residual: DVector<f64>,
        jacobian: BlockAngular,
        prior: Scaled,
        tolerance: f64,
        trials: usize,
    ) -> Self {
        let mut fit = Self::new(z.clone(), prior, tolerance, trials);
        // Where the residual is known, within the bounds or not.
        fit.z = z;
        fit.cost = fit.cost_of(&fit.z, &residual);
        fit.residual = residual;
        fit.jacobian = jacobian;
        fit.thorough = false;
        fit.plan();
        fit
    }

    /// Goes on with measured Jacobians until the fit has converged, with so many more trials.
    pub fn polish(&mut self, trials: usize) {
        if matches!(self.need, Need::Nothing(End::Converged | End::NoStart)) {
            return;
        }
        self.thorough = true;
        self.trials_left = trials;
        self.rejected = 0;
        if self.fresh {
            self.plan();
        } else {
            // How far a secant could be trusted, which knew nothing of some components, says nothing of a measured Jacobian.
            self.radius = f64::INFINITY;
            self.need = Need::Jacobian(self.z.clone());
        }
    }

    /// Keeps the first `n` components within so far of zero, or within where they stand where that is further, from the next step on.
    pub fn hold(&mut self, n: usize, within: f64) {
        for (bound, z) in self.prior.bounds.iter_mut().zip(self.z.iter()).take(n) {
            *bound = [bound[0].max(z.min(-within)), bound[1].min(z.max(within))];
        }
    }

    /// What it needs next.
    pub fn need(&self) -> &Need {
        &self.need
    }

    /// The best point so far, its whitened residual, and the Jacobian there, measured or by the secant.
    pub fn best(&self) -> (&DVector<f64>, &DVector<f64>, &BlockAngular) {
        (&self.z, &self.residual, &self.jacobian)
    }

    /// Chi-square plus prior at the best point.
    pub fn cost(&self) -> f64 {
        self.cost
    }

    /// The minimum of the cost that the linear model predicts.
    pub fn promised(&self) -> f64 {
        match &self.need {
            Need::Residual(_) if self.cost.is_finite() => self.cost - self.predicted,
            _ => self.cost,
        }
    }

    /// The fall of the cost that the linear model predicted for the last step that was considered.
    pub fn last_promise(&self) -> f64 {
        self.predicted
    }

    /// The smallest fall of the cost that derivatives from differences of runs can promise beside a cost of this size.
    pub fn resolution(&self) -> f64 {
        RESOLUTION * self.cost
    }

    /// The smallest fall of the cost that is worth a run: the tolerance in units of the noise that the residuals show, where that is more
    /// than was stated. A step that was cut short promises less than there is to come, so that the tolerance holds as it stands.
    fn smallest(&self) -> f64 {
        let shown = self.cost / self.residual.len().max(1) as f64;
        let unit = if self.is_whole { shown.max(1.0) } else { 1.0 };
        (self.tolerance * unit).max(self.resolution())
    }

    /// Steps that it may still try.
    pub fn trials_left(&self) -> usize {
        self.trials_left
    }

    /// Whether the Jacobian was measured at the best point.
    pub fn is_fresh(&self) -> bool {
        self.fresh
    }

    /// Takes the residual (m) that was asked for; `None` when the run failed.
    pub fn give_residual(&mut self, residual: Option<DVector<f64>>) {
        let Need::Residual(trial) = self.need.clone() else { return };
        let residual = residual.filter(|e| e.iter().all(|v| v.is_finite()));
        if self.cost.is_infinite() {
            let Some(residual) = residual else {
                self.need = Need::Nothing(End::NoStart);
                return;
            };
            self.cost = self.cost_of(&trial, &residual);
            self.residual = residual;
            self.need = Need::Jacobian(trial);
            return;
        }
        self.trials_left = self.trials_left.saturating_sub(1);
        let cost = residual.as_ref().map_or(f64::INFINITY, |e| self.cost_of(&trial, e));
        let was_fresh = self.fresh;
        let ratio = (self.cost - cost) / self.predicted.max(f64::MIN_POSITIVE);
        if let Some(new) = &residual {
            // Broyden's update: the change of the prediction is minus that of the residual.
            let surprise = &self.residual - new - self.jacobian.times(&self.step);
            self.jacobian.learn(&surprise, &self.step);
        }
        if let Some(residual) = residual.filter(|_| cost < self.cost) {
            self.accept(trial, residual, cost, ratio, was_fresh);
        } else {
            self.reject(was_fresh);
        }
    }

    /// Takes the Jacobian (m x p) that was asked for, which is not copied until the secant changes it; `None` when one of its runs
    /// failed.
    pub fn give_jacobian(&mut self, jacobian: Option<BlockAngular>) {
        match jacobian.filter(BlockAngular::is_finite) {
            Some(jacobian) => {
                self.measured = Some(jacobian.clone());
                self.jacobian = jacobian;
                self.fresh = true;
                self.plan();
            }
            None if self.jacobian.is_empty() => self.need = Need::Nothing(End::NoStart),
            None => self.need = Need::Nothing(End::Stalled),
        }
    }

    /// Chooses the next need from the linear model at the best point.
    fn plan(&mut self) {
        let Some(step) = self.find_step() else {
            self.need = Need::Nothing(End::Stalled);
            return;
        };
        if self.predicted <= self.smallest() {
            self.need = if self.fresh {
                Need::Nothing(End::Converged)
            } else if self.thorough {
                Need::Jacobian(self.z.clone())
            } else {
                Need::Nothing(End::Tentative)
            };
            return;
        }
        self.need = Need::Residual(self.led(&step));
        self.step = step;
    }

    fn cost_of(&self, z: &DVector<f64>, residual: &DVector<f64>) -> f64 {
        residual.norm_squared() + self.prior.cost(z)
    }
}
