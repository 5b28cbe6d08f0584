//! The fit at one centre and the slope of the predictions around it: what one ensemble of a batch fit says.
//!
//! Everything is in parameters whitened by the prior, theta = mean + L u with u standard normal, so that the prior is
//! the unit matrix and a step of size one is one prior sd. Deliberately without any choice of step: see `batch.rs`.

use nalgebra::{DMatrix, DVector};

use crate::data::same;
use crate::particles::{SPANNED, weighted_transpose};
use crate::whiten::{Spread, Sweep};
use crate::{Data, EstimatorError, SigmaSet};

/// The fit at one centre, and the slope around it, in parameters whitened by the prior.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Linearisation {
    /// Centre u, length p.
    pub centre: DVector<f64>,
    /// Information J^T W^-1 J of the data about u, p x p.
    pub information: DMatrix<f64>,
    /// Half the gradient of the cost, J^T W^-1 (prediction - data) + u, length p.
    pub gradient: DVector<f64>,
    /// -2 log posterior up to a constant: misfit + u^T u.
    pub cost: f64,
    /// Whitened squared residual (z - Z)^T W^-1 (z - Z) at the centre.
    pub misfit: f64,
    /// Rows that were not missing.
    pub n_used: usize,
    /// Log-likelihood at the centre, natural logarithm.
    pub log_likelihood: f64,
}

/// One ensemble around a centre: column 0 is the centre, then r points.
pub(crate) struct Ensemble<'a> {
    pub(crate) set: &'a SigmaSet,
    /// Centre u, length p.
    pub(crate) centre: &'a DVector<f64>,
    /// Factor of the offsets of the points, p x p: point i is u + scale I_i.
    pub(crate) scale: &'a DMatrix<f64>,
    /// m x (r+1).
    pub(crate) predictions: &'a DMatrix<f64>,
    /// Length r+1.
    pub(crate) failed: &'a [bool],
    pub(crate) data: &'a Data<'a>,
}

/// What became of an ensemble.
pub(crate) enum Outcome {
    Fit(Linearisation),
    /// The centre could not be run.
    NoCentre,
    /// Too few points could be run to tell every direction.
    NotSpanned,
}

impl Ensemble<'_> {
    /// The linearisation, by regression through the centre. A point whose predictions are not finite has failed.
    pub(crate) fn linearise(&self) -> Result<Outcome, EstimatorError> {
        let r = self.set.n_particle();
        same("rows of the predictions", self.data.values.len(), self.predictions.nrows())?;
        same("columns of the predictions", r + 1, self.predictions.ncols())?;
        same("failed particles", r + 1, self.failed.len())?;
        let rows = self.data.observed()?;
        let active: Vec<bool> = (0..=r)
            .map(|j| !self.failed[j] && rows.iter().all(|&k| self.predictions[(k, j)].is_finite()))
            .collect();
        if !active[0] {
            return Ok(Outcome::NoCentre);
        }
        let Some(slope) = self.regression(&active) else { return Ok(Outcome::NotSpanned) };
        let mut reference = DVector::zeros(r + 1);
        reference[0] = 1.0;
        let sweep = Sweep {
            predictions: self.predictions,
            reference: &reference,
            active: &active,
            data: self.data,
            rows: &rows,
            spread: Spread::Ignored,
        };
        match sweep.run(false) {
            Ok(whitened) => {
                Ok(Outcome::Fit(self.fit(&whitened.products, whitened.log_det_noise, &slope, rows.len())))
            }
            // Finite predictions whose square overflows: as far from the data as a failed run.
            Err(EstimatorError::NotFinite { .. }) => Ok(Outcome::NoCentre),
            Err(error) => Err(error),
        }
    }

    fn fit(
        &self,
        products: &DMatrix<f64>,
        log_det_noise: f64,
        slope: &DMatrix<f64>,
        n_used: usize,
    ) -> Linearisation {
        let r = self.set.n_particle();
        let misfit = products[(r + 1, r + 1)];
        let information = slope.tr_mul(&(products.view((1, 1), (r, r)) * slope));
        let pull = slope.tr_mul(&products.view((1, r + 1), (r, 1)));
        let constant = n_used as f64 * (2.0 * std::f64::consts::PI).ln();
        Linearisation {
            centre: self.centre.clone(),
            information: (&information + information.transpose()) * 0.5,
            gradient: self.centre - pull,
            cost: misfit + self.centre.norm_squared(),
            misfit,
            n_used,
            log_likelihood: -0.5 * (constant + log_det_noise + misfit),
        }
    }

    /// D X^T (X D X^T)^{-1}, r x p, over the points that ran, X their offsets from the centre: deviations from the
    /// centre times this is the slope. `None` when the points do not span.
    fn regression(&self, active: &[bool]) -> Option<DMatrix<f64>> {
        let weights =
            DVector::from_fn(
                self.set.n_particle(),
                |i, _| {
                    if active[i + 1] { self.set.weights[i] } else { 0.0 }
                },
            );
        let dual = weighted_transpose(&self.set.points, &weights);
        let moment = &self.set.points * &dual;
        if moment.clone().symmetric_eigen().eigenvalues.min() < SPANNED {
            return None;
        }
        let per_point = moment.lu().solve(&dual.transpose())?.transpose();
        Some(self.scale.transpose().lu().solve(&per_point.transpose())?.transpose())
    }
}
