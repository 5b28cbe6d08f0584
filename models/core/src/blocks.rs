//! The blocks of a linear fluid–structure system: what structural observers and the energy coordinates of a spectrum
//! stand on.
//!
//! The system, for wall displacements d (n of them) and velocity unknowns c (n_c of them, solid and fluid):
//!
//! M dc/dt + D c + Eᵀ K d = loads,  dd/dt = E c,
//!
//! with the wall velocity E c. Where the fluid is a potential flow, c is the wall velocity itself and M = Ms + MA, the solid
//! mass and the added mass of the fluid (Moireau, Chapelle & Le Tallec 2008; Fernández & Moubachir 2005). Damping and loads
//! are not here: an observer does not need them. Next file to read: [`crate::observer`].

use nalgebra::DMatrix;

/// The blocks at given parameters, in the units of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocks {
    /// Position in the state of the first of the n displacements d.
    pub displacement: usize,
    /// Position in the state of the first of the n_c velocity unknowns c.
    pub velocity: usize,
    /// M, n_c × n_c, symmetric positive definite: all the mass that moves with c.
    pub mass: DMatrix<f64>,
    /// E, n × n_c, from c to the wall velocity; `None` where c is the wall velocity.
    pub trace: Option<DMatrix<f64>>,
    /// Ms, n × n, symmetric positive definite: the mass of the wall alone.
    pub solid_mass: DMatrix<f64>,
    /// MA, n × n, symmetric: the added mass of the fluid seen by the wall.
    pub added_mass: DMatrix<f64>,
    /// K, n × n, symmetric positive definite: the stiffness of the wall.
    pub stiffness: DMatrix<f64>,
    /// A Windkessel at the outlet, where the model has one.
    pub windkessel: Option<WindkesselBlock>,
    /// Which outputs show the wall.
    pub outputs: WallOutputs,
}

/// The Windkessel C dπ/dt = Q − π/R_d of a fluid–structure system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindkesselBlock {
    /// Position of π in the state.
    pub state: usize,
    /// 1/(R_d C), in 1/time.
    pub rate: f64,
}

/// Names of the outputs that show the wall; the fields have one component per displacement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WallOutputs {
    /// Field of the n wall displacements.
    pub displacement: &'static str,
    /// Field of the n wall velocities.
    pub velocity: &'static str,
    /// Pressure before the Windkessel, R_p Q above π.
    pub pressure: Option<&'static str>,
}

/// What observers of a network of vessels stand on whose walls have no inertia: their sections, and the Windkessels behind the outlets.
#[derive(Clone, Debug, PartialEq)]
pub struct Sections {
    /// Position in the state of the first of the n sections A = πR².
    pub area: usize,
    /// How many there are.
    pub n: usize,
    /// Field of the n displacements R − R0.
    pub displacement: &'static str,
    /// The Windkessels, each with the output that shows the pressure before it.
    pub outlets: Vec<(WindkesselBlock, String)>,
}

impl Blocks {
    /// Number of wall displacements.
    pub(crate) fn n_wall(&self) -> usize {
        self.stiffness.nrows()
    }
}
