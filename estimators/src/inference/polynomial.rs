//! All monomials up to a degree in chosen channels.
//!
//! Every monomial is an earlier one times one channel, and its slopes are earlier monomials times an exponent, so a block costs
//! one product per value, and its slopes are sums of columns that are there. Read next: `basis.rs`.

use super::functions::{Columns, Functions, Samples};

/// Monomials by degree, then by channel: `1, x1, x2, x1^2, x1*x2, x2^2` for degree 2 in two channels.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    channels: Vec<usize>,
    monomials: Vec<Monomial>,
    n_state: usize,
    names: Vec<String>,
}

#[derive(Debug, Clone, PartialEq)]
struct Monomial {
    exponents: Vec<u32>,
    /// Index of the monomial that this is a multiple of, `None` for 1 where 1 is no function.
    parent: Option<usize>,
    /// Channel by which the parent is multiplied, `None` for the monomial 1.
    factor: Option<usize>,
    /// State, exponent and the monomial left by the derivative (`None`: 1).
    slopes: Vec<(usize, f64, Option<usize>)>,
}

impl Polynomial {
    /// All monomials of `degree` or less in the channels of these numbers, with the names of all channels, of which the first
    /// `n_state` are states. The constant is one of them if `constant`.
    pub fn new(names: &[&str], n_state: usize, channels: &[usize], degree: u32, constant: bool) -> Self {
        let lowest = u32::from(!constant);
        let mut exponents = Vec::new();
        for total in lowest..=degree {
            compositions(channels.len(), total, &mut vec![0; channels.len()], 0, &mut exponents);
        }
        let find = |wanted: &[u32]| exponents.iter().position(|e: &Vec<u32>| e == wanted);
        let without = |e: &[u32], k: usize| {
            let mut less = e.to_vec();
            less[k] -= 1;
            find(&less)
        };
        let monomial = |e: &Vec<u32>| {
            let last = e.iter().rposition(|n| *n > 0);
            let slope = |k: usize| (channels[k], f64::from(e[k]), without(e, k));
            let of_state = |k: &usize| e[*k] > 0 && channels[*k] < n_state;
            Monomial {
                exponents: e.clone(),
                parent: last.and_then(|k| without(e, k)),
                factor: last.map(|k| channels[k]),
                slopes: (0..e.len()).filter(of_state).map(slope).collect(),
            }
        };
        let monomials: Vec<Monomial> = exponents.iter().map(monomial).collect();
        let names = monomials.iter().map(|m| name(names, channels, &m.exponents)).collect();
        Self { channels: channels.to_vec(), monomials, n_state, names }
    }

    /// Channels it is a polynomial of.
    pub fn channels(&self) -> &[usize] {
        &self.channels
    }
}

/// All exponents of this sum, the first channels with the largest first.
fn compositions(n: usize, left: u32, so_far: &mut Vec<u32>, k: usize, out: &mut Vec<Vec<u32>>) {
    if k + 1 >= n {
        if n > 0 {
            so_far[k] = left;
        }
        if n > 0 || left == 0 {
            out.push(so_far.clone());
        }
        return;
    }
    for e in (0..=left).rev() {
        so_far[k] = e;
        compositions(n, left - e, so_far, k + 1, out);
    }
}

fn name(names: &[&str], channels: &[usize], exponents: &[u32]) -> String {
    let factor = |(channel, e): (&usize, &u32)| match e {
        0 => None,
        1 => Some(names[*channel].to_owned()),
        e => Some(format!("{}^{e}", names[*channel])),
    };
    let factors: Vec<String> = channels.iter().zip(exponents).filter_map(factor).collect();
    if factors.is_empty() { "1".into() } else { factors.join("*") }
}

impl Functions for Polynomial {
    fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    fn values(&self, _time: f64, x: &[f64], values: &mut [f64]) {
        for (b, m) in self.monomials.iter().enumerate() {
            values[b] = m.parent.map_or(1.0, |p| values[p]) * m.factor.map_or(1.0, |channel| x[channel]);
        }
    }

    fn slopes(&self, time: f64, x: &[f64], slopes: &mut [f64]) {
        let mut values = vec![0.0; self.monomials.len()];
        self.values(time, x, &mut values);
        slopes.fill(0.0);
        for (b, m) in self.monomials.iter().enumerate() {
            for (state, e, rest) in &m.slopes {
                slopes[b * self.n_state + state] = e * rest.map_or(1.0, |rest| values[rest]);
            }
        }
    }

    fn fill(&self, samples: &Samples<'_>, columns: &mut Columns<'_>) {
        for (b, m) in self.monomials.iter().enumerate() {
            match (m.parent, m.factor) {
                (_, None) => columns.column_mut(b).fill(1.0),
                (None, Some(channel)) => columns.column_mut(b).copy_from_slice(samples.channel(channel)),
                (Some(parent), Some(channel)) => {
                    let (parent, out) = columns.pair(parent, b);
                    for ((out, p), x) in out.iter_mut().zip(parent).zip(samples.channel(channel)) {
                        *out = p * x;
                    }
                }
            }
        }
    }

    fn add_slopes(&self, samples: &Samples<'_>, columns: &Columns<'_>, sums: &mut [f64]) {
        let totals: Vec<f64> = (0..self.monomials.len()).map(|b| total(columns.column(b))).collect();
        for (b, m) in self.monomials.iter().enumerate() {
            for (state, e, rest) in &m.slopes {
                sums[b * self.n_state + state] += e * rest.map_or(samples.n as f64, |rest| totals[rest]);
            }
        }
    }
}

/// The sum of a column in eight parts, which the processor adds at a time.
fn total(column: &[f64]) -> f64 {
    let mut parts = [0.0; 8];
    let (eights, rest) = column.as_chunks::<8>();
    for eight in eights {
        parts.iter_mut().zip(eight).for_each(|(part, v)| *part += v);
    }
    parts.iter().sum::<f64>() + rest.iter().sum::<f64>()
}
