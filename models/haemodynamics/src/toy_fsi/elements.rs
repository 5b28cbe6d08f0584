//! Finite elements of the toy system: a string of linear elements over a channel of bilinear ones, thickness varying along
//! the wall.
//!
//! The added mass is a Neumann-to-Dirichlet map, MA = ρf Mw [Kp⁻¹]ww Mw: an acceleration of the wall drives the pressure,
//! whose values on the wall load it (Causin, Gerbeau & Nobile 2005). On a uniform grid the pressure problem separates: sines
//! along x, a tridiagonal system across for each. The thickness changes the wall only, so its operators do not commute with
//! the fluid's. Next file to read: [`super::vibration`].

use std::f64::consts::PI;

use nalgebra::DMatrix;

use super::spectral::Spectral;
use super::vessel::Vessel;

/// The grid: `along` × `across` cells and the nodes of the wall between its ends.
#[derive(Clone, Debug)]
pub(crate) struct Elements {
    along: usize,
    across: usize,
    thickness_wave: f64,
    spectral: Spectral,
}

/// The matrices of a wall with fluid, symmetric.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Matrices {
    /// Mass of the wall.
    pub(crate) solid_mass: DMatrix<f64>,
    /// Added mass of the fluid.
    pub(crate) added_mass: DMatrix<f64>,
    /// Stiffness of the wall.
    pub(crate) stiffness: DMatrix<f64>,
}

/// Integrals over a linear element of length 1: products of shape functions, and of their derivatives.
const PRODUCTS: [[f64; 2]; 2] = [[1.0 / 3.0, 1.0 / 6.0], [1.0 / 6.0, 1.0 / 3.0]];
const SLOPES: [[f64; 2]; 2] = [[1.0, -1.0], [-1.0, 1.0]];

impl Elements {
    /// A grid whose wall has the thickness h (1 + w sin πx/L), taken at the middle of each element.
    pub(crate) fn new([along, across]: [usize; 2], thickness_wave: f64) -> Self {
        Self { along, across, thickness_wave, spectral: Spectral::sines(along - 1) }
    }

    /// Number of wall nodes between the ends.
    pub(crate) fn len(&self) -> usize {
        self.along - 1
    }

    /// Places x/L of the nodes.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = f64> {
        self.spectral.nodes()
    }

    /// The matrices for a vessel.
    pub(crate) fn matrices(&self, vessel: &Vessel) -> Matrices {
        let n = self.len();
        let dx = vessel.length / self.along as f64;
        let (mut solid_mass, mut stiffness) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        for element in 0..self.along {
            let middle = (element as f64 + 0.5) / self.along as f64;
            let thickness = 1.0 + self.thickness_wave * (PI * middle).sin();
            for (p, q) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                // Node 0 of the grid is an end, as is the last.
                let (i, j) = ((element + p).wrapping_sub(1), (element + q).wrapping_sub(1));
                if i < n && j < n {
                    solid_mass[(i, j)] += vessel.mass() * thickness * PRODUCTS[p][q] * dx;
                    let (ring, shear) =
                        (vessel.ring() * PRODUCTS[p][q] * dx, vessel.shear() * SLOPES[p][q] / dx);
                    stiffness[(i, j)] += thickness * (ring + shear);
                }
            }
        }
        let added = self.added_masses(vessel);
        Matrices { solid_mass, added_mass: self.spectral.operator(|i| added[i]), stiffness }
    }

    /// Eigenvalues of MA: ρf mᵢ² gᵢ, with mᵢ the eigenvalue of Mw and gᵢ the pressure on the wall under a unit flux of sine i.
    fn added_masses(&self, vessel: &Vessel) -> Vec<f64> {
        let (dx, dy) = (vessel.length / self.along as f64, vessel.radius / self.across as f64);
        let eigenvalues = (1..self.along).map(|i| {
            let cosine = (i as f64 * PI / self.along as f64).cos();
            let (product, slope) = (dx * (2.0 + cosine) / 3.0, 2.0 * (1.0 - cosine) / dx);
            let corner = slope * dy / 3.0 + product / dy;
            let beside = slope * dy / 6.0 - product / dy;
            vessel.fluid_density * product * product * self.wall_pressure(corner, beside)
        });
        eigenvalues.collect()
    }

    /// Last entry of the last column of the inverse of a tridiagonal matrix, `corner` at both ends of its diagonal, twice that
    /// between, `beside` next to it: Gaussian elimination from the axis to the wall.
    fn wall_pressure(&self, corner: f64, beside: f64) -> f64 {
        let mut pivot = corner;
        for row in 1..=self.across {
            let diagonal = if row == self.across { corner } else { 2.0 * corner };
            pivot = diagonal - beside * beside / pivot;
        }
        1.0 / pivot
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// [Kp⁻¹] on the wall from the assembled pressure problem.
    fn assembled(vessel: &Vessel, along: usize, across: usize) -> DMatrix<f64> {
        let (dx, dy) = (vessel.length / along as f64, vessel.radius / across as f64);
        let index = |i: usize, j: usize| (i.wrapping_sub(1)) * (across + 1) + j;
        let n = (along - 1) * (across + 1);
        let mut kp = DMatrix::zeros(n, n);
        let corners = [(0, 0), (0, 1), (1, 0), (1, 1)];
        for (i, j) in (0..along).flat_map(|i| (0..across).map(move |j| (i, j))) {
            for (a, b) in corners.into_iter().flat_map(|a| corners.into_iter().map(move |b| (a, b))) {
                if [i + a.0, i + b.0].iter().all(|&end| end > 0 && end < along) {
                    let (x, y) = ((a.0, b.0), (a.1, b.1));
                    kp[(index(i + a.0, j + a.1), index(i + b.0, j + b.1))] +=
                        SLOPES[x.0][x.1] / dx * PRODUCTS[y.0][y.1] * dy
                            + PRODUCTS[x.0][x.1] * dx * SLOPES[y.0][y.1] / dy;
                }
            }
        }
        let inverse = kp.try_inverse().expect("a pressure problem with two ends held");
        DMatrix::from_fn(along - 1, along - 1, |i, j| inverse[(index(i + 1, across), index(j + 1, across))])
    }

    #[test]
    fn the_separated_pressure_problem_is_the_assembled_one() {
        let theta: Vec<f64> = Vessel::parameters().iter().filter_map(|q| q.default).collect();
        let vessel = Vessel::read(&theta);
        let elements = Elements::new([12, 5], 0.5);
        let dx = vessel.length / 12.0;
        let wall = DMatrix::from_fn(11, 11, |i, j| match i.abs_diff(j) {
            0 => 2.0 * dx / 3.0,
            1 => dx / 6.0,
            _ => 0.0,
        });
        let expected = vessel.fluid_density * &wall * assembled(&vessel, 12, 5) * &wall;
        let difference = elements.matrices(&vessel).added_mass - &expected;
        // A dense inverse of 66 unknowns with a condition of about a thousand.
        assert!(difference.amax() < 1e-12 * expected.amax(), "{:e}", difference.amax());
    }
}
