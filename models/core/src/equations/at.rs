//! The values that an expression is evaluated at, where each of its names finds its own, and a direction to differentiate along.
//!
//! Next file to read: [`super::expression`].

use crate::segment::Drive;
use crate::slopes::Point;

pub use crate::slopes::Direction;

/// Where a name's value is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Slot {
    /// Component of [`At::x`].
    State(usize),
    /// Component of [`At::theta`].
    Parameter(usize),
    /// Component of the inputs in [`At::u`].
    Input(usize),
    /// Component of [`At::y`].
    Output(usize),
    /// A number.
    Constant(f64),
}

/// The values at which an expression is evaluated.
#[derive(Clone, Copy)]
pub struct At<'a> {
    /// Time.
    pub t: f64,
    /// States.
    pub x: &'a [f64],
    /// Parameters.
    pub theta: &'a [f64],
    /// Inputs.
    pub u: Drive<'a>,
    /// Outputs; may be empty when no name was resolved to one.
    pub y: &'a [f64],
}

/// Rates and outputs are written out: no name in them is that of an output.
impl<'a> From<Point<'a>> for At<'a> {
    fn from(Point { t, x, theta, u }: Point<'a>) -> Self {
        Self { t, x, theta, u, y: &[] }
    }
}
