//! A model with its fit: the one without a fault, or a scenario.
//!
//! A fit works in z: every parameter in prior standard deviations from its prior mean. Fits of several models are driven together, so that
//! the fleet gets the runs that all of them need next in one batch. Next file to read: [`super::search`].

use nalgebra::{DMatrix, DVector};
use starlings_estimators::departures::innovations;
use starlings_estimators::quantiles::normal;
use starlings_estimators::scenarios::laplace_evidence;
use starlings_estimators::{BlockAngular, End, LeastSquares, Need, Scaled};
use starlings_study::Study;

use crate::error::DiagnoseError;
use crate::result::{LEVEL, ParameterFound};
use crate::runs::{Predicted, Row, Runnable, Runs};

/// Step of differences, in z.
const STEP: f64 = 1e-3;
/// Fall of χ² below which a fit has converged.
const TOLERANCE: f64 = 0.01;
/// Steps of a fit at most.
const TRIALS: usize = 60;

/// A model and its fit.
#[derive(Clone, Debug)]
pub(crate) struct Hypothesis<'a> {
    pub(crate) model: &'a Runnable,
    solver: LeastSquares,
    /// Predictions of all rows at the best point; empty before the first run.
    pub(crate) predicted: Vec<f64>,
    /// d prediction / d z over the noise, rows x parameters, at the best point.
    jacobian: DMatrix<f64>,
    /// Why the first run failed.
    pub(crate) failure: Option<String>,
    done: bool,
}

impl<'a> Hypothesis<'a> {
    /// A fit that starts at z.
    pub(crate) fn new(model: &'a Runnable, start: DVector<f64>) -> Self {
        let p = start.len();
        let prior = Scaled {
            mean: DVector::zeros(p),
            precision: DVector::from_element(p, 1.0),
            bounds: vec![[f64::NEG_INFINITY, f64::INFINITY]; p],
            growth: DVector::zeros(p),
        };
        let solver = LeastSquares::new(start, prior, TOLERANCE, TRIALS);
        let jacobian = DMatrix::zeros(0, p);
        Self { model, solver, predicted: Vec::new(), jacobian, failure: None, done: false }
    }

    /// A fit that starts at the prior mean.
    pub(crate) fn at_prior(model: &'a Runnable) -> Self {
        Self::new(model, DVector::zeros(model.study.theta.len()))
    }

    /// The best point.
    pub(crate) fn z(&self) -> &DVector<f64> {
        self.solver.best().0
    }

    /// χ² plus prior there.
    pub(crate) fn cost(&self) -> f64 {
        self.solver.cost()
    }

    /// (observed − predicted) / noise there.
    pub(crate) fn residual(&self) -> &DVector<f64> {
        self.solver.best().1
    }

    /// Mean square of what is left, in units of the noise.
    pub(crate) fn misfit(&self) -> f64 {
        self.residual().norm_squared() / self.residual().len() as f64
    }

    /// Whether it stands where it should.
    pub(crate) fn has_converged(&self) -> bool {
        match self.solver.need() {
            Need::Nothing(End::Converged) => true,
            Need::Nothing(End::Stalled) => self.solver.last_promise() < self.solver.resolution().max(1.0),
            _ => self.z().is_empty(),
        }
    }

    /// What the values say one after another that those before do not: independent and of unit variance while the model holds.
    pub(crate) fn innovations(&self) -> Vec<f64> {
        innovations(self.residual(), &self.jacobian, self.z())
    }

    /// Log of the evidence; −∞ where it has none.
    pub(crate) fn log_evidence(&self, rows: &[Row]) -> f64 {
        let noise: Vec<f64> = rows.iter().map(|row| row.noise).collect();
        let evidence = laplace_evidence(self.cost(), &self.jacobian, &noise);
        evidence.filter(|_| self.failure.is_none()).unwrap_or(f64::NEG_INFINITY)
    }

    /// Its parameters with 90 % intervals at the stated noise; `severity` is the index of that parameter.
    pub(crate) fn parameters(&self, severity: Option<usize>) -> Vec<ParameterFound> {
        let p = self.z().len();
        let information = DMatrix::identity(p, p) + self.jacobian.tr_mul(&self.jacobian);
        let spread = information.cholesky().map(|root| root.inverse().diagonal().map(f64::sqrt));
        let half = normal(0.5 + 0.5 * LEVEL);
        let study = &self.model.study;
        let found = |(j, entry): (usize, &starlings_study::ThetaEntry)| {
            let sd = spread.as_ref().map_or(f64::NAN, |sd| sd[j]);
            let at = |z: f64| entry.transform.to_physical(entry.prior_mean + entry.prior_sd * z);
            let z = self.z()[j];
            let ends = [at(z - half * sd), at(z + half * sd)];
            ParameterFound {
                name: entry.name.clone(),
                unit: study.parameters[entry.parameter].unit.clone(),
                is_severity: severity == Some(j),
                estimate: at(z),
                sd: (ends[1] - ends[0]).abs() / (2.0 * half),
                interval90: [ends[0].min(ends[1]), ends[0].max(ends[1])],
                prior_median: at(0.0),
            }
        };
        study.theta.iter().enumerate().map(found).collect()
    }

    /// The points to run for what the fit needs.
    fn points(&self) -> Vec<DVector<f64>> {
        match self.solver.need() {
            _ if self.done => Vec::new(),
            Need::Residual(z) => vec![z.clone()],
            Need::Jacobian(z) => (0..z.len()).map(|j| moved(z, j, STEP)).collect(),
            Need::Nothing(_) => Vec::new(),
        }
    }

    /// Takes their predictions.
    fn take(&mut self, runs: &mut Runs<'_>, answers: Vec<Predicted>) -> Result<(), DiagnoseError> {
        match self.solver.need().clone() {
            Need::Residual(z) => {
                let Some(answer) = answers.into_iter().next() else { return Ok(()) };
                if self.predicted.is_empty() {
                    self.failure = answer.as_ref().err().cloned();
                }
                self.solver.give_residual(answer.as_ref().ok().map(|y| runs.residual(y)));
                if let Some(predicted) = answer.ok().filter(|_| *self.solver.best().0 == z) {
                    self.predicted = predicted;
                }
                if z.is_empty() {
                    self.jacobian = DMatrix::zeros(runs.rows.len(), 0);
                    self.done = true;
                }
            }
            Need::Jacobian(z) => {
                let jacobian = self.slopes(runs, &z, answers)?;
                self.solver.give_jacobian(jacobian.clone().map(BlockAngular::from));
                self.jacobian =
                    jacobian.unwrap_or_else(|| std::mem::replace(&mut self.jacobian, DMatrix::zeros(0, 0)));
            }
            Need::Nothing(_) => {}
        }
        Ok(())
    }

    /// d prediction / d z over the noise by differences: forward, backward where the model fails there, nothing where it fails on both
    /// sides.
    fn slopes(
        &self,
        runs: &mut Runs<'_>,
        z: &DVector<f64>,
        answers: Vec<Predicted>,
    ) -> Result<Option<DMatrix<f64>>, DiagnoseError> {
        let mut jacobian = DMatrix::zeros(runs.rows.len(), z.len());
        let failed: Vec<usize> = (0..answers.len()).filter(|j| answers[*j].is_err()).collect();
        let back: Vec<_> = failed.iter().map(|j| (self.model, self.theta(&moved(z, *j, -STEP)))).collect();
        let mut back = runs.run(&back)?.into_iter();
        for (j, answer) in answers.into_iter().enumerate() {
            let (found, step) = match answer {
                Ok(found) => (Some(found), STEP),
                Err(_) => (back.next().and_then(Result::ok), -STEP),
            };
            let Some(found) = found else { return Ok(None) };
            let distance = step * z[j].abs().max(1.0);
            for (i, row) in runs.rows.iter().enumerate() {
                jacobian[(i, j)] = (found[i] - self.predicted[i]) / (distance * row.noise);
            }
        }
        Ok(Some(jacobian))
    }

    /// Transformed parameters at z.
    pub(crate) fn theta(&self, z: &DVector<f64>) -> DVector<f64> {
        theta(&self.model.study, z)
    }
}

/// Transformed parameters of a study at z.
pub(crate) fn theta(study: &Study, z: &DVector<f64>) -> DVector<f64> {
    DVector::from_iterator(
        z.len(),
        study.theta.iter().zip(z.iter()).map(|(e, z)| e.prior_mean + e.prior_sd * z),
    )
}

fn moved(z: &DVector<f64>, j: usize, step: f64) -> DVector<f64> {
    let mut moved = z.clone();
    moved[j] += step * z[j].abs().max(1.0);
    moved
}

/// Drives fits until none needs a run.
///
/// # Errors
/// When the fleet fails.
pub(crate) fn drive(runs: &mut Runs<'_>, fits: &mut [Hypothesis<'_>]) -> Result<(), DiagnoseError> {
    loop {
        let asked: Vec<Vec<DVector<f64>>> = fits.iter().map(Hypothesis::points).collect();
        let points: Vec<_> = fits
            .iter()
            .zip(&asked)
            .flat_map(|(fit, of_fit)| of_fit.iter().map(|z| (fit.model, fit.theta(z))))
            .collect();
        if points.is_empty() {
            return Ok(());
        }
        let mut answers = runs.run(&points)?.into_iter();
        for (fit, of_fit) in fits.iter_mut().zip(asked) {
            let of_fit: Vec<Predicted> = answers.by_ref().take(of_fit.len()).collect();
            if !of_fit.is_empty() {
                fit.take(runs, of_fit)?;
            }
        }
    }
}
