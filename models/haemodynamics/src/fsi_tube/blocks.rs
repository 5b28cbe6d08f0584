//! The tube as a fluid–structure system in blocks: masses and stiffness of the wall, and what the fluid adds.
//!
//! With the pressures eliminated, Q = Q_in − C w and (Ms + MA) dw/dt + K η = loads, where C sums the cells upstream of a face.
//! Next file to read: [`starlings_models_core::blocks`].

use nalgebra::{DMatrix, DVector};
use starlings_models_core::Blocks;
use starlings_models_core::blocks::{WallOutputs, WindkesselBlock};

use super::FsiTube;

impl FsiTube {
    pub(super) fn structure(&self, theta: &[f64]) -> Blocks {
        let (c, n) = (self.coefficients(theta), self.n_cell());
        let mut stiffness = vec![0.0; n];
        self.stiffness(theta, &c, &mut stiffness);
        let solid_mass = DMatrix::from_diagonal_element(n, n, c.area * c.mass);
        // Cᵀ diag(l dx) C: cells i and j move the fluid of every face downstream of both; the last face is half as long.
        let added_mass = DMatrix::from_fn(n, n, |i, j| {
            let faces = (n - i.max(j)) as f64 - 0.5;
            c.area * c.area * c.inertance * faces
        });
        Blocks {
            displacement: 0,
            velocity: n,
            mass: &solid_mass + &added_mass,
            trace: None,
            solid_mass,
            added_mass,
            stiffness: DMatrix::from_diagonal(&(c.area * DVector::from_vec(stiffness))),
            windkessel: Some(WindkesselBlock { state: 2 * n, rate: 1.0 / (c.distal * c.compliance) }),
            outputs: WallOutputs {
                displacement: "displacement",
                velocity: "velocity",
                pressure: Some("pressure"),
            },
        }
    }
}
