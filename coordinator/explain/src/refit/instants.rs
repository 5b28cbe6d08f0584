//! Instants of added effects, moved by sampling intervals where that fits better.
//!
//! What changes at once changes every observation when the instant passes it, so that χ² falls in steps which no derivative shows: a fit
//! that has converged may stand an observation or two beside its minimum. Next file to read: [`super::search`].

use std::sync::Arc;

use nalgebra::DVector;

use super::search::Searcher;
use crate::error::ExplainError;
use crate::fit::drive::drive;
use crate::fit::fitted_variant::{FittedVariant, point};
use crate::run_cache::{Point, RowPredictions};

/// Moves that are tried, in sampling intervals.
const MOVES: [f64; 6] = [-4.0, -2.0, -1.0, 1.0, 2.0, 4.0];
/// Moves of one fit at most.
const PASSES: usize = 6;
/// Fall of χ² for which a fit moves on.
const WORTH: f64 = 1.0;

impl<'c> Searcher<'_, '_, 'c> {
    /// Moves the instants of fits that have ended, each fit to the best of its moves, and fits again; until none falls by as much as a unit.
    pub(super) fn settle_instants(&mut self, fits: &mut [FittedVariant<'c>]) -> Result<(), ExplainError> {
        for _ in 0..PASSES {
            let asked: Vec<Vec<DVector<f64>>> = fits.iter().map(FittedVariant::moves_of_instants).collect();
            let n: usize = asked.iter().map(Vec::len).sum();
            if n == 0 {
                return Ok(());
            }
            if !self.cache.affords(n) {
                self.cut_short = true;
                return Ok(());
            }
            let points: Vec<Point<'_>> = fits
                .iter()
                .zip(&asked)
                .flat_map(|(fit, of_fit)| of_fit.iter().map(|z| point(fit, z)))
                .collect();
            let mut answers = self.cache.run(&points)?.into_iter();
            let mut any = false;
            for (fit, of_fit) in fits.iter_mut().zip(asked) {
                let found = of_fit.into_iter().zip(answers.by_ref());
                any |= self.move_to_the_best(fit, found);
            }
            if !any {
                return Ok(());
            }
            self.cut_short |= !drive(self.cache, fits)?;
        }
        Ok(())
    }

    /// Lets a fit go on from the best of these points, where that is better than where it stands.
    fn move_to_the_best(
        &self,
        fit: &mut FittedVariant<'c>,
        found: impl Iterator<Item = (DVector<f64>, RowPredictions)>,
    ) -> bool {
        let rows = &self.cache.rows;
        let cost = |(z, answer): (DVector<f64>, RowPredictions)| {
            let predicted: Arc<Vec<f64>> = answer.ok()?;
            let cost = rows.train_residual(&predicted).norm_squared() + fit.variant.scaled.cost(&z);
            cost.is_finite().then_some((cost, z, predicted))
        };
        let best = found.filter_map(cost).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, z, predicted)) = best.filter(|(cost, ..)| *cost < fit.cost() - WORTH) else {
            return false;
        };
        fit.go_on_from(z, predicted, rows);
        true
    }
}

impl FittedVariant<'_> {
    /// The best point with each of its instants moved.
    fn moves_of_instants(&self) -> Vec<DVector<f64>> {
        let theta = self.theta();
        let moved = |(j, apart): (usize, f64), by: f64| {
            let transform = &self.variant.study.theta[j].transform;
            let value = transform.to_physical(theta[j]) + by * apart;
            let mut z = self.z().clone();
            z[j] += (transform.to_transformed(value) - theta[j]) / self.variant.unit()[j];
            transform.contains(value).then_some(z)
        };
        let of = |instant| MOVES.into_iter().filter_map(move |by| moved(instant, by)).collect::<Vec<_>>();
        self.variant.instants().flat_map(of).collect()
    }
}
