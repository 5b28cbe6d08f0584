//! Batch fit: iterated sigma-point Gauss-Newton with damping, for solvers that cannot restart from a state.
//!
//! One iteration is one ensemble of whole-record runs: the centre, and sigma points around it whose regression replaces
//! the derivative. Gauss-Newton with the prior as a term of its own (Bell 1994), solved by QR of the
//! stacked whitened rows (`linearisation.rs`), damped after Levenberg (1944) and
//! Marquardt (1963), the damping controlled after Nielsen (1999). A centre that lowers the cost is kept; otherwise the
//! step is shortened and recomputed from the linearisation of the best centre. There is no loop here: the caller stops at
//! `converged` or at `max_iterations`. Read next: `linearisation.rs`.

use nalgebra::{DMatrix, DVector};

use crate::blocks::{self, Block};
use crate::data::same;
use crate::linearisation::{Ensemble, Linearisation, Outcome};
use crate::{Data, EstimatorError, Form, Gaussian, Kind, SigmaSet, Slope};

/// Iterated sigma-point Gauss-Newton.
pub static BATCH: Kind = Kind {
    name: "batch",
    keys: &["points", "kappa", "spread", "max_iterations", "tolerance"],
    spread: 0.1,
    form: Form::WholeRecords(Slope::Points),
};

/// Damping of the first step, relative to the diagonal of the information.
const FIRST_DAMPING: f64 = 1e-3;
/// Least damping after a rejected step.
const REJECTED_DAMPING: f64 = 0.02;
/// First factor by which a rejected step raises the damping; it doubles with every further one.
const FIRST_GROWTH: f64 = 4.0;
/// No parameter moves further than this in one step, in prior sd.
const LONGEST: f64 = 2.0;
/// Steps rejected in a row before the best centre is linearised again with closer points.
const MOST_REJECTED: usize = 4;
/// Points come no closer than this, relative to the spread asked for.
const NARROWEST: f64 = 0.1;
/// Ensembles around the prior mean before the start counts as failed.
const STARTS: usize = 4;

/// Settings of a batch fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// Sigma points, r of them, for all p parameters or for the q of one of the blocks.
    pub set: SigmaSet,
    /// Rows that answer to some of the parameters only; empty where every row may answer to all. The noise of different blocks
    /// is independent.
    pub blocks: Vec<Block>,
    /// Spread of the points in units of the current posterior sd (of the prior sd at first). When the steps get shorter than
    /// one sd, the points move closer to the centre with them, down to a tenth of this.
    pub spread: f64,
    /// Ensembles at most; the caller stops there.
    pub max_iterations: usize,
    /// Converged when the undamped step is shorter than this, in posterior sd.
    pub tolerance: f64,
}

/// All that a batch fit carries from one ensemble to the next. Vectors and matrices are in parameters whitened by the
/// prior: theta = prior mean + L u, L the lower Cholesky factor of the prior covariance.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct BatchState {
    /// Prior of the transformed parameters.
    pub prior: Gaussian,
    /// Centre u of the next ensemble, length p.
    pub trial: DVector<f64>,
    /// Factor of the offsets of the next ensemble, p x p or p x q: point i is trial + scale I_i.
    pub scale: DMatrix<f64>,
    /// Distance of the points relative to [`Batch::spread`].
    pub width: f64,
    /// Damping of the next step, relative to the diagonal of the information.
    pub damping: f64,
    /// Factor by which the next rejection raises the damping.
    pub growth: f64,
    /// Ensembles used so far.
    pub iteration: usize,
    /// Ensembles rejected in a row.
    pub rejected: usize,
    /// The best centre so far and the slope there; none before the first ensemble.
    pub best: Option<Linearisation>,
    /// The undamped step from the best centre is shorter than the tolerance.
    pub converged: bool,
}

/// What is known after one ensemble, at the best centre so far.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchStep {
    /// -2 log posterior up to a constant: misfit plus squared distance from the prior mean in prior sd.
    pub cost: f64,
    /// Whitened squared residual.
    pub misfit: f64,
    /// Rows that were not missing.
    pub n_used: usize,
    /// Length of the undamped step to the minimum, in posterior sd.
    pub step: f64,
    /// The centre of this ensemble is the new best.
    pub accepted: bool,
    /// The step is shorter than the tolerance.
    pub converged: bool,
    /// Gaussian posterior (P0^-1 + J^T W^-1 J)^-1 around the best centre; once converged, around the end of the last step.
    pub posterior: Gaussian,
    /// Log-likelihood at the best centre, natural logarithm.
    pub log_likelihood: f64,
    /// Laplace approximation of the log evidence, exact for a linear model once converged.
    pub evidence: f64,
}

impl Batch {
    /// Ensembles at most, unless something else is asked for.
    pub const MAX_ITERATIONS: usize = 30;

    /// A batch fit with the usual settings: spread 0.1, tolerance 0.01, at most [`Batch::MAX_ITERATIONS`] ensembles.
    pub fn new(set: SigmaSet) -> Self {
        Self { set, blocks: Vec::new(), spread: 0.1, max_iterations: Self::MAX_ITERATIONS, tolerance: 1e-2 }
    }

    /// The state before any ensemble: centred at the prior mean, points at `spread` prior sd.
    ///
    /// # Panics
    /// When the prior has not the p parameters of the sigma points.
    pub fn init(&self, prior: &Gaussian) -> BatchState {
        let p = blocks::n_param(&self.blocks, &self.set);
        assert_eq!(prior.n_param(), p, "prior and sigma points differ in parameters");
        BatchState {
            prior: prior.clone(),
            trial: DVector::zeros(p),
            scale: blocks::first(&self.blocks, &self.set) * self.spread,
            width: 1.0,
            damping: FIRST_DAMPING,
            growth: FIRST_GROWTH,
            iteration: 0,
            rejected: 0,
            best: None,
            converged: false,
        }
    }

    /// Transformed parameters of the next ensemble, p x (r+1): column 0 is the centre, then the sigma points around it.
    pub fn sample(&self, s: &BatchState) -> DMatrix<f64> {
        let mut u = (&s.scale * &self.set.points).insert_column(0, 0.0);
        for mut column in u.column_iter_mut() {
            column += &s.trial;
        }
        let mut theta = s.prior.factor() * u;
        for mut column in theta.column_iter_mut() {
            column += &s.prior.mean;
        }
        theta
    }

    /// Takes the predictions of one ensemble (m x (r+1), columns as in [`Batch::sample`]) and chooses the next.
    ///
    /// A failed centre, marked or not finite, is a rejected step; failed points are left out of the regression as long
    /// as the rest spans the parameters.
    ///
    /// # Errors
    /// Wrong lengths, bad data or noise, `Spread` when it is not positive and finite, and `StartFailed` when nothing
    /// could be run around the prior mean.
    pub fn step(
        &self,
        s: &BatchState,
        predictions: &DMatrix<f64>,
        failed: &[bool],
        data: &Data<'_>,
    ) -> Result<(BatchState, BatchStep), EstimatorError> {
        same("parameters of the state", blocks::n_param(&self.blocks, &self.set), s.trial.len())?;
        if !(self.spread > 0.0 && self.spread.is_finite()) {
            return Err(EstimatorError::Spread { value: self.spread });
        }
        let ensemble = Ensemble {
            set: &self.set,
            blocks: &self.blocks,
            centre: &s.trial,
            scale: &s.scale,
            predictions,
            failed,
            data,
        };
        let mut next = s.clone();
        next.iteration += 1;
        let outcome = ensemble.linearise()?;
        let accepted = match (outcome, &s.best) {
            (Outcome::Fit(fit), None) => {
                next.best = Some(fit);
                true
            }
            (Outcome::Fit(fit), Some(best)) if fit.cost <= best.cost => {
                next.relax(best, &fit);
                next.best = Some(fit);
                true
            }
            (Outcome::NoCentre, None) => return Err(EstimatorError::StartFailed { attempt: next.iteration }),
            (Outcome::NotSpanned, None) if next.iteration >= STARTS => {
                return Err(EstimatorError::StartFailed { attempt: next.iteration });
            }
            _ => false,
        };
        let Some(best) = next.best.clone() else {
            next.scale *= 0.25;
            return Ok((next.clone(), Self::unstarted(&next)));
        };
        if accepted {
            next.rejected = 0;
        } else {
            next.reject();
        }
        self.advance(&mut next, &best, accepted).map(|step| (next, step))
    }

    /// The next centre and its points, from the best linearisation; and the report.
    fn advance(
        &self,
        next: &mut BatchState,
        best: &Linearisation,
        accepted: bool,
    ) -> Result<BatchStep, EstimatorError> {
        let singular = EstimatorError::NotPositiveDefinite { what: "posterior" };
        let newton = best.newton().ok_or_else(|| singular.clone())?;
        let step = best.along.norm();
        let relinearise = !accepted && next.rejected.is_multiple_of(MOST_REJECTED);
        if relinearise {
            next.trial.clone_from(&best.centre);
            next.width *= 0.3;
            next.refresh();
        } else {
            let damped = best.damped(next.damping).ok_or_else(|| singular.clone())?;
            next.trial = &best.centre + shortened(damped);
            if accepted {
                next.width = step.clamp(NARROWEST, 1.0);
            }
        }
        let log_det: f64 = best.root.diagonal().iter().map(|v| 2.0 * v.abs().ln()).sum();
        next.converged = step < self.tolerance;
        let (u, gain) =
            if next.converged { (&best.centre + newton, step * step) } else { (best.centre.clone(), 0.0) };
        let l = next.prior.factor();
        let p = best.centre.len();
        let identity = DMatrix::identity(p, p);
        let inverse = best.root.solve_upper_triangular(&identity).ok_or_else(|| singular.clone())?;
        next.scale =
            blocks::scale(&self.blocks, &best.root, &inverse)?.ok_or(singular)? * (self.spread * next.width);
        let factor = &l * inverse;
        Ok(BatchStep {
            cost: best.cost,
            misfit: best.misfit,
            n_used: best.n_used,
            step,
            accepted,
            converged: next.converged,
            posterior: Gaussian { mean: &next.prior.mean + l * u, covariance: &factor * factor.transpose() },
            log_likelihood: best.log_likelihood,
            evidence: best.log_likelihood + 0.5 * (best.misfit - best.cost + gain - log_det),
        })
    }

    /// The report while no ensemble could be linearised: nothing is known but the prior.
    fn unstarted(s: &BatchState) -> BatchStep {
        BatchStep {
            cost: f64::INFINITY,
            misfit: f64::INFINITY,
            n_used: 0,
            step: f64::INFINITY,
            accepted: false,
            converged: false,
            posterior: s.prior.clone(),
            log_likelihood: f64::NEG_INFINITY,
            evidence: f64::NEG_INFINITY,
        }
    }
}

impl BatchState {
    /// Lowers the damping by how well the linear model predicted the fall of the cost.
    fn relax(&mut self, from: &Linearisation, to: &Linearisation) {
        let s = &to.centre - &from.centre;
        let predicted_fall = from.predicted_fall(&s);
        if predicted_fall > 0.0 {
            let ratio = (from.cost - to.cost) / predicted_fall;
            self.damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(0.3, 2.0);
        }
        self.growth = FIRST_GROWTH;
    }

    fn reject(&mut self) {
        self.rejected += 1;
        self.damping = self.damping.max(REJECTED_DAMPING) * self.growth;
        self.growth *= 2.0;
    }

    /// Called before the slope is measured again: moves the damping half way back to [`REJECTED_DAMPING`] in the logarithm.
    /// With a full reset the fit could repeat for ever steps that are too long for the model's curvature.
    fn refresh(&mut self) {
        self.damping = (self.damping * REJECTED_DAMPING).sqrt();
        self.growth = FIRST_GROWTH;
    }
}

/// A step of which no component is longer than [`LONGEST`].
fn shortened(step: DVector<f64>) -> DVector<f64> {
    let longest = step.amax();
    if longest > LONGEST { step * (LONGEST / longest) } else { step }
}
