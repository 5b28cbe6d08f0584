//! The minimum of a network's co-content in the unknown base pressures.
//!
//! Next file to read: [`super::laws`], whose increasing laws make it convex.

use nalgebra::DVector;

use super::circuit::Ends;
use super::laws::{At, Valued};
use super::sparse::{Edge, Pattern};

/// Most Newton steps; about ten are taken.
const MAX_STEPS: usize = 200;
/// Most trials along one Newton step.
const MAX_TRIALS: usize = 60;
/// Part of the first slope that may be left at the end of a search.
const LEFT: f64 = 0.1;
/// Step, in parts of the pressures' size, below which only rounding keeps steps from getting shorter.
const SMALL: f64 = 1e-9;

/// The network seen from the unknown base pressures: trees are its nodes.
pub(super) struct Nodal<'a> {
    pub(super) branches: Vec<Crossing<'a>>,
    /// Flow that leaves each tree whatever the pressures.
    pub(super) prescribed: Vec<f64>,
    /// Size of the pressures.
    pub(super) size: f64,
    pub(super) pattern: &'a Pattern,
}

/// A branch between two trees.
pub(super) struct Crossing<'a> {
    pub(super) ends: Ends,
    /// Drop at zero base pressures.
    pub(super) offset: f64,
    pub(super) law: Valued,
    pub(super) edge: &'a Edge,
}

impl Crossing<'_> {
    fn at(&self, base: &[f64]) -> At {
        self.law.at(self.offset + base[self.ends.from] - base[self.ends.to])
    }
}

/// First and second derivatives of the co-content in the unknown base pressures.
struct Expansion {
    /// Flow that leaves each tree.
    residual: DVector<f64>,
    /// Entries at the places of the pattern.
    matrix: Vec<f64>,
}

impl Nodal<'_> {
    /// The base pressures of all trees, that of the ground's first.
    pub(super) fn solve(&self) -> Vec<f64> {
        let n = self.prescribed.len() - 1;
        let mut base = vec![0.0; n + 1];
        if n == 0 {
            return base;
        }
        let mut last = f64::INFINITY;
        for _ in 0..MAX_STEPS {
            let mut here = self.expand(&base);
            if !self.pattern.factorise(&mut here.matrix) {
                break;
            }
            let mut step = -&here.residual;
            self.pattern.solve(&here.matrix, step.as_mut_slice());
            let length = step.amax();
            let size = base.iter().fold(self.size, |size, p| size.max(p.abs()));
            let stalled = length <= SMALL * size && length >= 0.5 * last;
            if stalled || length <= 4.0 * f64::EPSILON * size {
                return go(&base, &step, 1.0);
            }
            base = self.search(here.residual.dot(&step), &step, &base);
            last = length;
        }
        vec![f64::NAN; n + 1]
    }

    /// Goes along a Newton step towards the least co-content. Its slope along the step grows from `first` < 0; a point is
    /// good when the slope is below a tenth of that. Illinois variant of regula falsi (Dowell & Jarratt 1971), safeguarded.
    ///
    /// Where losses dominate a full Newton step may lead just as far beyond the solution, to and fro for ever.
    fn search(&self, first: f64, step: &DVector<f64>, base: &[f64]) -> Vec<f64> {
        let enough = LEFT * first.abs();
        let mut at = go(base, step, 1.0);
        let mut slope = self.slope(step, &at);
        if slope <= enough {
            return at;
        }
        let (mut ends, mut slopes) = ([0.0, 1.0], [first, slope]);
        let mut last_side = None;
        for trial in 0..MAX_TRIALS {
            let guess = if trial % 4 == 3 { 0.5 } else { slopes[0] / (slopes[0] - slopes[1]) };
            let share = ends[0] + (ends[1] - ends[0]) * guess.clamp(1e-3, 1.0 - 1e-3);
            at = go(base, step, share);
            slope = self.slope(step, &at);
            if slope.abs() <= enough {
                break;
            }
            let side = usize::from(slope > 0.0);
            (ends[side], slopes[side]) = (share, slope);
            if last_side.replace(side) == Some(side) {
                slopes[1 - side] *= 0.5;
            }
        }
        at
    }

    /// Slope of the co-content along a step.
    fn slope(&self, step: &DVector<f64>, base: &[f64]) -> f64 {
        let along = |tree: usize| if tree == 0 { 0.0 } else { step[tree - 1] };
        let prescribed: f64 = self.prescribed.iter().enumerate().map(|(tree, flow)| flow * along(tree)).sum();
        let branches = self
            .branches
            .iter()
            .map(|branch| branch.at(base).flow * (along(branch.ends.from) - along(branch.ends.to)));
        prescribed + branches.sum::<f64>()
    }

    fn expand(&self, base: &[f64]) -> Expansion {
        let mut residual = DVector::from_column_slice(&self.prescribed[1..]);
        let mut matrix = vec![0.0; self.pattern.n_place()];
        for branch in &self.branches {
            let at = branch.at(base);
            branch.edge.leave(residual.as_mut_slice(), at.flow);
            branch.edge.stamp(&mut matrix, at.conductance);
        }
        Expansion { residual, matrix }
    }
}

/// Base pressures after part of a step; the ground's stay.
fn go(base: &[f64], step: &DVector<f64>, share: f64) -> Vec<f64> {
    let moved = base[1..].iter().zip(step.iter()).map(|(base, step)| base + share * step);
    base[..1].iter().copied().chain(moved).collect()
}
