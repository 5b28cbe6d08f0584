//! The kinds of elements of a network, in the terms of `rcr-network`.
//!
//! Next file to read: [`super::layout`], which writes them.

use super::network::Node;

/// What an element is, with its values.
#[derive(Clone, Debug)]
pub(super) enum Kind {
    Resistance(f64),
    Loss {
        linear: f64,
        quadratic: f64,
    },
    /// `outside` is an input: the pressure around it.
    Capacitor {
        value: f64,
        outside: Option<String>,
    },
    /// Under this share of the pressure of the chamber at a node.
    Under {
        value: f64,
        around: Node,
        share: f64,
    },
    Inertance(f64),
    Chamber(Chamber),
    Valve {
        open: f64,
        closed: f64,
        opening: Opening,
    },
    /// The input of the element's name.
    Flow,
    /// The input of the element's name.
    Pressure,
    Constant(f64),
    Rcr {
        proximal: f64,
        compliance: f64,
        distal: f64,
        venous: f64,
    },
}

/// A chamber with an elastance between a passive and an active one; its activation is an input.
#[derive(Clone, Debug)]
pub(super) struct Chamber {
    pub(super) active: f64,
    pub(super) passive: f64,
    /// Volumes without pressure, passive and active.
    pub(super) rest: [f64; 2],
    /// Scale and rate of an exponential passive wall.
    pub(super) wall: Option<[f64; 2]>,
    pub(super) input: String,
}

/// How a valve opens.
#[derive(Clone, Copy, Debug)]
pub(super) enum Opening {
    /// At once.
    Sharp,
    /// Over a pressure drop.
    Over(f64),
    /// As a hyperbolic tangent of the drop times this.
    Steepness(f64),
}
