//! The maximum likelihood of noise with a memory, for one channel in units of its noise, over all stretches of it.
//!
//! Two families of two parameters each, so that their likelihoods compare without a price: noise whose own variance is correlated
//! in part, and white noise with something correlated on top of it. A grid over both parameters, then a search of halving steps:
//! same values, same bits. Read next: `score.rs`.

use super::CorrelatedNoise;

/// Where the correlated part comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// It is part of the noise: both variances together are one.
    OfTheNoise,
    /// It lies on top of the noise: the white variance is one.
    OnTop,
}

/// Values in units of their noise, at increasing times.
#[derive(Debug, Clone)]
pub struct Series {
    /// Times, n.
    pub times: Vec<f64>,
    /// Values, n.
    pub values: Vec<f64>,
}

/// A noise with the logarithm of its density at the values to which it was fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedNoise {
    /// The noise.
    pub noise: CorrelatedNoise,
    /// Its log density.
    pub log_density: f64,
}

/// Points of the grid: logarithm of the ratio of the variances, and of the length.
const GRID: [usize; 2] = [9, 10];
/// Least logarithm of the ratio of the correlated to the white variance, and its largest where the noise is one.
const RATIO: [f64; 2] = [-5.0, 7.0];
/// Shortest length over the shortest common step: the correlation of neighbours is e⁻³ there.
const SHORTEST: f64 = 1.0 / 3.0;
/// Last step of the search, in the logarithms of both parameters.
const FINEST: f64 = 2e-3;

/// The noise of a family that makes these stretches of one channel most likely; no stretch knows of another. `None` for fewer than
/// three values in a row.
pub fn fit_noise(series: &[Series], part: Part) -> Option<FittedNoise> {
    let steps = || series.iter().flat_map(|s| s.times.windows(2).map(|w| w[1] - w[0]));
    let mut sorted: Vec<f64> = steps().filter(|d| *d > 0.0).collect();
    if !series.iter().any(|s| s.times.len() > 2) || sorted.is_empty() {
        return None;
    }
    sorted.sort_by(f64::total_cmp);
    let step = sorted[sorted.len() / 2];
    let span = series.iter().filter_map(|s| Some(s.times.last()? - s.times.first()?)).fold(step, f64::max);
    let length = [(SHORTEST * step).ln(), span.ln()];
    let (n, square) =
        series.iter().flat_map(|s| &s.values).fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v * v));
    let most = match part {
        Part::OfTheNoise => RATIO[1],
        // Ten times what there is.
        Part::OnTop => RATIO[1].max((10.0 * square / f64::max(n, 1.0)).ln()),
    };
    let bounds = [[RATIO[0], most], length];
    let of = |at: [f64; 2]| {
        let (ratio, length) = (at[0].exp(), at[1].exp());
        let (white, correlated) = match part {
            Part::OfTheNoise => (1.0 / (1.0 + ratio), ratio / (1.0 + ratio)),
            Part::OnTop => (1.0, ratio),
        };
        let noise = CorrelatedNoise { white, correlated, length };
        let log_density = series.iter().map(|s| noise.log_density(&s.times, &s.values)).sum();
        FittedNoise { noise, log_density }
    };
    let best = climbed(bounds, &of);
    best.log_density.is_finite().then_some(best)
}

/// The best point of the grid, and where halving steps from it end.
fn climbed(bounds: [[f64; 2]; 2], of: &dyn Fn([f64; 2]) -> FittedNoise) -> FittedNoise {
    let width = |k: usize| (bounds[k][1] - bounds[k][0]) / (GRID[k] - 1) as f64;
    let mut at = [bounds[0][0], bounds[1][0]];
    let mut best = of(at);
    let better = |a: &FittedNoise, b: &FittedNoise| a.log_density > b.log_density || b.log_density.is_nan();
    for i in 0..GRID[0] {
        for j in 0..GRID[1] {
            let point = [bounds[0][0] + i as f64 * width(0), bounds[1][0] + j as f64 * width(1)];
            let found = of(point);
            if better(&found, &best) {
                (at, best) = (point, found);
            }
        }
    }
    let mut step = [0.5 * width(0), 0.5 * width(1)];
    while step[0].max(step[1]) > FINEST {
        let mut moved = false;
        for (k, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)] {
            let mut point = at;
            point[k] = (point[k] + sign * step[k]).clamp(bounds[k][0], bounds[k][1]);
            let found = of(point);
            if better(&found, &best) {
                (at, best, moved) = (point, found, true);
            }
        }
        if !moved {
            step = [0.5 * step[0], 0.5 * step[1]];
        }
    }
    best
}
