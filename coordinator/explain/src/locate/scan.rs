//! Where along one signal the residuals change: a scan over intervals of its values.
//!
//! Every interval is compared with its outside by a log-likelihood ratio under Gaussian residuals (a scan statistic after
//! Kulldorff, Communications in Statistics 26, 1997, with one of three alternatives: a larger variance inside, another mean
//! inside, a mean that grows linearly from the interval's edge as behind a threshold). A variance below
//! the expected one counts as the expected one, so that noise makes no cut. Next file to read: [`super::region`].

/// Quantiles of the signal, and as many even steps of its range, at which cuts are tried first.
const CUTS: usize = 28;
/// Least gain by which an interval with two ends must exceed one with one end.
const SECOND_END: f64 = 3.0;

/// An interval of a signal's values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SearchResult {
    /// Log-likelihood ratio against no interval.
    pub(super) gain: f64,
    /// Lower end; −∞ when open.
    pub(super) from: f64,
    /// Upper end; +∞ when open.
    pub(super) to: f64,
}

/// Standardised residuals along a sorted signal, as sums from the left.
struct Sorted {
    x: Vec<f64>,
    /// Sums of 1-based prefixes: e, e², x, x², e x.
    e: Vec<f64>,
    ee: Vec<f64>,
    x1: Vec<f64>,
    xx: Vec<f64>,
    ex: Vec<f64>,
    /// Values and sum of squares of all residuals, those outside the signal included.
    n: f64,
    total: f64,
    /// Values that either side of a cut must keep.
    least: usize,
}

/// The interval of `x` with the largest gain; `e` are residuals over their expected sd, of which `open` take part. `None`
/// when the signal does not vary or there are too few values.
pub(super) fn scan(x: &[f64], e: &[f64], open: &[bool]) -> Option<SearchResult> {
    let sorted = Sorted::new(x, e, open)?;
    let cuts = sorted.cuts();
    let mut best: Option<(f64, usize, usize)> = None;
    for (a, &i) in cuts.iter().enumerate() {
        for &j in &cuts[a + 1..] {
            take(&sorted, i, j, &mut best);
        }
    }
    let (_, i, j) = best?;
    let near = |at: usize| {
        let k = cuts.binary_search(&at).unwrap_or(0);
        if at == 0 || at == sorted.x.len() { at..at + 1 } else { cuts[k - 1] + 1..cuts[k + 1] }
    };
    for i in near(i) {
        take(&sorted, i, j, &mut best);
    }
    let i = best.map_or(i, |(_, i, _)| i);
    for j in near(j) {
        take(&sorted, i, j, &mut best);
    }
    let (gain, i, j) = best?;
    let at = |k: usize| 0.5 * (sorted.x[k - 1] + sorted.x[k]);
    Some(SearchResult {
        gain,
        from: if i == 0 { f64::NEG_INFINITY } else { at(i) },
        to: if j == sorted.x.len() { f64::INFINITY } else { at(j) },
    })
}

fn take(sorted: &Sorted, i: usize, j: usize, best: &mut Option<(f64, usize, usize)>) {
    if i < j
        && let Some(gain) = sorted.gain(i, j)
        && best.is_none_or(|(most, _, _)| gain > most)
    {
        *best = Some((gain, i, j));
    }
}

impl Sorted {
    fn new(x: &[f64], e: &[f64], open: &[bool]) -> Option<Self> {
        let mut order: Vec<usize> = (0..x.len()).filter(|i| open[*i] && x[*i].is_finite()).collect();
        let n = open.iter().filter(|o| **o).count();
        let least = (n / 50).max(8);
        if order.len() < least {
            return None;
        }
        order.sort_by(|a, b| x[*a].total_cmp(&x[*b]));
        let (lo, hi) = (x[*order.first()?], x[*order.last()?]);
        if hi <= lo {
            return None;
        }
        let sums = |of: &dyn Fn(usize) -> f64| {
            let mut sum = 0.0;
            let mut sums = vec![0.0];
            sums.extend(order.iter().map(|i| {
                sum += of(*i);
                sum
            }));
            sums
        };
        // Scaled to [0, 1], so that the sums of squares keep their digits.
        let s = |i: usize| (x[i] - lo) / (hi - lo);
        Some(Self {
            e: sums(&|i| e[i]),
            ee: sums(&|i| e[i] * e[i]),
            x1: sums(&s),
            xx: sums(&|i| s(i) * s(i)),
            ex: sums(&|i| s(i) * e[i]),
            x: order.iter().map(|i| x[*i]).collect(),
            n: n as f64,
            total: open.iter().zip(e).filter(|(o, _)| **o).map(|(_, e)| e * e).sum(),
            least,
        })
    }

    /// Positions between different values, the ends included, increasing.
    fn cuts(&self) -> Vec<usize> {
        let n = self.x.len();
        let (lo, hi) = (self.x[0], self.x[n - 1]);
        let mut cuts: Vec<usize> = (0..=CUTS).map(|k| k * n / CUTS).collect();
        cuts.extend((1..CUTS).map(|k| {
            let at = lo + (hi - lo) * k as f64 / CUTS as f64;
            self.x.partition_point(|x| *x < at)
        }));
        cuts.push(self.x.partition_point(|x| *x < 0.0));
        for cut in &mut cuts {
            while *cut > 0 && *cut < n && self.same(*cut) {
                *cut += 1;
            }
        }
        cuts.sort_unstable();
        cuts.dedup();
        cuts
    }

    /// Whether a cut would part equal values.
    fn same(&self, cut: usize) -> bool {
        cut > 0 && cut < self.x.len() && self.x[cut] <= self.x[cut - 1]
    }

    /// Gain of the interval of positions i to j, `None` when either side is too small or nothing is worse inside.
    fn gain(&self, i: usize, j: usize) -> Option<f64> {
        let inside = (j - i) as f64;
        let outside = self.n - inside;
        let least = self.least as f64;
        if inside < least || outside < least || self.same(i) || self.same(j) {
            return None;
        }
        let s_in = self.ee[j] - self.ee[i];
        let s_out = self.total - s_in;
        if s_in * outside <= s_out * inside {
            return None;
        }
        let log = |sum: f64, n: f64| n * (sum / n).max(1.0).ln();
        let whole = log(self.total, self.n);
        let variance = 0.5 * (whole - log(s_in, inside) - log(s_out, outside));
        let mean = (self.e[j] - self.e[i]).powi(2) / inside;
        let step = 0.5 * (whole - log((self.total - mean).max(0.0), self.n));
        let hinge =
            self.hinge(i, j).map_or(0.0, |fall| 0.5 * (whole - log((self.total - fall).max(0.0), self.n)));
        let ends = usize::from(i > 0) + usize::from(j < self.x.len());
        let cost = if ends > 1 { SECOND_END } else { 0.0 };
        Some(variance.max(step).max(hinge) - cost)
    }

    /// Fall of the sum of squares by a mean that grows linearly from the interval's only end.
    fn hinge(&self, i: usize, j: usize) -> Option<f64> {
        let n = self.x.len();
        let (lo, hi) = (self.x[0], self.x[n - 1]);
        let edge = match (i > 0, j < n) {
            (true, false) => self.x[i],
            (false, true) => self.x[j - 1],
            _ => return None,
        };
        let c = (edge - lo) / (hi - lo);
        let of = |sums: &[f64]| sums[j] - sums[i];
        let cross = of(&self.ex) - c * of(&self.e);
        let square = of(&self.xx) - 2.0 * c * of(&self.x1) + c * c * (j - i) as f64;
        (square > 1e-12).then(|| cross * cross / square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn noise(n: usize, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|_| StandardNormal.sample(&mut rng)).collect()
    }

    fn scanned(shape: impl Fn(f64) -> f64) -> SearchResult {
        let x: Vec<f64> = (0..600).map(|i| ((i as f64) * 0.7).sin()).collect();
        let e: Vec<f64> = x.iter().zip(noise(600, 1)).map(|(x, e)| e + shape(*x)).collect();
        scan(&x, &e, &[true; 600]).expect("there is something to scan")
    }

    #[test]
    fn a_step_a_ramp_and_a_band_are_found_at_their_edges() {
        // 600 values over a range of 2: the edges are known to a few spacings of 1/300; 0.05 leaves room for the noise.
        let step = scanned(|x| if x > 0.3 { 4.0 } else { 0.0 });
        assert!((step.from - 0.3).abs() < 0.05 && step.to.is_infinite(), "{step:?}");
        let ramp = scanned(|x| 40.0 * (x - 0.3).max(0.0));
        assert!((ramp.from - 0.3).abs() < 0.08 && ramp.to.is_infinite(), "{ramp:?}");
        let low = scanned(|x| -40.0 * (-0.5 - x).max(0.0));
        assert!((low.to + 0.5).abs() < 0.08 && low.from.is_infinite(), "{low:?}");
        let band = scanned(|x| if (-0.4..0.2).contains(&x) { 5.0 } else { 0.0 });
        assert!((band.from + 0.4).abs() < 0.05 && (band.to - 0.2).abs() < 0.05, "{band:?}");
    }

    #[test]
    fn noise_of_the_expected_size_invites_no_cut() {
        let x: Vec<f64> = (0..600).map(f64::from).collect();
        let most = (0..20).filter_map(|seed| scan(&x, &noise(600, seed), &[true; 600])).map(|f| f.gain);
        // A gain of 12 is asked for; the largest of some 1500 intervals stays well below.
        assert!(most.fold(0.0, f64::max) < 10.0);
    }

    #[test]
    fn a_signal_without_variation_has_no_interval() {
        assert_eq!(scan(&[1.0; 100], &noise(100, 1), &[true; 100]), None);
        assert_eq!(scan(&[f64::NAN; 100], &noise(100, 1), &[true; 100]), None);
    }
}
