//! An unknown input of a linear system from a recording of its outputs: a random walk, filtered forwards and smoothed backwards.
//!
//! dx/dt = A x + B u + g q, y = C x + noise, dq = σ dW. Dividing the recording by the system amplifies its noise without bound; the
//! random walk says how fast the input may change, and its intensity σ is chosen by likelihood from a list. (Kalman 1960; Rauch, Tung &
//! Striebel 1965; Van Loan 1978 for the noise of a step.) The system is known and time-invariant, samples are evenly spaced.
//! Read next: `scenarios.rs`, which asks which of several courses the input, or its trace in the outputs, followed.

mod linear_system;

use nalgebra::{DMatrix, DVector};

pub use linear_system::LinearSystem;
use linear_system::{Step, shape};

use crate::{EstimatorError, Gaussian};

/// Evenly spaced samples of the outputs and of the known inputs.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    /// Time from sample to sample.
    pub step: f64,
    /// Observed outputs, p x N; NaN where nothing was observed.
    pub observed: &'a DMatrix<f64>,
    /// Standard deviation of the noise of each output, length p.
    pub noise: &'a [f64],
    /// Known inputs, m x N, linear between samples.
    pub inputs: &'a DMatrix<f64>,
}

/// The unknown input at every sample, given all samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Recovered {
    /// The intensity σ of the random walk, in the input's unit per root of the time unit.
    pub intensity: f64,
    /// Log-likelihood of the samples with each intensity of the list.
    pub log_likelihood: Vec<f64>,
    /// Mean of the input, length N.
    pub input: Vec<f64>,
    /// Standard deviation of the input, length N.
    pub sd: Vec<f64>,
    /// Mean of the states, n x N.
    pub states: DMatrix<f64>,
}

/// A sample on the way forwards: before and after it was seen.
struct Filtered {
    predicted: DVector<f64>,
    spread: DMatrix<f64>,
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

/// The unknown input of a system, with the intensity of `intensities` that makes the samples likeliest.
///
/// `start` is what is known of the n states and the input at the first sample, before it is seen.
///
/// # Errors
/// When shapes do not go together, a sample is infinite, a noise or an intensity is not positive, or the numbers leave their range.
pub fn recover(
    system: &LinearSystem,
    samples: &Samples<'_>,
    start: &Gaussian,
    intensities: &[f64],
) -> Result<Recovered, EstimatorError> {
    check(system, samples, start, intensities)?;
    let step = system.step(samples.step)?;
    let mut log_likelihood = Vec::with_capacity(intensities.len());
    let mut best: Option<(f64, f64, Vec<Filtered>)> = None;
    for &intensity in intensities {
        let (filtered, ll) = forwards(system, samples, start, &step, intensity)?;
        log_likelihood.push(ll);
        if best.as_ref().is_none_or(|(_, most, _)| ll > *most) {
            best = Some((intensity, ll, filtered));
        }
    }
    let (intensity, _, filtered) = best.ok_or(EstimatorError::Intensity { value: f64::NAN })?;
    let smoothed = backwards(&step.transition, filtered)?;
    let n = system.n_state();
    Ok(Recovered {
        intensity,
        log_likelihood,
        input: smoothed.iter().map(|z| z.mean[n]).collect(),
        sd: smoothed.iter().map(|z| z.sd()[n]).collect(),
        states: DMatrix::from_fn(n, smoothed.len(), |i, k| smoothed[k].mean[i]),
    })
}

fn forwards(
    system: &LinearSystem,
    samples: &Samples<'_>,
    start: &Gaussian,
    step: &Step,
    intensity: f64,
) -> Result<(Vec<Filtered>, f64), EstimatorError> {
    let noise = &step.noise * (intensity * intensity);
    let mut filtered: Vec<Filtered> = Vec::with_capacity(samples.observed.ncols());
    let mut log_likelihood = 0.0;
    for k in 0..samples.observed.ncols() {
        let (predicted, spread) = match filtered.last() {
            None => (start.mean.clone(), start.covariance.clone()),
            Some(before) => {
                let spread = &step.transition * &before.covariance * step.transition.transpose() + &noise;
                (step.forward(&before.mean, samples.inputs, k), symmetric(&spread))
            }
        };
        let (mut mean, mut covariance) = (predicted.clone(), spread.clone());
        for (i, sd) in samples.noise.iter().enumerate() {
            let value = samples.observed[(i, k)];
            if !value.is_nan() {
                log_likelihood += see(system, i, value, *sd, &mut mean, &mut covariance);
            }
        }
        if !mean.iter().chain(&covariance).all(|v| v.is_finite()) {
            return Err(EstimatorError::NotFinite { what: "the state that follows the recording" });
        }
        filtered.push(Filtered { predicted, spread, mean, covariance });
    }
    Ok((filtered, log_likelihood))
}

/// Takes in one value in Joseph's form, which keeps a covariance positive; gives its log-likelihood.
fn see(
    system: &LinearSystem,
    output: usize,
    value: f64,
    sd: f64,
    mean: &mut DVector<f64>,
    covariance: &mut DMatrix<f64>,
) -> f64 {
    let n = mean.len();
    let row = system.outputs.row(output).insert_column(n - 1, 0.0);
    let cross = &*covariance * row.transpose();
    let variance = (&row * &cross)[0] + sd * sd;
    let innovation = value - (&row * &*mean)[0];
    let gain = cross / variance;
    mean.axpy(innovation, &gain, 1.0);
    let rest = DMatrix::identity(n, n) - &gain * row;
    *covariance =
        symmetric(&(&rest * &*covariance * rest.transpose() + &gain * gain.transpose() * (sd * sd)));
    -0.5 * ((std::f64::consts::TAU * variance).ln() + innovation * innovation / variance)
}

/// Mean and covariance of every sample given all samples (Rauch, Tung & Striebel 1965, eqs. 3.21 to 3.30).
fn backwards(transition: &DMatrix<f64>, filtered: Vec<Filtered>) -> Result<Vec<Gaussian>, EstimatorError> {
    let mut smoothed: Vec<Gaussian> = Vec::with_capacity(filtered.len());
    let mut later: Option<Filtered> = None;
    for now in filtered.into_iter().rev() {
        let own = match (smoothed.last(), later) {
            (Some(next), Some(Filtered { predicted, spread, .. })) => {
                let lost = EstimatorError::NotFinite { what: "the smoothed state" };
                let root = spread.clone().cholesky().ok_or(lost)?;
                let gain = root.solve(&(transition * &now.covariance)).transpose();
                let mean = &now.mean + &gain * (&next.mean - predicted);
                let narrowed = &gain * (&next.covariance - spread) * gain.transpose();
                Gaussian { mean, covariance: symmetric(&(&now.covariance + narrowed)) }
            }
            _ => Gaussian { mean: now.mean.clone(), covariance: now.covariance.clone() },
        };
        smoothed.push(own);
        later = Some(now);
    }
    smoothed.reverse();
    Ok(smoothed)
}

fn symmetric(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    0.5 * (matrix + matrix.transpose())
}

fn check(
    system: &LinearSystem,
    samples: &Samples<'_>,
    start: &Gaussian,
    intensities: &[f64],
) -> Result<(), EstimatorError> {
    let (n, p) = (system.n_state(), system.outputs.nrows());
    shape("columns of the rates", n, system.rate.ncols())?;
    shape("rows of the known inputs' matrix", n, system.known.nrows())?;
    shape("rates of the unknown input", n, system.unknown.len())?;
    shape("columns of the outputs' matrix", n, system.outputs.ncols())?;
    shape("rows of the observed outputs", p, samples.observed.nrows())?;
    shape("standard deviations of the noise", p, samples.noise.len())?;
    shape("rows of the known inputs", system.known.ncols(), samples.inputs.nrows())?;
    shape("samples of the known inputs", samples.observed.ncols(), samples.inputs.ncols())?;
    shape("states and input at the start", n + 1, start.n_param())?;
    if let Some(row) = samples.noise.iter().position(|sd| !(sd.is_finite() && *sd > 0.0)) {
        return Err(EstimatorError::NoiseNotPositive { row, value: samples.noise[row] });
    }
    if let Some(row) = samples.observed.iter().position(|v| v.is_infinite()) {
        return Err(EstimatorError::NonFiniteObservation { row, value: samples.observed[row] });
    }
    if !(samples.step.is_finite() && samples.step > 0.0) {
        return Err(EstimatorError::NotFinite {
            what: "the time from sample to sample, which must be positive,",
        });
    }
    if !samples.inputs.iter().all(|v| v.is_finite()) {
        return Err(EstimatorError::NotFinite { what: "a known input" });
    }
    match intensities.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
        Some(value) => Err(EstimatorError::Intensity { value: *value }),
        None if intensities.is_empty() => Err(EstimatorError::Intensity { value: f64::NAN }),
        None => Ok(()),
    }
}
