//! Modes that move independently of each other: q'' + 2 δ q' + ω² q = p(t), each with its own ω and load.
//!
//! Shapes and what couples modes are the business of each structure. Next file to read: [`crate::plate`].

use starlings_models_core::oscillation::driven_motion;

/// Squares of the circular frequencies of modes, and the rate δ by which all of them decay.
#[derive(Clone, Debug)]
pub(crate) struct Modes {
    /// ω² of each mode, 1/s².
    pub(crate) squares: Vec<f64>,
    /// δ, 1/s.
    pub(crate) decay: f64,
}

impl Modes {
    /// Moves amplitudes and their rates over a time `h`, under the load p0 + p1 t times the share of each mode.
    pub(crate) fn advance(&self, h: f64, share: &[f64], load: [f64; 2], q: &mut [f64], v: &mut [f64]) {
        for (i, square) in self.squares.iter().enumerate() {
            let own = load.map(|p| share[i] * p);
            [q[i], v[i]] = driven_motion(&[1.0, 2.0 * self.decay, *square], h, [q[i], v[i]], own);
        }
    }

    /// Response of every mode to a unit share of a load that is linear between samples `step` apart and starts from rest: a row
    /// per mode, a value per sample.
    pub(crate) fn responses(&self, step: f64, load: &[f64]) -> Vec<Vec<f64>> {
        self.squares.iter().map(|square| self.response(*square, step, load)).collect()
    }

    fn response(&self, square: f64, step: f64, load: &[f64]) -> Vec<f64> {
        let theta = [1.0, 2.0 * self.decay, square];
        // One step is linear in (q, v, p at its start, p at its end): what it makes of each alone.
        let part = |state, load| driven_motion(&theta, step, state, load);
        let [by_q, by_v] = [part([1.0, 0.0], [0.0; 2]), part([0.0, 1.0], [0.0; 2])];
        let by_start = part([0.0; 2], [1.0, -1.0 / step]);
        let by_end = part([0.0; 2], [0.0, 1.0 / step]);
        let (mut q, mut v) = (0.0, 0.0);
        let mut row = Vec::with_capacity(load.len());
        row.push(q);
        for ends in load.windows(2) {
            let next = |i: usize| by_q[i] * q + by_v[i] * v + by_start[i] * ends[0] + by_end[i] * ends[1];
            [q, v] = [next(0), next(1)];
            row.push(q);
        }
        row
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_response_is_that_of_steps_one_by_one() {
        let modes = Modes { squares: vec![40.0, 9e4], decay: 3.0 };
        let load: Vec<f64> = (0..50).map(|i| (f64::from(i) * 0.3).sin()).collect();
        let rows = modes.responses(0.01, &load);
        let (mut q, mut v) = ([0.0; 2], [0.0; 2]);
        for (i, ends) in load.windows(2).enumerate() {
            modes.advance(0.01, &[1.0; 2], [ends[0], (ends[1] - ends[0]) / 0.01], &mut q, &mut v);
            // Fifty steps of a few rounded products of numbers below 0.02.
            assert!((0..2).all(|k| (rows[k][i + 1] - q[k]).abs() < 1e-15), "{i}");
        }
    }

    #[test]
    fn a_constant_load_ends_in_the_static_displacement() {
        let modes = Modes { squares: vec![400.0], decay: 5.0 };
        let rows = modes.responses(0.05, &vec![2.0; 200]);
        // e^(−50) is left of the oscillation.
        assert!((rows[0][199] - 2.0 / 400.0).abs() < 1e-16);
    }
}
