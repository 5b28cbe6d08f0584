//! Linear equations with the pattern of a network: one unknown per group of nodes, an entry where an element joins two.
//!
//! The order of elimination (least degree first; Markowitz 1957, Tinney & Walker 1967) and every place that fills are found once
//! per network; a factorisation runs over them without a search, and serves as many right-hand sides as wanted. It takes the
//! pivots as they come, which is safe for the matrices here: the diagonal of a conductance matrix dominates its rows. Next file
//! to read: [`super::companion`].

use std::collections::{BTreeMap, BTreeSet};

/// Places of a matrix with symmetric pattern, in the order of elimination.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    pivots: Vec<Pivot>,
    places: BTreeMap<(usize, usize), usize>,
}

/// One elimination.
#[derive(Clone, Debug)]
struct Pivot {
    unknown: usize,
    diagonal: usize,
    later: Vec<Later>,
    /// Places of the entries between two of the later unknowns, row by row.
    updates: Vec<usize>,
}

/// An unknown that is eliminated after the pivot and shares an equation with it.
#[derive(Clone, Copy, Debug)]
struct Later {
    unknown: usize,
    /// Place of the entry in its row and the pivot's column.
    lower: usize,
    /// Place of the entry in the pivot's row and its column.
    upper: usize,
}

impl Pattern {
    /// The pattern of `n` unknowns of which the pairs share an equation.
    pub(super) fn new(n: usize, pairs: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let mut near = vec![BTreeSet::new(); n];
        for (a, b) in pairs {
            if a != b {
                near[a].insert(b);
                near[b].insert(a);
            }
        }
        let mut pattern = Self { pivots: Vec::with_capacity(n), places: BTreeMap::new() };
        let mut left: BTreeSet<(usize, usize)> = (0..n).map(|i| (near[i].len(), i)).collect();
        while let Some((_, pivot)) = left.pop_first() {
            let later: Vec<usize> = std::mem::take(&mut near[pivot]).into_iter().collect();
            for i in &later {
                left.remove(&(near[*i].len(), *i));
            }
            for (k, i) in later.iter().enumerate() {
                near[*i].remove(&pivot);
                near[*i].extend(later.iter().enumerate().filter(|(l, _)| *l != k).map(|(_, j)| *j));
            }
            for i in &later {
                left.insert((near[*i].len(), *i));
            }
            pattern.eliminate(pivot, &later);
        }
        pattern
    }

    fn eliminate(&mut self, unknown: usize, later: &[usize]) {
        let diagonal = self.add(unknown, unknown);
        let joined = later.iter().map(|i| Later {
            unknown: *i,
            lower: self.add(*i, unknown),
            upper: self.add(unknown, *i),
        });
        let joined: Vec<Later> = joined.collect();
        let updates = later.iter().flat_map(|i| later.iter().map(|j| (*i, *j)));
        let updates = updates.map(|(i, j)| self.add(i, j)).collect();
        self.pivots.push(Pivot { unknown, diagonal, later: joined, updates });
    }

    fn add(&mut self, row: usize, column: usize) -> usize {
        let next = self.places.len();
        *self.places.entry((row, column)).or_insert(next)
    }

    /// Number of entries of a matrix.
    pub(super) fn n_place(&self) -> usize {
        self.places.len()
    }

    /// Place of an entry; nothing where no pair was given.
    pub(super) fn place(&self, row: usize, column: usize) -> Option<usize> {
        self.places.get(&(row, column)).copied()
    }

    /// Factorises a matrix in its place; says whether every pivot was above zero.
    pub(super) fn factorise(&self, values: &mut [f64]) -> bool {
        for pivot in &self.pivots {
            let diagonal = values[pivot.diagonal];
            if !(diagonal > 0.0 && diagonal.is_finite()) {
                return false;
            }
            let mut updates = pivot.updates.iter();
            for row in &pivot.later {
                let factor = values[row.lower] / diagonal;
                values[row.lower] = factor;
                for (column, place) in pivot.later.iter().zip(updates.by_ref()) {
                    values[*place] -= factor * values[column.upper];
                }
            }
        }
        true
    }

    /// Solves with a factorised matrix, in place of the right-hand side.
    pub(super) fn solve(&self, values: &[f64], b: &mut [f64]) {
        for pivot in &self.pivots {
            let known = b[pivot.unknown];
            for row in &pivot.later {
                b[row.unknown] -= values[row.lower] * known;
            }
        }
        for pivot in self.pivots.iter().rev() {
            let rest = pivot.later.iter().map(|column| values[column.upper] * b[column.unknown]);
            let rest: f64 = rest.sum();
            b[pivot.unknown] = (b[pivot.unknown] - rest) / values[pivot.diagonal];
        }
    }
}

/// A branch between two unknowns, or one and the ground, with the places that its conductance is added to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) from: Option<usize>,
    pub(super) to: Option<usize>,
    from_from: usize,
    to_to: usize,
    from_to: usize,
    to_from: usize,
}

impl Edge {
    /// The branch between groups of nodes, of which the ground's is 0 and group i is unknown i − 1. Its pair is in the pattern.
    pub(super) fn new(pattern: &Pattern, [from, to]: [usize; 2]) -> Self {
        let (from, to) = (from.checked_sub(1), to.checked_sub(1));
        let at = |row: Option<usize>, column: Option<usize>| {
            row.zip(column).and_then(|(i, j)| pattern.place(i, j)).unwrap_or(usize::MAX)
        };
        let (from_from, to_to) = (at(from, from), at(to, to));
        Self { from, to, from_from, to_to, from_to: at(from, to), to_from: at(to, from) }
    }

    /// Adds a conductance.
    pub(super) fn stamp(&self, values: &mut [f64], conductance: f64) {
        // Within one group what is added comes off again.
        let places = [(self.from_from, 1.0), (self.to_to, 1.0), (self.from_to, -1.0), (self.to_from, -1.0)];
        for (place, sign) in places {
            if let Some(value) = values.get_mut(place) {
                *value += sign * conductance;
            }
        }
    }

    /// Adds what leaves the first end and enters the second.
    pub(super) fn leave(&self, leaving: &mut [f64], flow: f64) {
        if let Some(from) = self.from {
            leaving[from] += flow;
        }
        if let Some(to) = self.to {
            leaving[to] -= flow;
        }
    }

    /// Difference of the unknowns at its ends.
    pub(super) fn drop(&self, unknowns: &[f64]) -> f64 {
        self.from.map_or(0.0, |i| unknowns[i]) - self.to.map_or(0.0, |j| unknowns[j])
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// A ring of `n` unknowns with chords, every row dominated by its diagonal and not symmetric.
    fn ring(n: usize) -> (Pattern, DMatrix<f64>) {
        let pairs: Vec<(usize, usize)> =
            (0..n).flat_map(|i| [(i, (i + 1) % n), (i, (7 * i + 3) % n)]).collect();
        let pattern = Pattern::new(n, pairs.iter().copied());
        let mut matrix = DMatrix::from_diagonal_element(n, n, 5.0);
        for (i, j) in pairs.into_iter().filter(|(i, j)| i != j) {
            matrix[(i, j)] = -0.3 - 0.01 * i as f64 / n as f64;
            matrix[(j, i)] = -0.7;
        }
        (pattern, matrix)
    }

    #[test]
    fn a_system_of_sparse_equations_has_the_solution_of_the_dense_one() {
        for n in [1, 2, 5, 40] {
            let (pattern, matrix) = ring(n);
            let mut values = vec![0.0; pattern.n_place()];
            for i in 0..n {
                for j in 0..n {
                    match pattern.place(i, j) {
                        Some(place) => values[place] = matrix[(i, j)],
                        None => assert!(matrix[(i, j)].abs() <= 0.0),
                    }
                }
            }
            assert!(pattern.factorise(&mut values));
            let wanted = DVector::from_fn(n, |i, _| (i as f64 * 0.7).sin());
            let mut found = (&matrix * &wanted).as_slice().to_vec();
            pattern.solve(&values, &mut found);
            // Rows are dominated by their diagonals, so that only rounding is left.
            assert!((DVector::from_vec(found) - wanted).amax() < 1e-13);
        }
    }

    #[test]
    fn a_chain_fills_no_places() {
        let n = 50;
        let pattern = Pattern::new(n, (1..n).map(|i| (i - 1, i)));
        assert_eq!(pattern.n_place(), 3 * n - 2);
    }

    #[test]
    fn a_matrix_without_a_positive_pivot_is_refused() {
        let pattern = Pattern::new(2, [(0, 1)]);
        let mut values = vec![0.0; pattern.n_place()];
        assert!(!pattern.factorise(&mut values));
    }
}
