//! The part of the held-out residuals that the uncertainty of an estimate explains, to first order.
//!
//! Next file to read: [`crate::fit::own_values`] for what a held-out record adds to the uncertainty.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector};
use starlings_estimators::BlockAngular;

use crate::fit::fitted_variant::FittedVariant;
use crate::rows::Usage;
use crate::run_cache::RunCache;

/// The part of the χ² that the uncertainty of a fit explains: of the held-out span, and of the span and the channels that are never
/// fitted together.
pub(super) fn allowances(cache: &RunCache<'_>, fit: &FittedVariant<'_>) -> [f64; 2] {
    let Some(uncertainty) = Uncertainty::of(cache, fit) else { return [0.0; 2] };
    let rows = &cache.rows.rows;
    let errors = cache.rows.whitened(&fit.predicted);
    let of = |wanted: &[Usage]| {
        let at: Vec<usize> = (0..rows.len()).filter(|i| wanted.contains(&rows[*i].usage)).collect();
        if at.is_empty() { 0.0 } else { uncertainty.allowance(&at, &errors) }
    };
    [of(&[Usage::HeldOut]), of(&[Usage::HeldOut, Usage::HeldOutChannel])]
}

/// The covariance of a fit and its influence on all rows.
pub(super) struct Uncertainty<'f> {
    jacobian: BlockAngular,
    own_values: &'f DMatrix<f64>,
    covariance: DMatrix<f64>,
}

impl<'f> Uncertainty<'f> {
    /// The uncertainty of a fit. `None` where nothing is held out, where the fit leaves a direction free, or where its Jacobian
    /// is of another point.
    pub(super) fn of(cache: &RunCache<'_>, fit: &'f FittedVariant<'_>) -> Option<Self> {
        cache.rows.others().next()?;
        let optimum = fit.optimum().ok().filter(|_| fit.is_fresh())?;
        Some(Self {
            jacobian: fit.jacobian.in_blocks(&cache.rows),
            own_values: &fit.own_values,
            covariance: optimum.covariance().clone(),
        })
    }

    /// bᵀ (C⁻¹ + JᵀJ)⁻¹ b with b = Jᵀ e: the fall of χ² from these rows, increasing (Jacobian J), to a joint fit, for
    /// an estimate of covariance C and values of a held-out record's own of unit variance; `errors` e are those of all rows,
    /// whitened. χ² less this is eᵀ (1 + J C Jᵀ)⁻¹ e, the squared distance of the rows from their prediction (Mahalanobis 1936).
    /// Parameters on which the rows do not depend are left out, which does not change it.
    pub(super) fn allowance(&self, rows: &[usize], errors: &[f64]) -> f64 {
        self.fall(rows, errors).filter(|fall| fall.is_finite()).unwrap_or(0.0)
    }

    fn fall(&self, rows: &[usize], errors: &[f64]) -> Option<f64> {
        let residual = DVector::from_iterator(rows.len(), rows.iter().map(|i| errors[*i]));
        let jacobian = self.jacobian.select_rows(rows);
        let parameters = columns_of(&jacobian);
        let p = parameters.len();
        let covariance = self.covariance.select_rows(&parameters).select_columns(&parameters);
        let mut information = covariance.cholesky()?.inverse();
        let mut along = DVector::zeros(p);
        for block in jacobian.blocks() {
            let own = self.own(&rows[block.rows.clone()]);
            let (known, more, n) = (block.columns.len(), own.ncols(), information.nrows());
            let mut values = block.values.clone().resize_horizontally(known + more, 0.0);
            values.columns_mut(known, more).copy_from(&own);
            information = information.resize(n + more, n + more, 0.0);
            along.resize_vertically_mut(n + more, 0.0);
            for k in n..n + more {
                information[(k, k)] = 1.0;
            }
            let among = block.columns.iter().filter_map(|j| parameters.binary_search(j).ok());
            let places: Vec<usize> = among.chain(n..n + more).collect();
            let of_rows = values.tr_mul(&residual.rows(block.rows.start, block.rows.len()));
            let products = values.tr_mul(&values);
            for (a, &i) in places.iter().enumerate() {
                along[i] += of_rows[a];
                for (b, &j) in places.iter().enumerate() {
                    information[(i, j)] += products[(a, b)];
                }
            }
        }
        Some(along.dot(&information.cholesky()?.solve(&along)))
    }

    /// What a held-out record's own values change in some of its rows; without columns where they change nothing.
    fn own(&self, rows: &[usize]) -> DMatrix<f64> {
        if self.own_values.is_empty() {
            return DMatrix::zeros(rows.len(), 0);
        }
        let own = self.own_values.select_rows(rows);
        let felt: Vec<usize> = (0..own.ncols()).filter(|k| own.column(*k).amax() > 0.0).collect();
        own.select_columns(&felt)
    }
}

/// The columns of all blocks that have rows, increasing.
fn columns_of(of: &BlockAngular) -> Vec<usize> {
    let blocks = of.blocks().iter().filter(|block| !block.rows.is_empty());
    blocks.flat_map(|block| block.columns.iter().copied()).collect::<BTreeSet<usize>>().into_iter().collect()
}
