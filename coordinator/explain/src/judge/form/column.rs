//! The influences that [`super`] adds to a fit, as columns that are made orthogonal to the fitted parameters and to one another.
//!
//! They are held in memory where all of them fit there, and else computed again whenever one is needed. Next file to read:
//! [`crate::screen::influence`].

use std::borrow::Cow;

use nalgebra::DVector;
use starlings_estimators::{BlockAngular, Optimum};

use crate::error::ExplainError;
use crate::fit::fitted_variant::FittedVariant;
use crate::run_cache::RunCache;
use crate::screen::screening_result::ScreeningResult;

/// Length below which a column counts as nothing but those taken before it.
const SMALLEST: f64 = 0.05;

/// The influence of one candidate.
#[derive(Clone, Debug)]
pub(super) struct Column {
    /// The part on training rows and prior that the parameters cannot imitate, of length one.
    pub(super) own: DVector<f64>,
    /// The change of all rows that belongs to it, with the parameters adjusted.
    pub(super) all: DVector<f64>,
}

impl Column {
    /// Makes this column orthogonal to another and of length one again; zero where nothing of it remains.
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

/// The columns of all candidates.
pub(super) struct Columns<'f, 'l> {
    cache: &'f RunCache<'l>,
    jacobian: BlockAngular,
    optimum: &'f Optimum,
    screening: Vec<&'f ScreeningResult>,
    /// All columns, where they are held in memory; empty otherwise.
    held: Vec<Column>,
}

impl<'f, 'l> Columns<'f, 'l> {
    /// The columns of these screening results, without those that the parameters imitate entirely.
    ///
    /// # Errors
    /// When the store fails.
    pub(super) fn new(
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
    pub(super) fn len(&self) -> usize {
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

    /// The column that correlates most with the residuals, after it was made orthogonal to those taken before.
    ///
    /// # Errors
    /// When the store fails.
    pub(super) fn nearest(
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
