//! Collinearity index (Brun, Reichert & Künsch 2001, equation 12): how well a change of one parameter can be hidden by
//! changes of others.
//!
//! For a subset K of parameters, gamma_K = 1/sqrt(lambda_min(S~_K^T S~_K)) with the columns of S~ of length one: a change
//! of length one within K changes the predictions by at least 1/gamma_K. One: orthogonal; Brun et al. call values above
//! 10 to 15 critical. Independent of noise level and prior.

use nalgebra::DMatrix;

use crate::spectral;

/// Up to so many parameters all triples are looked at.
const FEW: usize = 15;
/// No growing subset gets larger.
const LARGEST: usize = 40;

/// Parameters (from 0, ascending) and their index.
#[derive(Debug, Clone, PartialEq)]
pub struct Subset {
    /// Positions of the parameters.
    pub parameters: Vec<usize>,
    /// gamma, at least one; `None` where the columns are dependent as far as their accuracy goes.
    pub index: Option<f64>,
}

/// Near linear dependence of the sensitivities, over the parameters that change a prediction at all.
#[derive(Debug, Clone, PartialEq)]
pub struct Collinearity {
    /// All parameters together.
    pub all: Subset,
    /// Every pair, and for up to 15 parameters every triple; the worst first, pairs before triples.
    pub subsets: Vec<Subset>,
    /// A well conditioned subset of every size from 2 to 40 at most: the best pair, then one parameter more at a time, each the one
    /// that keeps the index lowest.
    pub growing: Vec<Subset>,
}

impl Collinearity {
    pub(super) fn new(scaled: &DMatrix<f64>, silent: &[usize], accuracy: f64) -> Self {
        let heard: Vec<usize> = (0..scaled.ncols()).filter(|j| !silent.contains(j)).collect();
        let columns: Vec<_> = heard.iter().map(|j| scaled.column(*j).normalize()).collect();
        let n = heard.len();
        let gram = DMatrix::from_fn(n, n, |i, j| columns[i].dot(&columns[j]));
        let of = |places: &[usize]| Subset {
            parameters: places.iter().map(|i| heard[*i]).collect(),
            index: index(&gram, places, accuracy),
        };
        let mut pairs = Vec::new();
        let mut triples = Vec::new();
        for i in 0..n {
            for j in i + 1..n {
                pairs.push(of(&[i, j]));
                if n <= FEW {
                    triples.extend((j + 1..n).map(|k| of(&[i, j, k])));
                }
            }
        }
        worst_first(&mut pairs);
        worst_first(&mut triples);
        pairs.extend(triples);
        let growing = grown(&gram, accuracy).iter().map(|places| of(places)).collect();
        Self { all: of(&(0..n).collect::<Vec<_>>()), subsets: pairs, growing }
    }
}

/// gamma of a subset; one for fewer than two columns.
fn index(gram: &DMatrix<f64>, places: &[usize], accuracy: f64) -> Option<f64> {
    if places.len() < 2 {
        return Some(1.0);
    }
    let of_subset = DMatrix::from_fn(places.len(), places.len(), |i, j| gram[(places[i], places[j])]);
    // Columns whose matrix cannot be decomposed count as dependent.
    let least = spectral::eigen(of_subset, "collinearity").ok()?.eigenvalues.min();
    // The smallest eigenvalue is known to the accuracy of the columns squared, and to rounding.
    (least > (accuracy * accuracy).max(16.0 * f64::EPSILON)).then(|| (1.0 / least.sqrt()).max(1.0))
}

fn worst_first(subsets: &mut [Subset]) {
    let size = |subset: &Subset| subset.index.unwrap_or(f64::INFINITY);
    subsets.sort_by(|a, b| size(b).total_cmp(&size(a)));
}

/// Subsets of growing size, each sorted: the best pair, then greedily.
fn grown(gram: &DMatrix<f64>, accuracy: f64) -> Vec<Vec<usize>> {
    let n = gram.ncols();
    let mut found: Vec<Vec<usize>> = Vec::new();
    let size = |places: &[usize]| index(gram, places, accuracy).unwrap_or(f64::INFINITY);
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| vec![i, j]));
    let mut best = pairs.min_by(|a, b| size(a).total_cmp(&size(b)));
    while let Some(subset) = best {
        let with = |i: usize| {
            let mut larger = subset.clone();
            larger.push(i);
            larger.sort_unstable();
            larger
        };
        best = (0..n)
            .filter(|i| subset.len() < LARGEST && !subset.contains(i))
            .map(with)
            .min_by(|a, b| size(a).total_cmp(&size(b)));
        found.push(subset);
    }
    found
}
