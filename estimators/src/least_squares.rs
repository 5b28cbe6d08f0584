//! Damped least squares over runs that somebody else makes: it says which run it needs next and takes the answer.
//!
//! Levenberg (1944) and Marquardt (1963) with the secant update of Broyden (1965) between Jacobians, for models whose runs
//! are the only cost: a Jacobian is asked for at the start, where the secant no longer foretells the cost, and once at the
//! end. Deliberately in scaled parameters z of the caller's choice, with an independent Gaussian prior and bounds on each.
//! Read next: `score.rs`, which asks what another parameter would add at the end of a fit.

use nalgebra::{DMatrix, DVector};

/// Damping after the first rejected step.
const REJECTED_DAMPING: f64 = 1e-2;
/// Rejected steps in a row after which the fit has stalled.
const STUBBORN: usize = 8;
/// Longest step of one component, in units of z.
const LONGEST: f64 = 3.0;

/// What is known of z before the data: an independent Gaussian and bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaled {
    /// Prior means, length p.
    pub mean: DVector<f64>,
    /// Prior precisions (1 / variance), length p; zero is no prior.
    pub precision: DVector<f64>,
    /// Smallest and largest value of each, length p.
    pub bounds: Vec<[f64; 2]>,
}

/// The run, or runs, that a fit needs next.
#[derive(Debug, Clone, PartialEq)]
pub enum Need {
    /// The whitened residual (observed - predicted) / noise at this point.
    Residual(DVector<f64>),
    /// The whitened Jacobian d prediction / d z at this point, m x p.
    Jacobian(DVector<f64>),
    /// Nothing: the fit has ended.
    Nothing(End),
}

/// How a fit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// No step promises a fall of the cost above the tolerance; the Jacobian is of this point.
    Converged,
    /// As far as the secant tells; the Jacobian was not measured again.
    Tentative,
    /// No step lowers the cost although the Jacobian is of this point.
    Stalled,
    /// The limit of trials was reached.
    Limit,
    /// The first run failed.
    NoStart,
}

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
    jacobian: DMatrix<f64>,
    fresh: bool,
    /// The Jacobian that was measured at this point, while the secant changes `jacobian`.
    measured: Option<DMatrix<f64>>,
    damping: f64,
    rejected: usize,
    predicted: f64,
    need: Need,
}

impl LeastSquares {
    /// A fit from a point that was not run yet. It ends when no step promises a fall of the cost (chi-square plus prior) above
    /// `tolerance`, or after `trials` steps.
    pub fn new(start: DVector<f64>, prior: Scaled, tolerance: f64, trials: usize) -> Self {
        let need = Need::Residual(start.clone());
        Self {
            prior,
            tolerance,
            thorough: true,
            trials_left: trials,
            z: start,
            residual: DVector::zeros(0),
            cost: f64::INFINITY,
            jacobian: DMatrix::zeros(0, 0),
            fresh: false,
            measured: None,
            damping: 0.0,
            rejected: 0,
            predicted: 0.0,
            need,
        }
    }

    /// A fit from a point whose residual (m) and approximate Jacobian (m x p) are known: its first step costs one run. It ends
    /// as soon as the secant promises nothing more; [`LeastSquares::polish`] goes on from there.
    pub fn from_known(
        z: DVector<f64>,
        residual: DVector<f64>,
        jacobian: DMatrix<f64>,
        prior: Scaled,
        tolerance: f64,
        trials: usize,
    ) -> Self {
        let mut fit = Self::new(z, prior, tolerance, trials);
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
        self.need = if self.fresh { self.need.clone() } else { Need::Jacobian(self.z.clone()) };
        if self.fresh {
            self.plan();
        }
    }

    /// What it needs next.
    pub fn need(&self) -> &Need {
        &self.need
    }

    /// The best point so far, its whitened residual, and the Jacobian there, measured or by the secant.
    pub fn best(&self) -> (&DVector<f64>, &DVector<f64>, &DMatrix<f64>) {
        (&self.z, &self.residual, &self.jacobian)
    }

    /// Chi-square plus prior at the best point.
    pub fn cost(&self) -> f64 {
        self.cost
    }

    /// The cost that the linear model promises at its minimum.
    pub fn promised(&self) -> f64 {
        match &self.need {
            Need::Residual(_) if self.cost.is_finite() => self.cost - self.predicted,
            _ => self.cost,
        }
    }

    /// The fall of the cost that the linear model promised with the last step that was considered.
    pub fn last_promise(&self) -> f64 {
        self.predicted
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
        let step = &trial - &self.z;
        let cost = residual.as_ref().map_or(f64::INFINITY, |e| self.cost_of(&trial, e));
        let was_fresh = self.fresh;
        let ratio = (self.cost - cost) / self.predicted.max(f64::MIN_POSITIVE);
        if let Some(new) = &residual {
            // Broyden's update: the change of the prediction is minus that of the residual.
            let surprise = &self.residual - new - &self.jacobian * &step;
            self.jacobian += surprise * step.transpose() / step.norm_squared().max(f64::MIN_POSITIVE);
        }
        if let Some(residual) = residual.filter(|_| cost < self.cost) {
            self.accept(trial, residual, cost, ratio, was_fresh);
        } else {
            self.reject(was_fresh);
        }
    }

    /// Takes the Jacobian (m x p) that was asked for; `None` when one of its runs failed.
    pub fn give_jacobian(&mut self, jacobian: Option<DMatrix<f64>>) {
        match jacobian.filter(|j| j.iter().all(|v| v.is_finite())) {
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

    fn accept(&mut self, z: DVector<f64>, e: DVector<f64>, cost: f64, ratio: f64, was_fresh: bool) {
        self.z = z;
        self.residual = e;
        self.cost = cost;
        self.fresh = false;
        self.measured = None;
        self.rejected = 0;
        if ratio > 0.75 {
            self.damping *= 0.1;
        } else if ratio < 0.25 {
            self.damping = self.damping.max(REJECTED_DAMPING) * 2.0;
        }
        if self.trials_left == 0 {
            self.need = Need::Nothing(End::Limit);
        } else if ratio < 0.25 && self.thorough && !was_fresh {
            self.need = Need::Jacobian(self.z.clone());
        } else {
            self.plan();
        }
    }

    fn reject(&mut self, was_fresh: bool) {
        self.rejected += 1;
        self.damping = self.damping.max(REJECTED_DAMPING) * 5.0;
        if self.trials_left == 0 {
            self.need = Need::Nothing(End::Limit);
        } else if self.rejected > STUBBORN {
            self.give_up(was_fresh);
        } else if self.thorough && self.measured.is_none() {
            self.damping = 0.0;
            self.need = Need::Jacobian(self.z.clone());
        } else if self.rejected > 1 && self.restore() {
            // The secant did not help either: shorter steps along the measured slope must, in the end, lower the cost.
            self.plan();
        } else {
            // The secant has learned from the failure: what it holds is no longer of this point alone.
            self.fresh = false;
            self.plan();
        }
    }

    /// Ends for want of a step that lowers the cost. What the undamped step promises tells how far from a minimum that is.
    fn give_up(&mut self, was_fresh: bool) {
        let of_here = self.restore() || was_fresh;
        self.damping = 0.0;
        let _ = self.step();
        self.need = Need::Nothing(if of_here { End::Stalled } else { End::Tentative });
    }

    /// Back to the Jacobian that was measured at this point, if one was.
    fn restore(&mut self) -> bool {
        let Some(measured) = &self.measured else { return false };
        self.jacobian.clone_from(measured);
        self.fresh = true;
        true
    }

    /// Chooses the next need from the linear model at the best point.
    fn plan(&mut self) {
        let Some(step) = self.step() else {
            self.need = Need::Nothing(End::Stalled);
            return;
        };
        if self.predicted <= self.tolerance {
            self.need = if self.fresh {
                Need::Nothing(End::Converged)
            } else if self.thorough {
                Need::Jacobian(self.z.clone())
            } else {
                Need::Nothing(End::Tentative)
            };
            return;
        }
        self.need = Need::Residual(&self.z + step);
    }

    /// The damped step within the bounds; notes the fall of the cost that it promises. Components at a bound that pull
    /// outwards are left where they are.
    fn step(&mut self) -> Option<DVector<f64>> {
        let p = self.z.len();
        let weight = DMatrix::from_diagonal(&self.prior.precision);
        let hessian = self.jacobian.tr_mul(&self.jacobian) + &weight;
        let gradient = self.jacobian.tr_mul(&self.residual) + weight * (&self.prior.mean - &self.z);
        let held = |j: usize| {
            let [lo, hi] = self.prior.bounds[j];
            (self.z[j] <= lo && gradient[j] < 0.0) || (self.z[j] >= hi && gradient[j] > 0.0)
        };
        let free: Vec<usize> = (0..p).filter(|j| !held(*j) && hessian[(*j, *j)] > 0.0).collect();
        let mut damped = hessian.select_rows(&free).select_columns(&free);
        for (k, j) in free.iter().enumerate() {
            damped[(k, k)] += hessian[(*j, *j)] * (self.damping + 1e-12);
        }
        let solved = damped.cholesky()?.solve(&gradient.select_rows(&free));
        let shrink = (LONGEST / solved.amax().max(f64::MIN_POSITIVE)).min(1.0);
        let mut step = DVector::zeros(p);
        for (k, j) in free.iter().enumerate() {
            let [lo, hi] = self.prior.bounds[*j];
            step[*j] = (self.z[*j] + solved[k] * shrink).clamp(lo, hi) - self.z[*j];
        }
        self.predicted = 2.0 * gradient.dot(&step) - step.dot(&(&hessian * &step));
        Some(step)
    }

    fn cost_of(&self, z: &DVector<f64>, residual: &DVector<f64>) -> f64 {
        let pull = z - &self.prior.mean;
        residual.norm_squared() + pull.component_mul(&pull).dot(&self.prior.precision)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// y = a exp(-b t), observed without noise at a = 2, b = 0.7.
    fn residual(z: &DVector<f64>) -> DVector<f64> {
        DVector::from_fn(20, |i, _| {
            let t = 0.2 * i as f64;
            (2.0 * (-0.7 * t).exp() - z[0] * (-z[1] * t).exp()) / 0.01
        })
    }

    fn jacobian(z: &DVector<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(20, 2, |i, j| {
            let t = 0.2 * i as f64;
            let e = (-z[1] * t).exp() / 0.01;
            if j == 0 { e } else { -z[0] * t * e }
        })
    }

    fn flat(p: usize) -> Scaled {
        let bounds = vec![[f64::NEG_INFINITY, f64::INFINITY]; p];
        Scaled { mean: DVector::zeros(p), precision: DVector::zeros(p), bounds }
    }

    fn drive(fit: &mut LeastSquares) -> (End, usize, usize) {
        let (mut runs, mut jacobians) = (0, 0);
        loop {
            match fit.need().clone() {
                Need::Residual(z) => {
                    runs += 1;
                    fit.give_residual(Some(residual(&z)));
                }
                Need::Jacobian(z) => {
                    jacobians += 1;
                    fit.give_jacobian(Some(jacobian(&z)));
                }
                Need::Nothing(end) => return (end, runs, jacobians),
            }
        }
    }

    #[test]
    fn an_exponential_is_found_with_few_jacobians() {
        let mut fit = LeastSquares::new(DVector::from_vec(vec![1.0, 0.2]), flat(2), 1e-6, 50);
        let (end, runs, jacobians) = drive(&mut fit);
        assert_eq!(end, End::Converged);
        // The secant ends within 1e-3 noise sd of the truth, so both parameters are right to about 1e-5.
        assert!(
            (fit.best().0[0] - 2.0).abs() < 1e-4 && (fit.best().0[1] - 0.7).abs() < 1e-4,
            "{:?}",
            fit.best().0
        );
        assert!(jacobians <= 4 && runs <= 20, "{runs} runs, {jacobians} Jacobians");
    }

    #[test]
    fn a_bound_holds_and_the_fit_ends_there() {
        let mut prior = flat(2);
        prior.bounds[1] = [0.0, 0.5];
        let mut fit = LeastSquares::new(DVector::from_vec(vec![1.0, 0.2]), prior, 1e-6, 50);
        assert_eq!(drive(&mut fit).0, End::Converged);
        assert!((fit.best().0[1] - 0.5).abs() < 1e-12, "{:?}", fit.best().0);
    }

    #[test]
    fn a_failed_run_is_a_rejected_step() {
        let mut fit = LeastSquares::new(DVector::from_vec(vec![1.0, 0.2]), flat(2), 1e-6, 50);
        fit.give_residual(Some(residual(&DVector::from_vec(vec![1.0, 0.2]))));
        fit.give_jacobian(Some(jacobian(&DVector::from_vec(vec![1.0, 0.2]))));
        fit.give_residual(None);
        assert_eq!(drive(&mut fit).0, End::Converged);
    }

    #[test]
    fn a_known_start_costs_one_run_per_step_and_no_jacobian() {
        let z = DVector::from_vec(vec![1.9, 0.65]);
        let mut fit = LeastSquares::from_known(z.clone(), residual(&z), jacobian(&z), flat(2), 0.1, 20);
        let (end, runs, jacobians) = drive(&mut fit);
        assert_eq!((end, jacobians), (End::Tentative, 0));
        assert!(runs <= 6 && fit.cost() < 1.0, "{runs} runs, cost {}", fit.cost());
        fit.polish(10);
        assert_eq!(drive(&mut fit).0, End::Converged);
    }

    #[test]
    fn steps_that_overshoot_are_shortened_until_one_helps() {
        // Gauss-Newton diverges on the arctangent from here, and the secant across it overshoots too.
        let mut fit = LeastSquares::new(DVector::from_element(1, 0.5), flat(1), 1e-9, 50);
        let end = loop {
            match fit.need().clone() {
                Need::Residual(z) => fit.give_residual(Some(z.map(|z| -100.0 * (20.0 * z).atan()))),
                Need::Jacobian(z) => {
                    let slope = 2000.0 / (1.0 + (20.0 * z[0]).powi(2));
                    fit.give_jacobian(Some(DMatrix::from_element(1, 1, slope)));
                }
                Need::Nothing(end) => break end,
            }
        };
        assert_eq!(end, End::Converged, "at {}, cost {}", fit.best().0[0], fit.cost());
        // A cost of 1e-9 at a slope of 2000 per unit is 2e-8.
        assert!(fit.best().0[0].abs() < 1e-7, "{}", fit.best().0[0]);
    }

    #[test]
    fn a_prior_pulls_as_its_precision_says() {
        // One datum at 1 with noise 1, prior 0 with sd 1: the mode is 1/2.
        let prior = Scaled { precision: DVector::from_element(1, 1.0), ..flat(1) };
        let mut fit = LeastSquares::new(DVector::zeros(1), prior, 1e-12, 20);
        loop {
            match fit.need().clone() {
                Need::Residual(z) => fit.give_residual(Some(DVector::from_element(1, 1.0 - z[0]))),
                Need::Jacobian(_) => fit.give_jacobian(Some(DMatrix::from_element(1, 1, 1.0))),
                Need::Nothing(_) => break,
            }
        }
        assert!((fit.best().0[0] - 0.5).abs() < 1e-9);
    }
}
