//! Warnings that would differ by names and numbers alone, told as one.

use crate::identify::words::listed;
use crate::summary::Summary;
use crate::warnings::{CORRELATED, correlated};

/// One warning per set of parameters that hang together by strong correlations.
pub(super) fn correlated_sets(summary: &Summary) -> Vec<String> {
    let n = summary.correlation.len();
    // Every parameter has the number of its set: the smallest of its members.
    let mut set: Vec<usize> = (0..n).collect();
    let mut pairs = Vec::new();
    for (i, row) in summary.correlation.iter().enumerate() {
        for (j, value) in row.iter().enumerate().skip(i + 1).filter(|(_, value)| value.abs() > CORRELATED) {
            pairs.push((i, j, *value));
            let (keep, drop) = (set[i].min(set[j]), set[i].max(set[j]));
            set.iter_mut().filter(|number| **number == drop).for_each(|number| *number = keep);
        }
    }
    let name = |i: usize| summary.parameters[i].name.as_str();
    let told = |number: usize| {
        let inside: Vec<&(usize, usize, f64)> = pairs.iter().filter(|pair| set[pair.0] == number).collect();
        match inside[..] {
            [] => None,
            [(i, j, value)] => Some(correlated(name(*i), name(*j), *value)),
            _ => {
                let members: Vec<&str> = (0..n).filter(|i| set[*i] == number).map(name).collect();
                let values = inside.iter().map(|pair| pair.2);
                let (lo, hi) = values.fold((1.0_f64, -1.0_f64), |(lo, hi), v| (lo.min(v), hi.max(v)));
                Some(format!(
                    "{} are correlated ({} pairs, {lo:.3} to {hi:.3}): the data determine combinations of them, not each of them.",
                    listed(&members),
                    inside.len()
                ))
            }
        }
    };
    (0..n).filter_map(told).collect()
}
