//! Derivatives of a model's equations along directions: what forward mode asks of a model.
//!
//! Next file to read: [`crate::sensitivity`], which carries them through a run.

use crate::segment::Drive;

/// Directions that are followed at once, at most: what an expression computes of the values themselves serves all of them.
pub const LANES: usize = 8;

/// A direction of differentiation; a slice that is too short counts as zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct Direction<'a> {
    /// Along time.
    pub t: f64,
    /// Along the states.
    pub x: &'a [f64],
    /// Along the parameters.
    pub theta: &'a [f64],
    /// Along the inputs.
    pub u: &'a [f64],
    /// Along the outputs.
    pub y: &'a [f64],
}

/// Where derivatives are taken.
#[derive(Clone, Copy)]
pub struct Point<'a> {
    /// Time.
    pub t: f64,
    /// States.
    pub x: &'a [f64],
    /// Parameters.
    pub theta: &'a [f64],
    /// Inputs.
    pub u: Drive<'a>,
}

/// Takes the value of a component, by its position, and its derivative along each of the directions.
pub type Take<'a> = dyn FnMut(usize, f64, &[f64]) + 'a;

/// The equations of a [`crate::Model`] with their derivatives along up to [`LANES`] directions, by the names of the model's methods.
pub trait Slopes {
    /// The initial state.
    fn initial(&self, theta: &[f64], along: &[Direction<'_>], take: &mut Take<'_>);

    /// The rate of the state.
    fn rhs(&self, at: Point<'_>, along: &[Direction<'_>], take: &mut Take<'_>);

    /// The outputs.
    fn output(&self, at: Point<'_>, along: &[Direction<'_>], take: &mut Take<'_>);
}
