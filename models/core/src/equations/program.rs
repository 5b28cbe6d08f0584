//! A compiled expression, and several that are evaluated together.
//!
//! Next file to read: [`super::tape`], the code.

use super::at::{At, Direction};
use super::dual::{Along, Dual};
use super::tape::Tape;
use super::values::Values;

/// A compiled expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    pub(super) tape: Tape,
    /// Operations as they are written, each read of a value on its own counted as one.
    pub(super) n_operation: usize,
}

impl Program {
    /// The expression's value.
    ///
    /// # Panics
    /// When a slice in `at` is shorter than the slots that the program was compiled with.
    #[inline]
    pub fn eval(&self, at: &At<'_>) -> f64 {
        let mut found = f64::NAN;
        self.tape.each(&Values(at), |_, value| found = value);
        found
    }

    /// The expression's value and its derivative along `direction`.
    ///
    /// At a kink the derivative is that of one side: `sign(0)` = 0 for `abs`, the first argument for `min` and `max`.
    ///
    /// # Panics
    /// When a slice in `at` is shorter than the slots that the program was compiled with.
    pub fn eval_dual(&self, at: &At<'_>, direction: &Direction<'_>) -> (f64, f64) {
        let mut found = (f64::NAN, f64::NAN);
        self.tape.each(&Along(at, &[*direction]), |_, Dual(value, [slope])| found = (value, slope));
        found
    }

    /// Number of operations left after constants were folded.
    pub fn n_operations(&self) -> usize {
        self.n_operation
    }
}

/// Several expressions that are evaluated together: what they share is computed once.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Programs(Tape);

impl Programs {
    /// Joins expressions, in their order.
    pub(crate) fn new<'a>(programs: impl IntoIterator<Item = &'a Program>) -> Self {
        Self(Tape::joined(programs.into_iter().map(|program| &program.tape)))
    }

    /// Number of expressions.
    pub(crate) fn len(&self) -> usize {
        self.0.n_result()
    }

    /// The value of one expression; NaN beyond them.
    pub(crate) fn one(&self, position: usize, at: &At<'_>) -> f64 {
        let mut found = f64::NAN;
        self.each(at, |i, value| {
            if i == position {
                found = value;
            }
        });
        found
    }

    /// Hands on the value of every expression with its position.
    #[inline]
    pub(crate) fn each(&self, at: &At<'_>, take: impl FnMut(usize, f64)) {
        self.0.each(&Values(at), take);
    }

    /// Writes the values.
    #[inline]
    pub(crate) fn write(&self, at: &At<'_>, values: &mut [f64]) {
        self.each(at, |i, value| values[i] = value);
    }

    /// Hands on the value of every expression and its derivatives along directions, with its position.
    pub(crate) fn each_along<const N: usize>(
        &self,
        at: &At<'_>,
        along: &[Direction<'_>; N],
        mut take: impl FnMut(usize, f64, [f64; N]),
    ) {
        self.0.each(&Along(at, along), |i, Dual(value, slopes)| take(i, value, slopes));
    }
}
