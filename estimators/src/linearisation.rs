//! The fit at one centre and the slope of the predictions around it: what one ensemble of a batch fit says.
//!
//! Everything is in parameters whitened by the prior, theta = mean + L u with u standard normal, so that the prior is
//! the unit matrix and a step of size one is one prior sd. The whitened Jacobian stands under the prior's rows and is
//! factored itself, block by block of rows: its square, which has twice the digits, is never formed (Golub 1965).
//! Deliberately without any choice of step: see `batch.rs`.

use nalgebra::{DMatrix, DVector};

use crate::data::same;
use crate::particles::{SPANNED, weighted_transpose};
use crate::spectral;
use crate::whiten::{Spread, Sweep};
use crate::{Data, EstimatorError, Noise, SigmaSet};

/// Rows that are factored at once.
const BLOCK: usize = 4096;

/// The fit at one centre, and the slope around it, in parameters whitened by the prior.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Linearisation {
    /// Centre u, length p.
    pub centre: DVector<f64>,
    /// Upper triangle R of the QR factorisation of the prior's rows and the whitened Jacobian, (1; W^-1/2 J) = Q R, p x p:
    /// half the second derivative of the cost (Gauss-Newton) is R^T R.
    pub root: DMatrix<f64>,
    /// The right-hand side (-u; W^-1/2 (data - prediction)) in the same basis, Q^T of it, length p: the step to the minimum of
    /// the linear model is R^-1 of this, and its length in posterior sd is the norm of this.
    pub along: DVector<f64>,
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
        let Some(slope) = self.regression(&active)? else { return Ok(Outcome::NotSpanned) };
        match self.fit(&active, &rows, &slope) {
            Ok(fit) => Ok(Outcome::Fit(fit)),
            // Finite predictions whose square overflows: as far from the data as a failed run.
            Err(EstimatorError::NotFinite { .. }) => Ok(Outcome::NoCentre),
            Err(error) => Err(error),
        }
    }

    /// Whitens block by block and takes each into the triangle.
    fn fit(
        &self,
        active: &[bool],
        rows: &[usize],
        slope: &DMatrix<f64>,
    ) -> Result<Linearisation, EstimatorError> {
        let r = self.set.n_particle();
        let mut reference = DVector::zeros(r + 1);
        reference[0] = 1.0;
        let mut stack = Stack::new(self.centre);
        let (mut misfit, mut log_det_noise) = (0.0, 0.0);
        // Correlated noise whitens all rows together.
        let block = if matches!(self.data.noise, Noise::Diagonal(_)) { BLOCK } else { rows.len().max(1) };
        for rows in rows.chunks(block) {
            let sweep = Sweep {
                predictions: self.predictions,
                reference: &reference,
                active,
                data: self.data,
                rows,
                spread: Spread::Ignored,
            };
            let whitened = sweep.run(true)?;
            let columns = whitened.columns.ok_or(EstimatorError::NotFinite { what: "the whitened rows" })?;
            stack.take(&(columns.columns(1, r) * slope), &columns.column(r + 1).into_owned())?;
            misfit += columns.column(r + 1).norm_squared();
            log_det_noise += whitened.log_det_noise;
        }
        let constant = rows.len() as f64 * (2.0 * std::f64::consts::PI).ln();
        let p = self.centre.len();
        Ok(Linearisation {
            centre: self.centre.clone(),
            root: stack.triangle.view((0, 0), (p, p)).into_owned(),
            along: stack.triangle.view((0, p), (p, 1)).column(0).into_owned(),
            cost: misfit + self.centre.norm_squared(),
            misfit,
            n_used: rows.len(),
            log_likelihood: -0.5 * (constant + log_det_noise + misfit),
        })
    }

    /// D X^T (X D X^T)^{-1}, r x p, over the points that ran, X their offsets from the centre: deviations from the
    /// centre times this is the slope. `None` when the points do not span.
    fn regression(&self, active: &[bool]) -> Result<Option<DMatrix<f64>>, EstimatorError> {
        let weights =
            DVector::from_fn(
                self.set.n_particle(),
                |i, _| {
                    if active[i + 1] { self.set.weights[i] } else { 0.0 }
                },
            );
        let dual = weighted_transpose(&self.set.points, &weights);
        let moment = &self.set.points * &dual;
        if spectral::eigen(moment.clone(), "second moment of the sigma points")?.eigenvalues.min() < SPANNED {
            return Ok(None);
        }
        let per_point = moment.lu().solve(&dual.transpose());
        Ok(per_point.and_then(|d| self.scale.transpose().lu().solve(&d)).map(|d| d.transpose()))
    }
}

/// The triangle of everything stacked so far, its right-hand side as a last column, (p+1) x (p+1).
struct Stack {
    triangle: DMatrix<f64>,
}

impl Stack {
    /// The prior's rows: (1, -u).
    fn new(centre: &DVector<f64>) -> Self {
        let p = centre.len();
        let mut triangle = DMatrix::identity(p + 1, p + 1);
        triangle.view_mut((0, p), (p, 1)).copy_from(&-centre);
        triangle[(p, p)] = 0.0;
        Self { triangle }
    }

    /// Puts whitened rows below and factors again.
    fn take(&mut self, jacobian: &DMatrix<f64>, residual: &DVector<f64>) -> Result<(), EstimatorError> {
        let (m, p) = jacobian.shape();
        let mut rows = self.triangle.clone().resize_vertically(p + 1 + m, 0.0);
        rows.view_mut((p + 1, 0), (m, p)).copy_from(jacobian);
        rows.view_mut((p + 1, p), (m, 1)).copy_from(residual);
        self.triangle = rows.qr().unpack_r();
        let finite = self.triangle.iter().all(|v| v.is_finite());
        if finite { Ok(()) } else { Err(EstimatorError::NotFinite { what: "the stacked sensitivity" }) }
    }
}

impl Linearisation {
    /// How much the cost falls by a step of u, as the linear model foretells it.
    pub(crate) fn foretold(&self, step: &DVector<f64>) -> f64 {
        let moved = &self.root * step;
        2.0 * moved.dot(&self.along) - moved.norm_squared()
    }

    /// The step to the minimum of the linear model.
    pub(crate) fn newton(&self) -> Option<DVector<f64>> {
        self.root.solve_upper_triangular(&self.along)
    }

    /// The step damped by `damping` times the diagonal of R^T R.
    pub(crate) fn damped(&self, damping: f64) -> Option<DVector<f64>> {
        let p = self.centre.len();
        let mut rows = self.root.clone().resize(2 * p, p + 1, 0.0);
        rows.view_mut((0, p), (p, 1)).copy_from(&self.along);
        for (j, column) in self.root.column_iter().enumerate() {
            rows[(p + j, j)] = damping.sqrt() * column.norm();
        }
        let triangle = rows.qr().unpack_r();
        triangle.view((0, 0), (p, p)).solve_upper_triangular(&triangle.view((0, p), (p, 1)).column(0))
    }
}
