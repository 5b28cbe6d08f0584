//! Which gain to choose: the largest real part of the poles against the gain.
//!
//! At first every mode that the observer reaches is damped; beyond critical damping its slow pole turns back towards zero, so
//! that the largest real part has a bottom: more gain makes the observer slower. Next file to read: [`super::locus`].

use super::SpectrumError;
use super::observed::ObservedSystem;

/// Gains per decade of a scan.
const PER_DECADE: f64 = 6.0;
/// Improvements below this part of the value are rounding.
const NEGLIGIBLE: f64 = 1e-6;

/// The largest real part of the poles over a wide range of gains.
#[derive(Clone, Debug, PartialEq)]
pub struct GainCurve {
    /// Gains in ascending order, the first 0, the others equally spaced on a logarithmic scale.
    pub gain: Vec<f64>,
    /// Largest real part at each, in 1/time.
    pub max_re: Vec<f64>,
}

/// The fastest decay that an observer reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Best {
    /// The gain, in 1/time.
    pub gain: f64,
    /// The largest real part there, in 1/time.
    pub max_re: f64,
    /// What more gain does.
    pub beyond: Beyond,
}

/// What happens to the decay beyond the best gain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beyond {
    /// It becomes slower: over-damping.
    Slower,
    /// It stays as it is.
    Same,
    /// It is still faster at the end of the scan.
    Faster,
    /// No gain makes the slowest error decay faster.
    NoGain,
}

impl GainCurve {
    /// Scans from a hundredth of the slowest to a thousand times the fastest pole.
    ///
    /// # Errors
    /// As [`super::poles`].
    pub fn scan(system: &ObservedSystem) -> Result<Self, SpectrumError> {
        let moduli: Vec<f64> = system.poles(0.0)?.iter().map(|p| p.norm()).collect();
        let fastest = moduli.iter().copied().fold(0.0, f64::max);
        let fastest = if fastest > 0.0 { fastest } else { 1.0 };
        let slowest = moduli.iter().copied().filter(|m| *m > 1e-9 * fastest).fold(fastest, f64::min);
        let (lo, hi) = ((1e-2 * slowest).log10(), (1e3 * fastest).log10());
        let steps = ((hi - lo) * PER_DECADE).ceil().max(1.0);
        let on_grid = |k: usize| 10f64.powf(lo + (hi - lo) * k as f64 / steps);
        let gain: Vec<f64> = std::iter::once(0.0).chain((0..=steps as usize).map(on_grid)).collect();
        let max_re = gain.iter().map(|&gain| system.max_re(gain)).collect::<Result<_, _>>()?;
        Ok(Self { gain, max_re })
    }

    /// The best gain: the lowest point of the scan, refined by golden sections between its neighbours.
    ///
    /// # Errors
    /// As [`super::poles`].
    pub fn best(&self, system: &ObservedSystem) -> Result<Best, SpectrumError> {
        let last = self.gain.len() - 1;
        let lowest = (0..=last).min_by(|&i, &j| self.max_re[i].total_cmp(&self.max_re[j])).unwrap_or(0);
        let at = |i: usize, beyond| Best { gain: self.gain[i], max_re: self.max_re[i], beyond };
        let same = |i: usize, j: usize| {
            let scale = self.max_re[i].abs().max(1e-9 * self.gain[last]);
            (self.max_re[i] - self.max_re[j]).abs() <= NEGLIGIBLE * scale
        };
        if same(lowest, 0) {
            return Ok(at(0, Beyond::NoGain));
        }
        // Where the curve is level, the smallest gain that reaches the level is the best.
        let first = (1..=last).find(|&i| same(lowest, i)).unwrap_or(lowest);
        if first == last {
            let decade = self.max_re[last.saturating_sub(PER_DECADE as usize)];
            let levels = (self.max_re[last] - decade).abs() <= 0.01 * self.max_re[last].abs();
            return Ok(at(last, if levels { Beyond::Same } else { Beyond::Faster }));
        }
        if same(lowest, last) {
            return Ok(at(first, Beyond::Same));
        }
        let (gain, max_re) = self.golden(system, lowest)?;
        Ok(Best { gain, max_re, beyond: Beyond::Slower })
    }

    /// Golden sections on the logarithm of the gain around the grid's lowest point (Kiefer 1953).
    fn golden(&self, system: &ObservedSystem, lowest: usize) -> Result<(f64, f64), SpectrumError> {
        let ratio = 0.5 * (5_f64.sqrt() - 1.0);
        let (mut lo, mut hi) =
            (self.gain[lowest - 1].max(1e-3 * self.gain[lowest]).ln(), self.gain[lowest + 1].ln());
        let at = |log: f64| system.max_re(log.exp()).map(|value| (log, value));
        let mut left = at(hi - ratio * (hi - lo))?;
        let mut right = at(lo + ratio * (hi - lo))?;
        while hi - lo > 1e-9 {
            if left.1 < right.1 {
                hi = right.0;
                right = left;
                left = at(hi - ratio * (hi - lo))?;
            } else {
                lo = left.0;
                left = right;
                right = at(lo + ratio * (hi - lo))?;
            }
        }
        let (log, value) = if left.1 < right.1 { left } else { right };
        let grid = (self.gain[lowest], self.max_re[lowest]);
        Ok(if value < grid.1 { (log.exp(), value) } else { grid })
    }

    /// The smallest gain at which every error decays at least as `max_re` says, in 1/time; `None` when no gain does.
    ///
    /// # Errors
    /// As [`super::poles`].
    pub fn gain_for(
        &self,
        system: &ObservedSystem,
        best: Best,
        max_re: f64,
    ) -> Result<Option<f64>, SpectrumError> {
        let mut below = 0.0;
        let points = self.gain.iter().copied().zip(self.max_re.iter().copied());
        let mut points: Vec<(f64, f64)> = points.chain([(best.gain, best.max_re)]).collect();
        points.sort_by(|p, q| p.0.total_cmp(&q.0));
        for (gain, value) in points {
            if value > max_re {
                below = gain;
                continue;
            }
            let mut above = gain;
            while above - below > 1e-10 * above {
                let middle = 0.5 * (below + above);
                *(if system.max_re(middle)? <= max_re { &mut above } else { &mut below }) = middle;
            }
            return Ok(Some(above));
        }
        Ok(None)
    }
}
