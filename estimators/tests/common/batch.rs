//! What the tests of the batch fit share: a model that is one closure, driven to the end of its fit.

use nalgebra::DMatrix;
use starlings_estimators::{Batch, BatchState, BatchStep, Data, Gaussian, Points, SigmaSet};

/// Predictions at one particle.
pub type Model<'a> = dyn Fn(&[f64]) -> Vec<f64> + 'a;

/// Predictions of one ensemble; a run that is not finite has failed.
pub fn ensemble(model: &Model<'_>, theta: &DMatrix<f64>, m: usize) -> (DMatrix<f64>, Vec<bool>) {
    let mut z = DMatrix::zeros(m, theta.ncols());
    let mut failed = vec![false; theta.ncols()];
    for (i, particle) in theta.column_iter().enumerate() {
        let y = model(particle.clone_owned().as_slice());
        failed[i] = y.len() != m || y.iter().any(|v| !v.is_finite());
        if !failed[i] {
            z.column_mut(i).copy_from_slice(&y);
        }
    }
    (z, failed)
}

/// Runs a fit to its end.
pub fn fit(points: Points, model: &Model<'_>, prior: &Gaussian, data: &Data<'_>) -> (BatchState, BatchStep) {
    let batch = Batch::new(SigmaSet::new(points, prior.n_param()).unwrap());
    let mut state = batch.init(prior);
    loop {
        let (z, failed) = ensemble(model, &batch.sample(&state), data.values.len());
        let (next, step) = batch.step(&state, &z, &failed, data).unwrap();
        state = next;
        if step.converged || state.iteration >= batch.max_iterations {
            return (state, step);
        }
    }
}

/// Two exponentials in log amplitudes and log rates.
pub fn compartments(theta: &[f64]) -> Vec<f64> {
    let e: Vec<f64> = theta.iter().map(|v| v.exp()).collect();
    (0..30).map(|k| f64::from(k) * 0.4).map(|t| e[0] * (-e[1] * t).exp() + e[2] * (-e[3] * t).exp()).collect()
}
