//! The influences that [`super::form`] adds to a fit, as columns: what of each is its own, and what it changes everywhere.
//!
//! They are held where they are small together, else worked out again whenever one is looked at. Next file to read:
//! [`super::influence`].

use std::borrow::Cow;

use nalgebra::DVector;
use starlings_estimators::{BlockAngular, Optimum};

use super::ExplainError;
use super::fit::Fitted;
use super::laboratory::Laboratory;
use super::screen::Hit;

/// Part of a column that must be its own.
const SMALLEST: f64 = 0.05;

/// One of them.
#[derive(Clone, Debug)]
pub(super) struct Column {
    /// What the parameters cannot imitate of the rows that train, with the prior's: of length one.
    pub(super) own: DVector<f64>,
    /// The change of all rows that goes with it, the parameters following.
    pub(super) all: DVector<f64>,
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
pub(super) struct Columns<'f, 'l> {
    laboratory: &'f Laboratory<'l>,
    jacobian: BlockAngular,
    optimum: &'f Optimum,
    hits: Vec<&'f Hit>,
    /// The columns of all hits, or none.
    held: Vec<Column>,
}

impl<'f, 'l> Columns<'f, 'l> {
    /// The columns of these hits, less those that the parameters imitate altogether.
    ///
    /// # Errors
    /// When the store fails.
    pub(super) fn new(
        laboratory: &'f Laboratory<'l>,
        fit: &Fitted<'_>,
        optimum: &'f Optimum,
        hits: Vec<&'f Hit>,
    ) -> Result<Self, ExplainError> {
        let jacobian = fit.jacobian.in_blocks(&laboratory.rows);
        let is_held = laboratory.holds(2 * hits.len());
        let mut columns = Self { laboratory, jacobian, optimum, hits: Vec::new(), held: Vec::new() };
        for hit in hits {
            if let Some(column) = columns.of(hit)? {
                columns.hits.push(hit);
                columns.held.extend(is_held.then_some(column));
            }
        }
        Ok(columns)
    }

    /// Their number.
    pub(super) fn len(&self) -> usize {
        self.hits.len()
    }

    fn of(&self, hit: &Hit) -> Result<Option<Column>, ExplainError> {
        let sensitivity = hit.influence.sensitivity(self.laboratory)?;
        let of_train = sensitivity.select_rows(&self.laboratory.rows.train);
        let own = self.optimum.unimitated(&of_train);
        let size = own.norm();
        let all = || &*sensitivity - self.jacobian.times(&self.optimum.response(&of_train));
        Ok((size > 0.0).then(|| Column { own: own / size, all: all() / size }))
    }

    /// The column along which the residuals lie most, less those that were taken, one after the other.
    ///
    /// # Errors
    /// When the store fails.
    pub(super) fn nearest(
        &self,
        residual: &DVector<f64>,
        taken: &[Column],
    ) -> Result<Option<Column>, ExplainError> {
        let mut nearest: Option<(f64, Column)> = None;
        for (k, hit) in self.hits.iter().enumerate() {
            let mut column = match self.held.get(k) {
                Some(held) => Cow::Borrowed(held),
                None => match self.of(hit)? {
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
