//! Fits of several versions at a time: what they need next is asked of the fleet in one batch, round after round.
//!
//! A Jacobian takes one run per parameter of the study: a parameter with one value per record is moved in all records at
//! once, and each record answers to its own. Next files to read: `least_squares.rs` of the estimators, then [`super::screen`].

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use starlings_estimators::{End, EstimatorError, LeastSquares, Need, Optimum};

use super::ExplainError;
use super::differences::STEP;
use super::influences::Influences;
use super::laboratory::{Answer, Laboratory, Point};
use super::own_values::own_values;
use super::rows::Rows;
use super::version::Version;

/// Fall of χ² below which a fit has converged.
const TOLERANCE: f64 = 0.02;
/// Fall of χ² below which a tentative fit stops.
const ROUGH: f64 = 0.3;
/// Steps of a fit at most.
const TRIALS: usize = 60;

/// A version and its fit.
#[derive(Clone, Debug)]
pub struct Fitted<'c> {
    /// The version.
    pub version: Version<'c>,
    solver: LeastSquares,
    /// Predictions of all rows at the best point.
    pub predicted: Arc<Vec<f64>>,
    /// d prediction / d z over the noise at the best point, all rows × parameters, from the last measured Jacobian. The rows of a
    /// held-out record depend on the fitted records by the mean that it is run with.
    pub jacobian: Influences,
    /// d prediction over the noise for one standard deviation of each value that a held-out record has of its own, all rows ×
    /// values that a record has; without columns until it was measured. The values of one record are not those of another.
    pub own_values: DMatrix<f64>,
}

impl<'c> Fitted<'c> {
    /// A fit of a version from the prior mean.
    pub fn from_prior(version: Version<'c>) -> Self {
        let start = DVector::zeros(version.n_param());
        Self::begin(version, start)
    }

    /// A fit of a version from a point that was not run.
    pub fn begin(version: Version<'c>, start: DVector<f64>) -> Self {
        let solver = LeastSquares::new(start, version.scaled.clone(), TOLERANCE, TRIALS);
        let (jacobian, own_values) = (Influences::default(), DMatrix::zeros(0, 0));
        Self { version, solver, predicted: Arc::default(), jacobian, own_values }
    }

    /// A fit of a version that adds one effect to a fitted one: at amplitude zero it is where that one is, and the effect's
    /// sensitivity (all rows, per unit of z) completes the Jacobian. Parameters inside the new term stay until a Jacobian is
    /// measured.
    pub fn from_parent(
        version: Version<'c>,
        parent: &Fitted<'_>,
        point: &[f64],
        sensitivity: &DVector<f64>,
        rows: &Rows,
    ) -> Self {
        let z = version.continue_from(&parent.version, parent.z(), point);
        let source = |j: usize| {
            let name = &version.study.theta[j].name;
            let i = parent.version.study.theta.iter().position(|entry| entry.name == *name)?;
            Some((i, version.unit()[j] / parent.version.unit()[i]))
        };
        let sources: Vec<Option<(usize, f64)>> = (0..version.n_param()).map(source).collect();
        let mut jacobian = parent.jacobian.map_columns(version.n_param(), |j| sources[j]);
        jacobian.set_column(version.first_of(version.members.len() - 1), sensitivity, rows);
        let residual = parent.residual().clone();
        let (of_train, scaled) = (jacobian.of_train.clone(), version.scaled.clone());
        let solver = LeastSquares::from_known(z, residual, of_train, scaled, ROUGH, TRIALS);
        let (predicted, own_values) = (Arc::clone(&parent.predicted), DMatrix::zeros(0, 0));
        Self { version, solver, predicted, jacobian, own_values }
    }

    /// Measures what the values that a held-out record has of its own would change, at the best point.
    ///
    /// # Errors
    /// When the fleet or the store fails.
    pub fn measure_own_values(&mut self, laboratory: &mut Laboratory<'_>) -> Result<(), ExplainError> {
        if !self.predicted.is_empty() {
            self.own_values = own_values(laboratory, self)?;
        }
        Ok(())
    }

    /// Asks for measured Jacobians until it has converged.
    pub fn polish(&mut self) {
        self.solver.polish(TRIALS);
    }

    /// The best point, in z.
    pub fn z(&self) -> &DVector<f64> {
        self.solver.best().0
    }

    /// The whitened residuals of the training rows at the best point.
    pub fn residual(&self) -> &DVector<f64> {
        self.solver.best().1
    }

    /// χ² plus prior at the best point.
    pub fn cost(&self) -> f64 {
        self.solver.cost()
    }

    /// The cost that the linear model promises at its minimum.
    pub fn promised(&self) -> f64 {
        self.solver.promised()
    }

    /// How it ended; `None` while it needs runs.
    pub fn end(&self) -> Option<End> {
        match self.solver.need() {
            Need::Nothing(end) => Some(*end),
            _ => None,
        }
    }

    /// Whether it stands where it should: converged, or so close that no step is found that lowers χ² by one.
    pub fn has_converged(&self) -> bool {
        match self.end() {
            Some(End::Converged | End::Tentative) => true,
            Some(End::Stalled) => self.solver.last_promise() < 1.0,
            _ => false,
        }
    }

    /// Steps that it has tried.
    pub fn trials(&self) -> usize {
        TRIALS.saturating_sub(self.solver.trials_left())
    }

    /// Whether the Jacobian was measured at the best point.
    pub fn is_fresh(&self) -> bool {
        self.solver.is_fresh()
    }

    /// The transformed parameters of the best point.
    pub fn theta(&self) -> DVector<f64> {
        self.version.theta(self.z())
    }

    /// The fit as the start of a score test.
    ///
    /// # Errors
    /// When data and prior leave a direction free.
    pub fn optimum(&self) -> Result<Optimum, EstimatorError> {
        let (z, residual, jacobian) = self.solver.best();
        // A flat amplitude without influence must not make the system singular.
        let precision = self.version.scaled.precision.map(|p| p.max(1e-9));
        Optimum::in_blocks(residual, jacobian, &precision, &(&self.version.scaled.mean - z))
    }

    /// Points that answer the present need.
    fn points(&self) -> Vec<DVector<f64>> {
        match self.solver.need() {
            Need::Residual(z) => vec![z.clone()],
            Need::Jacobian(z) => self.moved(z, STEP),
            Need::Nothing(_) => Vec::new(),
        }
    }
}

/// Runs fits until none needs anything more. Returns whether the budget sufficed; a fit that it cut off stays where it is.
///
/// # Errors
/// When the fleet or the store fails.
pub fn drive(laboratory: &mut Laboratory<'_>, fits: &mut [Fitted<'_>]) -> Result<bool, ExplainError> {
    drive_rounds(laboratory, fits, usize::MAX)
}

/// As [`drive`], so many rounds at most.
///
/// # Errors
/// When the fleet or the store fails.
pub fn drive_rounds(
    laboratory: &mut Laboratory<'_>,
    fits: &mut [Fitted<'_>],
    rounds: usize,
) -> Result<bool, ExplainError> {
    for _ in 0..rounds {
        let asked: Vec<Vec<DVector<f64>>> = fits.iter().map(Fitted::points).collect();
        let n: usize = asked.iter().map(Vec::len).sum();
        if n == 0 {
            return Ok(true);
        }
        if !laboratory.affords(n) {
            return Ok(false);
        }
        let points: Vec<Point<'_>> =
            fits.iter().zip(&asked).flat_map(|(fit, of_fit)| of_fit.iter().map(|z| point(fit, z))).collect();
        let mut answers = laboratory.run(&points)?.into_iter();
        let mut afforded = true;
        for (fit, of_fit) in fits.iter_mut().zip(asked) {
            let of_fit: Vec<_> = answers.by_ref().take(of_fit.len()).collect();
            if !of_fit.is_empty() {
                afforded &= fit.take(laboratory, of_fit)?;
            }
        }
        if !afforded {
            return Ok(false);
        }
    }
    Ok(true)
}

pub(super) fn point<'v>(fit: &'v Fitted<'_>, z: &DVector<f64>) -> Point<'v> {
    Point { study: &fit.version.study, theta: fit.version.theta(z) }
}

impl Fitted<'_> {
    /// Hands the answers to the solver. Returns whether the budget sufficed for the runs that had to be made once more; if
    /// not, the fit stays where it is.
    fn take(&mut self, laboratory: &mut Laboratory<'_>, answers: Vec<Answer>) -> Result<bool, ExplainError> {
        match self.solver.need().clone() {
            Need::Residual(z) => {
                let answer = answers.into_iter().next().and_then(Result::ok);
                let residual = answer.as_ref().map(|y| train_residual(laboratory, y));
                self.solver.give_residual(residual);
                if let Some(predicted) = answer.filter(|_| *self.solver.best().0 == z) {
                    self.predicted = predicted;
                }
            }
            Need::Jacobian(z) => {
                if !laboratory.affords(answers.iter().filter(|a| a.is_err()).count()) {
                    return Ok(false);
                }
                let jacobian = self.differences(laboratory, &z, answers)?;
                let jacobian = jacobian.map(|whole| Influences::of(&whole, &laboratory.rows));
                self.solver.give_jacobian(jacobian.as_ref().map(|j| j.of_train.clone()));
                self.jacobian = jacobian.unwrap_or_else(|| std::mem::take(&mut self.jacobian));
            }
            Need::Nothing(_) => {}
        }
        Ok(true)
    }
}

/// (observed − predicted) / noise of the training rows.
pub fn train_residual(laboratory: &Laboratory<'_>, predicted: &[f64]) -> DVector<f64> {
    let whitened = laboratory.rows.whitened(predicted);
    DVector::from_iterator(laboratory.rows.train.len(), laboratory.rows.train.iter().map(|i| whitened[*i]))
}
