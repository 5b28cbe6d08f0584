//! The noise of one pass of a fit: what weighs the equations, and what V counts with.
//!
//! Read next: `fit.rs`.

use nalgebra::DMatrix;

/// The noise of one pass, L x L.
pub(crate) struct Noise {
    /// In the form that it is held to have: its inverse weighs the equations.
    pub(crate) held: DMatrix<f64>,
    /// As the residuals have it, where V counts with that.
    pub(crate) shown: DMatrix<f64>,
}

impl Noise {
    /// As the form has it.
    pub(crate) fn of(held: DMatrix<f64>) -> Self {
        Self { shown: held.clone(), held }
    }

    /// The largest change of an entry, relative to the variances of its row and column.
    pub(crate) fn change(&self, next: &Self) -> f64 {
        change(&self.held, &next.held).max(change(&self.shown, &next.shown))
    }

    /// With these entries moved, in its form as well where that leaves them free.
    pub(crate) fn moved(&self, entries: &[(usize, usize)], by: f64, in_form: bool) -> Self {
        let move_all = |noise: &DMatrix<f64>| {
            let mut moved = noise.clone();
            for (i, j) in entries.iter().copied() {
                moved[(i, j)] += by;
                moved[(j, i)] = moved[(i, j)];
            }
            moved
        };
        let held = if in_form { move_all(&self.held) } else { self.held.clone() };
        Self { held, shown: move_all(&self.shown) }
    }
}

/// The largest change of an entry of D, relative to the variances of its row and column.
fn change(before: &DMatrix<f64>, after: &DMatrix<f64>) -> f64 {
    let n = after.nrows();
    let entries = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let relative =
        |(i, j)| (after[(i, j)] - before[(i, j)]).abs() / (after[(i, i)] * after[(j, j)]).abs().sqrt();
    entries.map(relative).fold(0.0, f64::max)
}
