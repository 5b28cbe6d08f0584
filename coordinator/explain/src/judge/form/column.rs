//! The influences that [`crate::judge::form`] adds to a fit, as columns: what of each is its own, and what it changes everywhere.
//!
//! They are held where they are small together, else worked out again whenever one is looked at. Next file to read:
//! [`crate::screen::influence`].

use std::borrow::Cow;

use nalgebra::DVector;
use starlings_estimators::{BlockAngular, Optimum};

use crate::error::ExplainError;
use crate::fit::fitted_variant::FittedVariant;
use crate::run_cache::RunCache;
use crate::screen::screening_result::ScreeningResult;

/// Part of a column that must be its own.
const SMALLEST: f64 = 0.05;

/// One of them.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    /// What the parameters cannot imitate of the rows that train, with the prior's: of length one.
    pub(crate) own: DVector<f64>,
    /// The change of all rows that goes with it, the parameters following.
    pub(crate) all: DVector<f64>,
}

impl Column {
    /// Takes another out of this one, which is made unit again; one that is nothing but the other becomes zero.
    fn sweep(&mut self, other: &Self) {
        let shared = other.own.dot(&self.own);
        self.own -= &other.own * shared;
        self.all -= &other.all * shared;
        let size = self.own.norm();
        let scale = if size > SMALLEST { 1.0 / size } else { 0.0 };
        self.own *= scale;
        self.all *= scale;
    }
}

/// All of them.
pub(crate) struct Columns<'f, 'l> {
    cache: &'f RunCache<'l>,
    jacobian: BlockAngular,
    optimum: &'f Optimum,
    screening: Vec<&'f ScreeningResult>,
    /// The columns of all results, or none.
    held: Vec<Column>,
}

impl<'f, 'l> Columns<'f, 'l> {
    /// The columns of these results, less those that the parameters imitate altogether.
    ///
    /// # Errors
    /// When the store fails.
    pub(crate) fn new(
        cache: &'f RunCache<'l>,
        fit: &FittedVariant<'_>,
        optimum: &'f Optimum,
        screening: Vec<&'f ScreeningResult>,
    ) -> Result<Self, ExplainError> {
        let jacobian = fit.jacobian.in_blocks(&cache.rows);
        let is_held = cache.holds(2 * screening.len());
        let mut columns = Self { cache, jacobian, optimum, screening: Vec::new(), held: Vec::new() };
        for result in screening {
            if let Some(column) = columns.of(result)? {
                columns.screening.push(result);
                columns.held.extend(is_held.then_some(column));
            }
        }
        Ok(columns)
    }

    /// Their number.
    pub(crate) fn len(&self) -> usize {
        self.screening.len()
    }

    fn of(&self, result: &ScreeningResult) -> Result<Option<Column>, ExplainError> {
        let sensitivity = result.influence.sensitivity(self.cache)?;
        let of_train = sensitivity.select_rows(&self.cache.rows.train);
        let own = self.optimum.unimitated(&of_train);
        let size = own.norm();
        let all = || &*sensitivity - self.jacobian.times(&self.optimum.response(&of_train));
        Ok((size > 0.0).then(|| Column { own: own / size, all: all() / size }))
    }

    /// The column along which the residuals lie most, less those that were taken, one after the other.
    ///
    /// # Errors
    /// When the store fails.
    pub(crate) fn nearest(
        &self,
        residual: &DVector<f64>,
        taken: &[Column],
    ) -> Result<Option<Column>, ExplainError> {
        let mut nearest: Option<(f64, Column)> = None;
        for (k, result) in self.screening.iter().enumerate() {
            let mut column = match self.held.get(k) {
                Some(held) => Cow::Borrowed(held),
                None => match self.of(result)? {
                    Some(column) => Cow::Owned(column),
                    None => continue,
                },
            };
            for other in taken {
                column.to_mut().sweep(other);
            }
            let along = column.own.dot(residual).abs();
            if nearest.as_ref().is_none_or(|(most, _)| along.total_cmp(most).is_ge()) {
                nearest = Some((along, column.into_owned()));
            }
        }
        Ok(nearest.map(|(_, column)| column))
    }
}
