//! A model variant with its least-squares fit: the best point, its predictions and Jacobian, and the state of the solver.
//!
//! Nothing is run here. Next files to read: `least_squares.rs` of the estimators, then [`super::drive`].

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use starlings_estimators::{End, EstimatorError, LeastSquares, Need, Optimum};
use starlings_models::SetupError;
use starlings_study::Study;

use super::jacobian::SplitJacobian;
use super::model_variant::ModelVariant;
use crate::rows::Rows;
use crate::run_cache::Point;

/// Fall of χ² below which a fit has converged, where the size of χ² resolves it.
const TOLERANCE: f64 = 0.02;
/// The same for a tentative fit.
const ROUGH: f64 = 0.3;
/// Steps of a fit at most.
const TRIALS: usize = 120;

/// A variant and its fit.
#[derive(Clone, Debug)]
pub struct FittedVariant<'c> {
    /// The variant.
    pub(crate) variant: ModelVariant<'c>,
    pub(crate) solver: LeastSquares,
    /// Predictions of all rows at the best point.
    pub predicted: Arc<Vec<f64>>,
    /// d prediction / d z over the noise at the best point, all rows × parameters, from the last measured Jacobian. The rows of a
    /// held-out record depend on the values of all fitted records, because it is run with their mean.
    pub(crate) jacobian: SplitJacobian,
    /// d prediction over the noise for one standard deviation of each value that a held-out record has of its own, all rows ×
    /// values that a record has; without columns until it was measured. Column k of one record and of another stand for
    /// different values.
    pub own_values: DMatrix<f64>,
}

impl<'c> FittedVariant<'c> {
    /// A fit of the model as the study has it, from the prior mean.
    ///
    /// # Errors
    /// When the model does not build.
    pub fn of_study(study: &'c Study) -> Result<Self, SetupError> {
        let variant = ModelVariant::new(study, Vec::new(), &[])?;
        let start = DVector::zeros(variant.n_param());
        Ok(Self::begin(variant, start))
    }

    /// A fit of a variant from a point that was not run.
    pub(crate) fn begin(variant: ModelVariant<'c>, start: DVector<f64>) -> Self {
        let solver = LeastSquares::new(start, variant.scaled.clone(), TOLERANCE, TRIALS);
        let (jacobian, own_values) = (SplitJacobian::default(), DMatrix::zeros(0, 0));
        Self { variant, solver, predicted: Arc::default(), jacobian, own_values }
    }

    /// A fit of a variant that adds one effect to a fitted one: at amplitude zero it is where that one is, and the effect's
    /// sensitivity (all rows, per unit of z) completes the Jacobian. Parameters inside the new term stay until a Jacobian is
    /// measured.
    pub(crate) fn from_parent(
        variant: ModelVariant<'c>,
        parent: &FittedVariant<'_>,
        point: &[f64],
        sensitivity: &DVector<f64>,
        rows: &Rows,
    ) -> Self {
        let z = variant.continue_from(&parent.variant, parent.z(), point);
        let source = |j: usize| {
            let name = &variant.study.theta[j].name;
            let i = parent.variant.study.theta.iter().position(|entry| entry.name == *name)?;
            Some((i, variant.unit()[j] / parent.variant.unit()[i]))
        };
        let sources: Vec<Option<(usize, f64)>> = (0..variant.n_param()).map(source).collect();
        let mut jacobian = parent.jacobian.map_columns(variant.n_param(), |j| sources[j]);
        jacobian.set_column(variant.first_entry_of(variant.effects.len() - 1), sensitivity, rows);
        let residual = parent.residual().clone();
        let (of_train, scaled) = (jacobian.of_train.clone(), variant.scaled.clone());
        let solver = LeastSquares::from_known(z, residual, of_train, scaled, ROUGH, TRIALS);
        let (predicted, own_values) = (Arc::clone(&parent.predicted), DMatrix::zeros(0, 0));
        Self { variant, solver, predicted, jacobian, own_values }
    }

    /// Goes on from a point that was run, with the Jacobian that it has until another is measured.
    pub(crate) fn go_on_from(&mut self, z: DVector<f64>, predicted: Arc<Vec<f64>>, rows: &Rows) {
        let (residual, of_train) = (rows.train_residual(&predicted), self.jacobian.of_train.clone());
        let scaled = self.variant.scaled.clone();
        self.solver = LeastSquares::from_known(z, residual, of_train, scaled, TOLERANCE, TRIALS);
        self.predicted = predicted;
        self.polish();
    }

    /// Goes on from where it stands with the model's own parameters within so many prior standard deviations of their priors.
    pub(crate) fn hold_own(&mut self, within: f64) {
        self.variant.scaled.bounds[..self.variant.n_own].fill([-within, within]);
        let (z, residual, jacobian) = self.solver.best();
        let (z, residual, jacobian) = (z.clone(), residual.clone(), jacobian.clone());
        self.solver =
            LeastSquares::from_known(z, residual, jacobian, self.variant.scaled.clone(), ROUGH, TRIALS);
    }

    /// Asks for measured Jacobians until it has converged.
    pub(crate) fn polish(&mut self) {
        self.solver.polish(TRIALS);
    }

    /// The best point, in z.
    pub(crate) fn z(&self) -> &DVector<f64> {
        self.solver.best().0
    }

    /// The values of the parameters of an added effect, physical, the amplitude first.
    pub(crate) fn values_of(&self, effect: usize) -> Vec<f64> {
        let (first, theta) = (self.variant.first_entry_of(effect), self.theta());
        let entries = first..first + self.variant.effects[effect].candidate.def.parameters.len();
        entries.map(|j| self.variant.study.theta[j].transform.to_physical(theta[j])).collect()
    }

    /// The whitened residuals of the training rows at the best point.
    pub(crate) fn residual(&self) -> &DVector<f64> {
        self.solver.best().1
    }

    /// χ² plus prior at the best point.
    pub(crate) fn cost(&self) -> f64 {
        self.solver.cost()
    }

    /// The cost that the linear model promises at its minimum.
    pub(crate) fn promised(&self) -> f64 {
        self.solver.promised()
    }

    /// How it ended; `None` while it needs runs.
    pub(crate) fn end(&self) -> Option<End> {
        match self.solver.need() {
            Need::Nothing(end) => Some(*end),
            _ => None,
        }
    }

    /// Whether it stands where it should: converged, or so close that no step is found that lowers χ² by one.
    pub(crate) fn has_converged(&self) -> bool {
        match self.end() {
            Some(End::Converged | End::Tentative) => true,
            Some(End::Stalled) => self.solver.last_promise() < self.solver.resolution().max(1.0),
            _ => false,
        }
    }

    /// Steps that it has tried.
    pub(crate) fn trials(&self) -> usize {
        TRIALS.saturating_sub(self.solver.trials_left())
    }

    /// Whether the Jacobian was measured at the best point.
    pub(crate) fn is_fresh(&self) -> bool {
        self.solver.is_fresh()
    }

    /// The transformed parameters of the best point.
    pub(crate) fn theta(&self) -> DVector<f64> {
        self.variant.theta(self.z())
    }

    /// The Jacobian of all rows as a dense matrix, rows × parameters; without rows where none was measured.
    pub fn dense_jacobian(&self, rows: &Rows) -> DMatrix<f64> {
        self.jacobian.dense(rows)
    }

    /// The fit as the start of a score test.
    ///
    /// # Errors
    /// When data and prior leave a direction free.
    pub fn optimum(&self) -> Result<Optimum, EstimatorError> {
        let (z, residual, jacobian) = self.solver.best();
        // A flat amplitude without influence must not make the system singular.
        let precision = self.variant.scaled.precision.map(|p| p.max(1e-9));
        Optimum::in_blocks(residual, jacobian, &precision, &(&self.variant.scaled.mean - z))
    }
}

/// A point of a fitted variant, as it is run.
pub(crate) fn point<'v>(fit: &'v FittedVariant<'_>, z: &DVector<f64>) -> Point<'v> {
    Point { study: &fit.variant.study, theta: fit.variant.theta(z) }
}
