//! Image force: the observed displacement pulls the wall like a spring (Sermesant et al. 2006, for cardiac images).
//!
//! M dc/dt + D c + Eᵀ K d = loads + γ² Eᵀ H Ms H (z − d). The error gains stiffness and no damping: its frequencies shift and
//! its amplitude stays. It is here to be compared; take [`super::sdf`]. Next file to read: [`super::windkessel`].

use std::f64::consts::PI;

use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

use super::wall::{Shown, Wall, add, feedback, of_velocity, on_velocity, restricted, solve};
use super::{Correction, Kind, Observer, Wiring};
use crate::Model;
use crate::SetupError;
use crate::setup::ObserverDef;

/// The entry of the observer list.
pub(super) const KIND: Kind = Kind {
    kind: "image-force",
    says: "Observed wall displacements pull the wall like springs: frequencies shift, nothing decays.",
    build: |def, wiring| Ok(Box::new(ImageForce::new(def, wiring)?)),
};

/// A spring between the wall and its image.
#[derive(Debug)]
pub(crate) struct ImageForce {
    wall: Wall,
}

impl ImageForce {
    /// Finds the observed nodes.
    ///
    /// # Errors
    /// When the model has no wall or its displacement is not observed.
    pub(crate) fn new(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Self, SetupError> {
        Ok(Self { wall: Wall::new(def, &wiring, Shown::Displacement)? })
    }

    /// Eᵀ H Ms H, n_c × n, the observed nodes given.
    fn spring(blocks: &crate::Blocks, observed: &[bool]) -> DMatrix<f64> {
        on_velocity(blocks.trace.as_ref(), restricted(blocks.solid_mass.clone(), observed))
    }
}

impl Observer for ImageForce {
    /// δc = Δt γ² M⁻¹ Eᵀ H Ms H (z − d): the impulse of the force over Δt.
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        let Some(innovation) = self.wall.innovation(&at) else { return };
        let Some(blocks) = at.model.blocks(at.theta) else { return };
        let norm = innovation.weighed(restricted(blocks.solid_mass.clone(), &innovation.observed));
        let force = on_velocity(blocks.trace.as_ref(), norm) * innovation.column();
        let change = solve(blocks.mass, force) * (innovation.longest() * self.wall.gain * self.wall.gain);
        add(x, self.wall.velocity, change.as_slice());
    }

    fn reads(&self) -> Vec<usize> {
        self.wall.reads()
    }

    fn feedback(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        let Some(blocks) = model.blocks(theta) else { return DMatrix::zeros(n, n) };
        let spring = Self::spring(&blocks, &self.wall.observed()) * (self.wall.gain * self.wall.gain);
        feedback(model, (self.wall.velocity, self.wall.displacement), &solve(blocks.mass, spring))
    }

    /// An impulse after a free vibration by θ = ωΔt repeats stably while (γΔt)² share < 2θ cot(θ/2): its matrix has the
    /// determinant 1 and the trace 2 cos θ − (γΔt)² share sin(θ)/θ. That is γΔt < 2 √(smallest eigenvalue of Ms⁻¹ M), at
    /// least 2, for slow modes, and stricter than γ² + ω² < (2/Δt)² for none. Modes that the data do not resolve, θ ≥ π,
    /// are left to their own damping.
    fn stable_up_to(&self, model: &dyn Model, theta: &[f64], dt: f64) -> Option<f64> {
        let modes = model.blocks(theta).and_then(|blocks| modes(&blocks)).unwrap_or_default();
        let resolved =
            modes.iter().map(|(omega, share)| (omega * dt, share)).filter(|(angle, _)| *angle < PI);
        let of_mode = |(angle, share): (f64, &f64)| {
            let limit = if angle > 1e-6 { 2.0 * angle / (0.5 * angle).tan() } else { 4.0 };
            (limit / share).sqrt()
        };
        let most = resolved.map(of_mode).fold(f64::INFINITY, f64::min);
        // Without a mass or a stiffness, as where they are estimated, what holds for any slow mode.
        Some(if most.is_finite() { most } else { 2.0 } / dt)
    }
}

/// Circular frequency ω and share φᵀ Ms φ of the wall in the mass, of every mode K φ = ω² M φ, φᵀ M φ = 1, of an undamped
/// wall; `None` where M or K is not positive definite.
fn modes(blocks: &crate::Blocks) -> Option<Vec<(f64, f64)>> {
    let trace = blocks.trace.as_ref();
    let on_velocity = |wall: &DMatrix<f64>| on_velocity(trace, of_velocity(trace, wall.clone()));
    Cholesky::new(blocks.stiffness.clone())?;
    let inverse = Cholesky::new(blocks.mass.clone())?.l().try_inverse()?;
    let n = inverse.nrows();
    let stiffness = &inverse * on_velocity(&blocks.stiffness) * inverse.transpose();
    let eigen = SymmetricEigen::try_new(stiffness, f64::EPSILON, 100 * n.max(30))?;
    let share = &inverse * on_velocity(&blocks.solid_mass) * inverse.transpose();
    let of_mode = |(i, square): (usize, &f64)| {
        let phi = eigen.eigenvectors.column(i);
        (square.max(0.0).sqrt(), phi.dot(&(&share * phi)))
    };
    Some(eigen.eigenvalues.iter().enumerate().map(of_mode).collect())
}
