//! Whether the noise has one size throughout, or is heteroscedastic: the sizes of residuals regressed on each state, each input and the time.
//!
//! A size is that of the difference of two neighbouring residuals, |r_n − r_{n+1}|: what the drift lacks, a change of its coefficients and
//! the step's own error are nearly the same in both and fall out (Rice 1984), and it is symmetric about zero, which the absolute value
//! needs (Glejser 1969; Machado & Santos Silva 2000). It is regressed on the first two Legendre polynomials of the rank of a state where
//! the first step starts, whatever that state's unit and distribution: N R² is χ² of two degrees of freedom for noise of one size, whatever
//! its distribution (Breusch & Pagan 1979, studentised by Koenker 1981). Read next: `robust.rs`, what intervals become where it has not.

use nalgebra::DMatrix;

use super::residuals::Residuals;
use super::{Basis, InferenceError, Pairs};

/// Pairs of steps from which N R² is χ² well enough.
const LEAST: usize = 64;
/// Ratio of the largest to the smallest noise, over the middle of a state, up to which no interval minds.
const HARMLESS: f64 = 1.1;
/// The middle of a state's ranks, which run from −1 to 1: from its 5 % to its 95 % point.
const MIDDLE: f64 = 0.9;
/// Half the ranks that are taken together where the noise is told: a tenth of the pairs.
const TOGETHER: f64 = 0.1;
/// Pairs that share the smallest or the largest value from which the noise is told there by them alone.
const TIED: usize = 16;

/// What the noise varies with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum With {
    /// A state or an input, by the number of its channel.
    Channel(usize),
    /// The course of the recordings.
    Course,
}

/// Noise of an equation that varies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Varying {
    /// The equation, from 0.
    pub equation: usize,
    /// With what most.
    pub with: With,
    /// Where it is smallest and where it is largest: values of the channel, or shares from 0 to 1 of the recordings that lie before.
    pub at: [f64; 2],
    /// Standard deviation there over that at the first, infinite where there is no noise at all at the first.
    pub ratio: f64,
    /// N R².
    pub chi_squared: f64,
    /// Probability, at most, of as much in any of the equations with noise of one size.
    pub by_chance: f64,
}

/// The equations whose noise varies by more than is harmless, each with what it varies with most, at this rate of false alarms for all
/// of them together; `drift` is C, L x B.
///
/// # Errors
/// `Incompatible` pairs of another basis.
pub fn varying(
    pairs: &Pairs,
    basis: &Basis,
    drift: &DMatrix<f64>,
    step: f64,
    false_alarm: f64,
) -> Result<Vec<Varying>, InferenceError> {
    let sizes = sizes(pairs, basis, drift, step)?;
    if pairs.n_pair() < LEAST {
        return Ok(Vec::new());
    }
    let channel = |c: usize| {
        let values: Vec<f64> = pairs.iter().map(|pair| pair.row(0)[c]).collect();
        (With::Channel(c), Ranks::new(values))
    };
    let course = Ranks::new(before(pairs));
    let all = (0..basis.n_channel()).map(channel).chain([(With::Course, course)]);
    let all: Vec<(With, Ranks)> = all.filter(|(_, ranks)| ranks.vary()).collect();
    let n_test = (all.len() * basis.n_state()) as f64;
    let most = |(equation, sizes): (usize, &Vec<f64>)| {
        let tests = all.iter().map(|(with, ranks)| (*with, ranks, ranks.curve(sizes)));
        let (with, ranks, curve) = tests.max_by(|a, b| a.2.chi_squared.total_cmp(&b.2.chi_squared))?;
        let by_chance = (n_test * (-0.5 * curve.chi_squared).exp()).min(1.0);
        let [(from, small), (to, large)] = curve.ends().map(|at| ranks.near(at, sizes));
        let differ = large > small && (from < to || to < from);
        let told = by_chance < false_alarm && curve.ratio() > HARMLESS && differ;
        let (at, ratio) = ([from, to], large / small);
        told.then_some(Varying { equation, with, at, ratio, chi_squared: curve.chi_squared, by_chance })
    };
    Ok(sizes.iter().enumerate().filter_map(most).collect())
}

/// |r_n − r_{n+1}| of every pair, equation by equation.
fn sizes(
    pairs: &Pairs,
    basis: &Basis,
    drift: &DMatrix<f64>,
    step: f64,
) -> Result<Vec<Vec<f64>>, InferenceError> {
    let mut residuals = Residuals::new(pairs, basis, drift, step)?;
    let mut sizes = vec![Vec::with_capacity(pairs.n_pair()); basis.n_state()];
    for pair in pairs.iter() {
        let first = residuals.of(&pair, 0).to_vec();
        let second = residuals.of(&pair, 1);
        for ((sizes, a), b) in sizes.iter_mut().zip(&first).zip(second) {
            sizes.push((a - b).abs());
        }
    }
    Ok(sizes)
}

/// The share of all steps that lie before the middle of each pair's.
fn before(pairs: &Pairs) -> Vec<f64> {
    let all: f64 = pairs.iter().map(|pair| pair.weight).sum();
    let mut before = 0.0;
    let one = |weight: f64| {
        before += weight;
        (before - 0.5 * weight) / all
    };
    pairs.iter().map(|pair| pair.weight).map(one).collect()
}

/// Values with their ranks from −1 to 1, the same for equal ones.
struct Ranks {
    values: Vec<f64>,
    /// The pairs in the order of their values.
    order: Vec<usize>,
    /// Rank of every pair.
    at: Vec<f64>,
}

/// Sizes as a quadratic in the rank.
struct Curve {
    /// Coefficients of the Legendre polynomials of order 0 to 2.
    of: [f64; 3],
    /// The middle, as far as there are ranks.
    middle: [f64; 2],
    chi_squared: f64,
}

impl Ranks {
    fn new(values: Vec<f64>) -> Self {
        let n = values.len();
        // Values beside their places: looking each up by its place would take most of the time.
        let mut sorted: Vec<(f64, usize)> = values.iter().copied().zip(0..).collect();
        sorted.sort_unstable_by(|(a, at), (b, other)| a.total_cmp(b).then(at.cmp(other)));
        let order: Vec<usize> = sorted.into_iter().map(|(_, at)| at).collect();
        let mut ranks = vec![0.0; n];
        let mut first = 0;
        for equal in order.chunk_by(|a, b| values[*a].total_cmp(&values[*b]).is_eq()) {
            let middle = first as f64 + 0.5 * equal.len() as f64;
            for k in equal {
                ranks[*k] = 2.0 * middle / n as f64 - 1.0;
            }
            first += equal.len();
        }
        Self { values, order, at: ranks }
    }

    /// Whether there is more than one value.
    fn vary(&self) -> bool {
        let ends = self.order.first().zip(self.order.last());
        ends.is_some_and(|(first, last)| self.values[*first] < self.values[*last])
    }

    /// Numbers of pairs that share the smallest and the largest value.
    fn tied(&self) -> [usize; 2] {
        let same = |a: usize| move |b: &&usize| self.values[a].total_cmp(&self.values[**b]).is_eq();
        let low = self.order.first().map(|k| self.order.iter().take_while(same(*k)).count());
        let high = self.order.last().map(|k| self.order.iter().rev().take_while(same(*k)).count());
        [low, high].map(|n| n.unwrap_or(0))
    }

    /// The curve of sizes, by least squares.
    fn curve(&self, sizes: &[f64]) -> Curve {
        let n = sizes.len() as f64;
        let means = self.at.iter().zip(sizes).fold([0.0; 3], |[p, q, y], (rank, size)| {
            let [of_p, of_q] = legendre(*rank);
            [p + of_p / n, q + of_q / n, y + size / n]
        });
        let [mut pp, mut pq, mut qq, mut py, mut qy, mut yy] = [0.0; 6];
        for (rank, size) in self.at.iter().zip(sizes) {
            let [p, q] = legendre(*rank);
            let (p, q, y) = (p - means[0], q - means[1], size - means[2]);
            pp += p * p;
            pq += p * q;
            qq += q * q;
            py += p * y;
            qy += q * y;
            yy += y * y;
        }
        // A channel of two values has one contrast.
        let rest = pp * qq - pq * pq;
        let (b, c) = if rest > 1e-9 * pp * qq {
            ((qq * py - pq * qy) / rest, (pp * qy - pq * py) / rest)
        } else {
            (py / pp, 0.0)
        };
        let chi_squared = if yy > 0.0 { n * (b * py + c * qy) / yy } else { 0.0 };
        let end = |k: Option<&usize>| k.map_or(0.0, |k| self.at[*k].clamp(-MIDDLE, MIDDLE));
        let middle = [end(self.order.first()), end(self.order.last())];
        Curve { of: [means[2] - b * means[0] - c * means[1], b, c], middle, chi_squared }
    }

    /// Middle value and mean size of the pairs about a rank; at an end whose value many share, of these.
    fn near(&self, rank: f64, sizes: &[f64]) -> (f64, f64) {
        let n = self.order.len();
        let at = |rank: f64| ((0.5 * (1.0 + rank) * n as f64).max(0.0) as usize).min(n);
        let [low, high] = self.tied();
        let near = if rank >= MIDDLE && high >= TIED {
            n - high..n
        } else if rank <= -MIDDLE && low >= TIED {
            0..low
        } else {
            at(rank - TOGETHER)..at(rank + TOGETHER)
        };
        let near = &self.order[near];
        let mean = near.iter().map(|k| sizes[*k]).sum::<f64>() / near.len() as f64;
        (self.values[near[near.len() / 2]], mean)
    }
}

/// The Legendre polynomials of order one and two.
fn legendre(u: f64) -> [f64; 2] {
    [u, 1.5 * u * u - 0.5]
}

impl Curve {
    fn at(&self, u: f64) -> f64 {
        let [a, b, c] = self.of;
        let [p, q] = legendre(u);
        a + b * p + c * q
    }

    /// The ranks, over the middle, where it is smallest and largest.
    fn ends(&self) -> [f64; 2] {
        let turn = -self.of[1] / (3.0 * self.of[2]);
        let [from, to] = self.middle;
        let turn = if turn > from && turn < to { turn } else { to };
        let mut ends = [from, turn, to];
        ends.sort_by(|u, v| self.at(*u).total_cmp(&self.at(*v)));
        [ends[0], ends[2]]
    }

    /// The largest over the smallest, infinite where a straight line goes below zero.
    fn ratio(&self) -> f64 {
        let [small, large] = self.ends().map(|u| self.at(u));
        if small > 0.0 { large / small } else { f64::INFINITY }
    }
}
