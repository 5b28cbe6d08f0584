//! The fit at one centre and the slope of the predictions around it: the result of one ensemble of a batch fit.
//!
//! Everything is in parameters whitened by the prior, theta = mean + L u with u standard normal, so that the prior is
//! the unit matrix and a step of size one is one prior sd. The whitened Jacobian stands under the prior's rows and is
//! factored itself, block by block of rows: its square, which has twice the digits, is never formed (Golub 1965).
//! Deliberately without any choice of step: see `batch.rs`.

use nalgebra::{DMatrix, DVector};

use crate::blocks::Block;
use crate::data::same;
use crate::particles::{SPANNED, weighted_transpose};
use crate::spectral;
use crate::whiten::{Spread, Sweep};
use crate::{Data, EstimatorError, Noise, SigmaSet, qr};

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
    /// Rows that answer to some of the parameters only; empty where every row may answer to all.
    pub(crate) blocks: &'a [Block],
    /// Factor of the offsets of the points, p x p or p x q: point i is u + scale I_i.
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
        let fit = if self.blocks.is_empty() { self.whole(&rows) } else { self.in_blocks(&rows) };
        match fit {
            // Finite predictions whose square overflows: as far from the data as a failed run.
            Err(EstimatorError::NotFinite { .. }) => Ok(Outcome::NoCentre),
            fit => fit,
        }
    }

    /// The points that ran, judged by these rows.
    fn active(&self, rows: &[usize]) -> Vec<bool> {
        let finite = |j: usize| rows.iter().all(|&k| self.predictions[(k, j)].is_finite());
        (0..=self.set.n_particle()).map(|j| !self.failed[j] && finite(j)).collect()
    }

    /// Every row answers to every parameter: whitened part by part, each taken into the triangle.
    fn whole(&self, rows: &[usize]) -> Result<Outcome, EstimatorError> {
        let active = self.active(rows);
        if !active[0] {
            return Ok(Outcome::NoCentre);
        }
        let Some(slope) = self.regression(&active, self.scale)? else { return Ok(Outcome::NotSpanned) };
        let mut stack = Stack::new(self.centre);
        let mut figures = Figures::default();
        // Correlated noise whitens all rows together.
        let block = if matches!(self.data.noise, Noise::Diagonal(_)) { BLOCK } else { rows.len().max(1) };
        for rows in rows.chunks(block) {
            stack.take(&self.whitened(rows, &active, &slope, &mut figures)?)?;
        }
        Ok(Outcome::Fit(self.fit(&stack, &figures, rows.len())))
    }

    /// Every block of rows is factored for itself, and the small triangles together.
    fn in_blocks(&self, rows: &[usize]) -> Result<Outcome, EstimatorError> {
        if !matches!(self.data.noise, Noise::Diagonal(_)) {
            return Err(EstimatorError::CorrelatedBlocks);
        }
        let (p, q) = (self.centre.len(), self.set.n_param());
        let mut figures = Figures::default();
        let mut below = DMatrix::zeros(self.blocks.len() * (q + 1), p + 1);
        for (first, block) in (0..).step_by(q + 1).zip(self.blocks) {
            let of_block: Vec<usize> = rows.iter().copied().filter(|row| block.rows.contains(row)).collect();
            let active = self.active(&of_block);
            if !active[0] {
                return Ok(Outcome::NoCentre);
            }
            let scale = self.scale.select_rows(&block.parameters);
            let Some(slope) = self.regression(&active, &scale)? else { return Ok(Outcome::NotSpanned) };
            if of_block.is_empty() {
                continue;
            }
            let triangle = qr::triangle(self.whitened(&of_block, &active, &slope, &mut figures)?);
            for (column, &j) in block.parameters.iter().chain([&p]).enumerate() {
                below.view_mut((first, j), (triangle.nrows(), 1)).copy_from(&triangle.column(column));
            }
        }
        let mut stack = Stack::new(self.centre);
        stack.take(&below)?;
        Ok(Outcome::Fit(self.fit(&stack, &figures, rows.len())))
    }

    /// The whitened Jacobian of these rows with their whitened residual as a last column.
    fn whitened(
        &self,
        rows: &[usize],
        active: &[bool],
        slope: &DMatrix<f64>,
        figures: &mut Figures,
    ) -> Result<DMatrix<f64>, EstimatorError> {
        let r = self.set.n_particle();
        let mut reference = DVector::zeros(r + 1);
        reference[0] = 1.0;
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
        let residual = columns.column(r + 1);
        figures.misfit += residual.norm_squared();
        figures.log_det_noise += whitened.log_det_noise;
        let p = slope.ncols();
        let mut whole = (columns.columns(1, r) * slope).insert_column(p, 0.0);
        whole.column_mut(p).copy_from(&residual);
        Ok(whole)
    }

    fn fit(&self, stack: &Stack, figures: &Figures, n_used: usize) -> Linearisation {
        let constant = n_used as f64 * (2.0 * std::f64::consts::PI).ln();
        let Figures { misfit, log_det_noise } = *figures;
        let p = self.centre.len();
        Linearisation {
            centre: self.centre.clone(),
            root: stack.triangle.view((0, 0), (p, p)).into_owned(),
            along: stack.triangle.view((0, p), (p, 1)).column(0).into_owned(),
            cost: misfit + self.centre.norm_squared(),
            misfit,
            n_used,
            log_likelihood: -0.5 * (constant + log_det_noise + misfit),
        }
    }

    /// D X^T (X D X^T)^{-1}, r x p, over the points that ran, X their offsets from the centre: deviations from the
    /// centre times this is the slope. `None` when the points do not span.
    fn regression(
        &self,
        active: &[bool],
        scale: &DMatrix<f64>,
    ) -> Result<Option<DMatrix<f64>>, EstimatorError> {
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
        Ok(per_point.and_then(|d| scale.transpose().lu().solve(&d)).map(|d| d.transpose()))
    }
}

/// What is summed over the rows.
#[derive(Default)]
struct Figures {
    misfit: f64,
    log_det_noise: f64,
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
    fn take(&mut self, below: &DMatrix<f64>) -> Result<(), EstimatorError> {
        let (m, n) = below.shape();
        let mut rows = self.triangle.clone().resize_vertically(n + m, 0.0);
        rows.view_mut((n, 0), (m, n)).copy_from(below);
        self.triangle = qr::triangle(rows);
        let finite = self.triangle.iter().all(|v| v.is_finite());
        if finite { Ok(()) } else { Err(EstimatorError::NotFinite { what: "the stacked sensitivity" }) }
    }
}

impl Linearisation {
    /// How much the cost falls by a step of u, as the linear model predicts it.
    pub(crate) fn predicted_fall(&self, step: &DVector<f64>) -> f64 {
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
        let triangle = qr::triangle(rows);
        triangle.view((0, 0), (p, p)).solve_upper_triangular(&triangle.view((0, p), (p, 1)).column(0))
    }
}
