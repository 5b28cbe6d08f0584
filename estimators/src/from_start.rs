//! What the data of a pass with drift say of where the pass started, so that its result is restated under another prior.
//!
//! [`crate::exchange_prior`] takes the used prior out in information form, which a random walk between the analyses forbids. Here the
//! start itself is uncertain: where the pass started from N(m, S) and the wanted prior is N(m0, P0), the start is m + e with
//! e ~ N(m0 - m, P0 - S). Innovations and the last mean are linear in e, so its likelihood, summed beside the filter, gives mean,
//! covariance, evidence and NIS under the wanted prior (the augmented filter of de Jong, Ann. Statist. 19, 1991). Exact for a
//! linear Gaussian problem with a walk; what forgetting adds is taken as noise of the size that it had in this pass.
//! Read next: `exchange.rs`.

use nalgebra::{DMatrix, DVector};

use crate::data::same;
use crate::exchange::{Likelihood, Update, root};
use crate::{Analysis, EstimatorError, Exchanged, Filter, Gaussian, Particles, spectral};

/// A pass with drift seen from its start; e is counted in the directions of the particles there.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct FromStart {
    /// What is known after the last analysis, before the parameters move on.
    known: Gaussian,
    /// Slope of its mean by e, p x p.
    slope: DMatrix<f64>,
    /// The same in the directions of the particles as they are now, p x p.
    reach: DMatrix<f64>,
    /// Slope of the log-likelihood of e at zero, length p.
    score: DVector<f64>,
    /// Its negative second derivative, p x p.
    information: DMatrix<f64>,
}

impl FromStart {
    /// Before the first analysis of a pass that starts from `start`.
    pub fn new(start: &Gaussian) -> Self {
        let p = start.n_param();
        Self {
            known: start.clone(),
            slope: start.factor(),
            reach: DMatrix::identity(p, p),
            score: DVector::zeros(p),
            information: DMatrix::zeros(p, p),
        }
    }

    /// The particles were drawn again, X <- X R.
    pub fn redrawn(&mut self, filter: &dyn Filter, before: &Particles, r: &DMatrix<f64>) {
        // A rotation of the directions where they hold the whole spread; else what is left out is reported as such.
        self.reach = filter.reduced(before, r).1.tr_mul(&self.reach);
    }

    /// After an analysis without drift that took the particles from `before` to `after`.
    pub fn analysed(&mut self, filter: &dyn Filter, before: &Particles, t: &DMatrix<f64>, after: &Particles) {
        let (step, root) = filter.reduced(before, t);
        let p = step.len();
        // With S the covariance of the innovations: HL^T S^-1 (innovation) and HL^T S^-1 HL.
        self.score += self.reach.tr_mul(&step);
        let informed = DMatrix::identity(p, p) - &root * root.transpose();
        self.information += self.reach.tr_mul(&(informed * &self.reach));
        self.reach = root.tr_mul(&self.reach);
        self.slope = filter.directions(after, &after.theta) * &self.reach;
        self.known = filter.gaussian(after);
    }

    /// The parameters moved on from `before`, X <- X M.
    ///
    /// # Errors
    /// `NotPositiveDefinite` when the drift has no inverse.
    pub fn moved(
        &mut self,
        filter: &dyn Filter,
        before: &Particles,
        m: &DMatrix<f64>,
    ) -> Result<(), EstimatorError> {
        let singular = EstimatorError::NotPositiveDefinite { what: "drift of the parameters" };
        self.reach = filter.reduced(before, m).1.lu().solve(&self.reach).ok_or(singular)?;
        Ok(())
    }

    /// Restates innovations and their sd, as they were before the data, under the prior `wanted`; `predicted` are the directions
    /// of the predictions, m x p.
    ///
    /// # Errors
    /// As [`FromStart::restated`].
    pub fn innovate(
        &self,
        predicted: &DMatrix<f64>,
        analysis: &mut Analysis,
        used: &Gaussian,
        wanted: &Gaussian,
    ) -> Result<(), EstimatorError> {
        let start = self.start(used, wanted)?;
        let slope = predicted * &self.reach;
        let (shift, spread) = (&slope * start.mean, slope * start.factor);
        for row in 0..shift.len() {
            analysis.innovation[row] -= shift[row];
            analysis.innovation_sd[row] = analysis.innovation_sd[row].hypot(spread.row(row).norm());
        }
        Ok(())
    }

    /// What is known under the prior `wanted` instead of `used`, and what that does to log-likelihood and NIS of the pass.
    ///
    /// # Errors
    /// `Shape`, `NotPositiveDefinite` and `NotDecomposed` for priors that do not fit or are singular.
    pub fn restated(&self, used: &Gaussian, wanted: &Gaussian) -> Result<Exchanged, EstimatorError> {
        let start = self.start(used, wanted)?;
        let factor = &self.slope * start.factor;
        Ok(Exchanged {
            posterior: Gaussian {
                mean: &self.known.mean + &self.slope * start.mean,
                covariance: &self.known.covariance + &factor * factor.transpose(),
            },
            log_likelihood: start.fit - 0.5 * start.log_det,
            nis: -2.0 * start.fit,
        })
    }

    /// What is known of e. A wanted prior that is narrower than the used one in a direction leaves e there where it is.
    fn start(&self, used: &Gaussian, wanted: &Gaussian) -> Result<Update, EstimatorError> {
        for (what, g) in [("used prior", used), ("wanted prior", wanted)] {
            same(what, self.known.n_param(), g.n_param())?;
        }
        let l = root(used, "used prior")?.unpack();
        let singular = || EstimatorError::NotPositiveDefinite { what: "used prior" };
        let solve = |x: &DMatrix<f64>| l.solve_lower_triangular(x).ok_or_else(singular);
        let away = l.solve_lower_triangular(&(&wanted.mean - &used.mean)).ok_or_else(singular)?;
        let wider = solve(&solve(&(&wanted.covariance - &used.covariance))?.transpose())?;
        let eigen = spectral::eigen((&wider + wider.transpose()) * 0.5, "difference of the priors")?;
        let wider =
            &eigen.eigenvectors * DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0).sqrt()));
        let likelihood = Likelihood { information: self.information.clone(), slope: self.score.clone() };
        likelihood.update(&away, &wider)
    }
}
