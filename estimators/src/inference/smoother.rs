//! The states behind a recording with measurement noise: extended Kalman filter forwards, Rauch, Tung and Striebel backwards.
//!
//! y_n = x_n + M^{1/2} η_n and ẋ = C φ(x, t) + D^{1/2} ξ: between rows the mean follows the classical rule of fourth order and its slopes
//! the linearised equation; the noise of a step is h (D + J D Jᵀ)/2, the trapezoid of what the flow makes of it. Inputs are known and
//! linear between rows. All rows are held in memory. (Rauch, Tung & Striebel, AIAA J. 1965; Jazwinski 1970, section 8.3.)
//! Read next: `em.rs`, which finds C, D and M by it.

use nalgebra::{DMatrix, DVector};

use super::{Basis, InferenceError};

/// Drift and noise, all known here.
pub(crate) struct System<'a> {
    pub(crate) basis: &'a Basis,
    /// C, L x B.
    pub(crate) drift: &'a DMatrix<f64>,
    /// D, L x L.
    pub(crate) diffusion: &'a DMatrix<f64>,
    /// M, L x L.
    pub(crate) measured: &'a DMatrix<f64>,
    pub(crate) step: f64,
}

/// What one row says of a state, given all rows.
pub(crate) struct Smoothed {
    /// Mean and covariance.
    pub(crate) mean: DVector<f64>,
    pub(crate) covariance: DMatrix<f64>,
    /// x_n = mean + gain (x_{n+1} − its mean) + an independent part of this covariance; zero for the last row.
    pub(crate) gain: DMatrix<f64>,
    pub(crate) rest: DMatrix<f64>,
}

/// A row on the way forwards.
struct Filtered {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Before the row was seen.
    predicted: DVector<f64>,
    spread: DMatrix<f64>,
    /// Slope of the state here by the state one row before.
    flow: DMatrix<f64>,
}

impl System<'_> {
    /// Smoothed states and the log-likelihood of the rows, given as times and samples row after row.
    pub(crate) fn smooth(&self, times: &[f64], rows: &[f64]) -> Result<(Vec<Smoothed>, f64), InferenceError> {
        let (filtered, log_likelihood) = self.forwards(times, rows)?;
        let n = self.basis.n_state();
        let mut smoothed: Vec<Smoothed> = Vec::with_capacity(filtered.len());
        for (k, now) in filtered.iter().enumerate().rev() {
            let Some((later, next)) = smoothed.last().zip(filtered.get(k + 1)) else {
                let (gain, rest) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
                let (mean, covariance) = (now.mean.clone(), now.covariance.clone());
                smoothed.push(Smoothed { mean, covariance, gain, rest });
                continue;
            };
            let root = next.spread.clone().cholesky().ok_or(LOST)?;
            let gain = root.solve(&(&next.flow * &now.covariance)).transpose();
            let mean = &now.mean + &gain * (&later.mean - &next.predicted);
            let rest = &now.covariance - &gain * &next.spread * gain.transpose();
            let rest = (&rest + rest.transpose()) * 0.5;
            let covariance = &rest + &gain * &later.covariance * gain.transpose();
            smoothed.push(Smoothed { mean, covariance, gain, rest });
        }
        smoothed.reverse();
        Ok((smoothed, log_likelihood))
    }

    fn forwards(&self, times: &[f64], rows: &[f64]) -> Result<(Vec<Filtered>, f64), InferenceError> {
        let (n, width) = (self.basis.n_state(), self.basis.n_channel());
        let mut out: Vec<Filtered> = Vec::with_capacity(times.len());
        let mut log_likelihood = 0.0;
        let mut flow = Flow::new(self);
        for (k, row) in rows.chunks_exact(width).enumerate() {
            let seen = DVector::from_column_slice(&row[..n]);
            let Some(before) = out.last() else {
                // Nothing is known before the first row but what it says.
                let (mean, covariance) = (seen, self.measured.clone());
                let (predicted, spread) = (mean.clone(), covariance.clone());
                out.push(Filtered { mean, covariance, predicted, spread, flow: DMatrix::identity(n, n) });
                continue;
            };
            let inputs = [&rows[(k - 1) * width + n..k * width], &row[n..]];
            let (predicted, slope) = flow.over(times[k - 1], &before.mean, inputs);
            let noise = (self.diffusion + &slope * self.diffusion * slope.transpose()) * (0.5 * self.step);
            let spread = &slope * &before.covariance * slope.transpose() + noise;
            let spread = (&spread + spread.transpose()) * 0.5;
            let innovation = seen - &predicted;
            let root = (&spread + self.measured).cholesky().ok_or(LOST)?;
            let weighted = root.solve(&innovation);
            log_likelihood -= 0.5 * innovation.dot(&weighted)
                + root.l_dirty().diagonal().map(f64::ln).sum()
                + 0.5 * n as f64 * std::f64::consts::TAU.ln();
            let mean = &predicted + &spread * weighted;
            let covariance = &spread - &spread * root.solve(&spread);
            let covariance = (&covariance + covariance.transpose()) * 0.5;
            if !mean.iter().chain(&covariance).all(|v| v.is_finite()) {
                return Err(LOST);
            }
            out.push(Filtered { mean, covariance, predicted, spread, flow: slope });
        }
        Ok((out, log_likelihood))
    }
}

const LOST: InferenceError = InferenceError::Overflow { what: "the state that follows the recording" };

/// The flow of the drift over one step, with scratch space.
struct Flow<'a> {
    system: &'a System<'a>,
    sample: Vec<f64>,
    values: DVector<f64>,
    slopes: DMatrix<f64>,
}

impl<'a> Flow<'a> {
    fn new(system: &'a System<'a>) -> Self {
        let (b, l) = (system.basis.n_function(), system.basis.n_state());
        Self {
            system,
            sample: vec![0.0; system.basis.n_channel()],
            values: DVector::zeros(b),
            slopes: DMatrix::zeros(l, b),
        }
    }

    /// The drift and its slopes by the state at a part of the step.
    fn rate(
        &mut self,
        (start, part): (f64, f64),
        x: &DVector<f64>,
        [from, to]: [&[f64]; 2],
    ) -> (DVector<f64>, DMatrix<f64>) {
        let n = x.len();
        self.sample[..n].copy_from_slice(x.as_slice());
        for ((u, from), to) in self.sample[n..].iter_mut().zip(from).zip(to) {
            *u = from + part * (to - from);
        }
        let time = start + part * self.system.step;
        self.system.basis.values(time, &self.sample, self.values.as_mut_slice());
        self.system.basis.slopes(time, &self.sample, self.slopes.as_mut_slice());
        (self.system.drift * &self.values, self.system.drift * self.slopes.transpose())
    }

    /// The state after a step and its slopes by the state before it.
    fn over(&mut self, start: f64, x: &DVector<f64>, inputs: [&[f64]; 2]) -> (DVector<f64>, DMatrix<f64>) {
        let h = self.system.step;
        let one = DMatrix::identity(x.len(), x.len());
        let (a, slope) = self.rate((start, 0.0), x, inputs);
        let da = slope;
        let (b, slope) = self.rate((start, 0.5), &(x + &a * (0.5 * h)), inputs);
        let db = slope * (&one + &da * (0.5 * h));
        let (c, slope) = self.rate((start, 0.5), &(x + &b * (0.5 * h)), inputs);
        let dc = slope * (&one + &db * (0.5 * h));
        let (d, slope) = self.rate((start, 1.0), &(x + &c * h), inputs);
        let dd = slope * (&one + &dc * h);
        (x + (a + (b + c) * 2.0 + d) * (h / 6.0), one + (da + (db + dc) * 2.0 + dd) * (h / 6.0))
    }
}
