//! Direct state feedback, or nudging (Hoke & Anthes 1976; Moireau, Chapelle & Le Tallec 2008): each observed output pulls
//! the state that it measures.
//!
//! The continuous observer adds γ Σ (z − y) to the rate of the measured state, the sum over its channels. Over the time Δt
//! since the channel's previous value its exact solution with a held model multiplies the innovation by 1 − e^(−γΔt). Where the
//! output is h times the state, the state's error is left with the factor 1 − h(1 − e^(−γΔt)): any gain is stable for
//! 0 < h ≤ 2, and no gain for a negative h; beyond 2 it must keep γΔt < ln(h/(h − 2)). What a model says of its own outputs
//! is h = 1; a definition's `corrects` may say anything, and its output may depend on several corrected states: then the factor is
//! the matrix 1 − (1 − e^(−γΔt)) H of these states, none of whose eigenvalues may be above one in modulus. The
//! explicit form would need γ Δt < 2 already at h = 1. On noise-free data of the true model the innovation is zero and neither
//! the state nor an estimate moves with the gain. Next file to read: [`crate::simulator`].

use std::ops::AddAssign;

use nalgebra::DMatrix;

use super::measured::{Measured, measured, pull};
use super::slopes::{slopes, slopes_beside};
use super::{Correction, Kind, Observer, Wiring};
use crate::Model;
use crate::SetupError;
use crate::setup::ObserverDef;

/// Pulls measured states towards the data.
#[derive(Debug)]
pub(crate) struct Nudging {
    gain: f64,
    /// Per corrected state component: its position and the rows that measure it.
    channels: Vec<(usize, Vec<usize>)>,
    /// Per corrected state component the output components of its rows, where a definition says what is corrected; else empty.
    named: Vec<Vec<usize>>,
}

/// The most corrected components whose stability is looked at: a dense eigenvalue problem of that size.
const MOST: usize = 300;
/// γΔt beyond which a correction takes the whole innovation, to rounding.
const WHOLE: f64 = 50.0;
/// Tenths of a decade below it that are looked at where states have unequal numbers of rows; what is unstable between two of them alone is
/// not seen.
const TENTHS: i32 = 80;
/// Distances from the start, in parts of the state, at which an output may show what it corrects.
const BESIDE: [f64; 3] = [0.0, 0.1, -0.07];
/// Share of the largest eigenvalue below which one is zero: slopes are differences of outputs.
const ROUNDING: f64 = 1e-6;

/// The entry of the observer list.
pub(super) const KIND: Kind = Kind {
    kind: "nudging",
    says: "Each observed output pulls the state that it measures towards the data.",
    build: |def, wiring| Ok(Box::new(Nudging::new(def, wiring)?)),
};

impl Nudging {
    /// Finds the state of every observed output: the definition's `corrects` first, then the model's own `measures`.
    ///
    /// # Errors
    /// When a name in `corrects` is unknown, the sizes of output and state differ, or no channel corrects a state.
    pub(crate) fn new(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Self, SetupError> {
        let mut channels: Vec<(usize, Vec<usize>)> = Vec::new();
        let mut named: Vec<Vec<usize>> = Vec::new();
        for Measured { row, output, state } in measured(def, &wiring)? {
            if let Some(at) = channels.iter().position(|(at, _)| *at == state) {
                channels[at].1.push(row);
                named[at].push(output);
            } else {
                channels.push((state, vec![row]));
                named.push(vec![output]);
            }
        }
        if def.corrects.is_empty() {
            named.clear();
        }
        if channels.is_empty() {
            return Err(SetupError::Invalid(format!(
                "the observer `nudging` corrects nothing: no observed output of `{}` measures a state; \
                 say which in `corrects`, as output = state",
                wiring.spec.kind
            )));
        }
        Ok(Self { gain: def.gain, channels, named })
    }

    /// H, a row per corrected state: the mean of its outputs by the corrected states.
    fn observation(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64> {
        let states: Vec<usize> = self.channels.iter().map(|(state, _)| *state).collect();
        let slopes = slopes(model, theta, &states);
        DMatrix::from_fn(states.len(), states.len(), |i, j| {
            let outputs = &self.named[i];
            outputs.iter().map(|output| slopes[(*output, j)]).sum::<f64>() / outputs.len() as f64
        })
    }

    /// Whether no eigenvalue of 1 − K H is above one in modulus where γΔt is `strength`: a state with n rows is pulled by k = 1 − e^(−nγΔt)
    /// of its innovation.
    fn is_stable(&self, observation: &DMatrix<f64>, strength: f64) -> bool {
        let mut pulled = observation.clone();
        for (mut row, (_, rows)) in pulled.row_iter_mut().zip(&self.channels) {
            row.scale_mut(-(-(rows.len() as f64) * strength).exp_m1());
        }
        let eigenvalues = pulled.complex_eigenvalues();
        let largest = eigenvalues.iter().map(|value| value.norm()).fold(0.0, f64::max);
        // |1 − λ| ≤ 1 for |λ|² ≤ 2 Re λ. Of zero, to rounding, are those of states that no output shows.
        let is_within = |norm: f64, re: f64| norm.powi(2) <= 2.0 * re * (1.0 + 1e-9);
        eigenvalues
            .iter()
            .all(|value| value.norm() <= ROUNDING * largest || is_within(value.norm(), value.re))
    }
}

/// The largest γΔt at which no eigenvalue of 1 − k H is above one in modulus, k = 1 − e^(−nγΔt) of states that all have n rows; `None` where
/// the whole innovation may be taken.
fn alike(observation: &DMatrix<f64>, n_row: usize) -> Option<f64> {
    let eigenvalues = observation.complex_eigenvalues();
    let largest = eigenvalues.iter().map(|value| value.norm()).fold(0.0, f64::max);
    // |1 − kλ| ≤ 1 for k ≤ 2 Re λ/|λ|². Of zero, to rounding, are those of states that no output shows.
    let shown = eigenvalues.iter().filter(|value| value.norm() > ROUNDING * largest);
    let most = shown.map(|value| (2.0 * value.re / value.norm_sqr()).max(0.0)).reduce(f64::min)?;
    (most < 1.0).then(|| -(-most).ln_1p() / n_row as f64)
}

impl Observer for Nudging {
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        for (state, rows) in &self.channels {
            if let Some((innovation, span)) = pull(&at, rows) {
                // n channels pull n times as fast, towards the mean of their innovations.
                x[*state] += -(-self.gain * span).exp_m1() * innovation;
            }
        }
    }

    fn reads(&self) -> Vec<usize> {
        self.channels.iter().flat_map(|(_, rows)| rows).copied().collect()
    }

    /// Where no eigenvalue of 1 − K H leaves the unit circle; zero where every gain drives some error away. What the model itself does
    /// with an error is not counted on.
    fn stable_up_to(&self, model: &dyn Model, theta: &[f64], dt: f64) -> Option<f64> {
        if self.named.is_empty() || self.named.len() > MOST {
            return None;
        }
        let observation = self.observation(model, theta);
        if observation.iter().any(|slope| !slope.is_finite()) {
            return None;
        }
        let rows = |channel: &(usize, Vec<usize>)| channel.1.len();
        let n_row = self.channels.first().map(rows)?;
        if self.channels.iter().all(|channel| rows(channel) == n_row) {
            return alike(&observation, n_row).map(|strength| strength / dt);
        }
        // From gains that hardly pull to those that take the whole innovation, tenth of a decade by tenth.
        let strengths: Vec<f64> =
            (0..=TENTHS).map(|k| WHOLE * 10_f64.powf(-0.1 * f64::from(TENTHS - k))).collect();
        let first = strengths.iter().position(|strength| !self.is_stable(&observation, *strength))?;
        let (mut stable, mut unstable) =
            (if first == 0 { 0.0 } else { strengths[first - 1] }, strengths[first]);
        while stable > 0.0 && unstable / stable > 1.0 + 1e-9 {
            let middle = f64::midpoint(stable, unstable);
            if self.is_stable(&observation, middle) { stable = middle } else { unstable = middle }
        }
        Some(stable / dt)
    }

    fn blind(&self, model: &dyn Model, theta: &[f64]) -> Option<(usize, usize)> {
        if self.named.len() > MOST {
            return None;
        }
        let states: Vec<usize> = self.channels.iter().map(|(state, _)| *state).collect();
        // An output may show nothing of a state at one place: a square at zero, a product with an input that is off.
        let places = BESIDE.map(|beside| slopes_beside(model, theta, &states, beside));
        let shown = |output: usize, j: usize| places.iter().any(|slopes| slopes[(output, j)] != 0.0);
        let pairs =
            self.named.iter().enumerate().flat_map(|(j, outputs)| outputs.iter().map(move |o| (*o, j)));
        pairs.into_iter().find(|(output, j)| !shown(*output, *j)).map(|(output, j)| (output, states[j]))
    }

    fn feedback(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        let mut feedback = DMatrix::zeros(n, n);
        if self.named.is_empty() {
            for (state, rows) in &self.channels {
                feedback[(*state, *state)] = rows.len() as f64 * self.gain;
            }
            return feedback;
        }
        let all: Vec<usize> = (0..n).collect();
        let slopes = slopes(model, theta, &all);
        for ((state, _), outputs) in self.channels.iter().zip(&self.named) {
            for output in outputs {
                feedback.row_mut(*state).add_assign(slopes.row(*output) * self.gain);
            }
        }
        feedback
    }
}

#[cfg(test)]
mod tests;
