//! What sensors on a plate record after a burst: of the whole plate, of a damaged one exactly, and to first order in the damage.
//!
//! The force is linear between its samples and starts from rest. Nothing is searched here. Next file to read: [`super::search`].

use nalgebra::{DMatrix, DVector};

use super::damaged::DamagedModes;
use super::{Damage, Geometry, Material, Overlap, Patch};
use crate::modal::Modes;

/// Squares of frequencies closer than this, relative to them, are one frequency.
const SAME: f64 = 1e-9;
/// Relative change of ω² by which the slope of a response is taken: its error is (ω t/2)² of 10⁻¹⁰/6, below 10⁻⁵ up to ω t = 1000.
const SLOPE: f64 = 1e-5;

/// A plate, where it is struck and watched, and the force.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrangement {
    /// The plate.
    pub geometry: Geometry,
    /// What it is made of.
    pub material: Material,
    /// Where the force acts, in m.
    pub source: [f64; 2],
    /// Where the displacement is measured, in m.
    pub sensors: Vec<[f64; 2]>,
    /// Time from sample to sample in s.
    pub step: f64,
    /// Samples of the force in N.
    pub force: Vec<f64>,
}

/// An arrangement with the responses of the whole plate; recordings are sensors × samples, in m.
#[derive(Clone, Debug)]
pub struct Inspection {
    arrangement: Arrangement,
    /// Acceleration of every mode by a unit force.
    forcing: DVector<f64>,
    /// Values of the modes at the sensors, sensors × modes.
    observed: DMatrix<f64>,
    /// Response of every mode to a unit share of the force, modes × samples.
    responses: DMatrix<f64>,
    /// Their negative slopes by ω²: the response of a mode to its own response.
    repeated: DMatrix<f64>,
    pristine: DMatrix<f64>,
    /// ω_l² f_l/(ω_k² − ω_l²) for modes k, l of different frequencies, else zero.
    between: DMatrix<f64>,
    /// ω_l² f_l for modes of one frequency, else zero.
    within: DMatrix<f64>,
}

fn stacked(rows: &[Vec<f64>]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows.first().map_or(0, Vec::len), |i, j| rows[i][j])
}

impl Inspection {
    /// Computes what does not depend on the damage.
    pub fn new(arrangement: Arrangement) -> Self {
        let Arrangement { geometry, material, source, sensors, step, force } = &arrangement;
        let frequencies = DVector::from_vec(geometry.frequencies(material));
        let forcing = DVector::from_vec(geometry.forcing(material, *source));
        let observed = stacked(&sensors.iter().map(|at| geometry.shapes(*at)).collect::<Vec<_>>());
        let squares = frequencies.map(|omega| omega * omega);
        let of = |scale: f64| {
            let modes = Modes { squares: (&squares * scale).as_slice().to_vec(), decay: material.decay };
            stacked(&modes.responses(*step, force))
        };
        let responses = of(1.0);
        let mut repeated = of(1.0 - SLOPE) - of(1.0 + SLOPE);
        for (mut row, square) in repeated.row_iter_mut().zip(squares.iter()) {
            row /= 2.0 * SLOPE * square;
        }
        let n = squares.len();
        let weight = |l: usize| squares[l] * forcing[l];
        let gap = |k: usize, l: usize| squares[k] - squares[l];
        let same = |k: usize, l: usize| gap(k, l).abs() <= SAME * squares[k];
        let between = DMatrix::from_fn(n, n, |k, l| if same(k, l) { 0.0 } else { weight(l) / gap(k, l) });
        let within = DMatrix::from_fn(n, n, |k, l| if same(k, l) { weight(l) } else { 0.0 });
        let mut driven = responses.clone();
        driven.row_iter_mut().zip(forcing.iter()).for_each(|(mut row, f)| row *= *f);
        let pristine = &observed * driven;
        Self { arrangement, forcing, observed, responses, repeated, pristine, between, within }
    }

    /// What it was made of.
    pub fn arrangement(&self) -> &Arrangement {
        &self.arrangement
    }

    /// The recording of the whole plate.
    pub fn pristine(&self) -> &DMatrix<f64> {
        &self.pristine
    }

    /// The recording of a damaged plate, exact for the modes that are taken.
    pub fn exact(&self, damage: &Damage) -> DMatrix<f64> {
        let Arrangement { geometry, material, step, force, .. } = &self.arrangement;
        let damaged = DamagedModes::new(geometry, material, damage);
        let share = &damaged.to * &self.forcing;
        let mut driven = stacked(&damaged.modes.responses(*step, force));
        driven.row_iter_mut().zip(share.iter()).for_each(|(mut row, f)| row *= *f);
        (&self.observed * &damaged.from) * driven
    }

    /// Change of the recording per unit of severity, to first order (Born's approximation): c1'' + 2δ c1' + W² c1 = Λ W² c0.
    ///
    /// In closed form: where g_k is the response of mode k to a unit impulse, g_k ∗ g_l = (g_l − g_k)/(ω_k² − ω_l²), and
    /// −∂g_k/∂ω_k² for modes of one frequency.
    pub fn born(&self, patch: Patch) -> DMatrix<f64> {
        let Geometry { length, modes } = self.arrangement.geometry;
        let overlap = Overlap::new(length, modes, patch).dense();
        let mixed = overlap.component_mul(&self.between);
        let mut weights = &self.observed * &mixed;
        for (k, row) in mixed.row_iter().enumerate() {
            weights.column_mut(k).axpy(-row.sum(), &self.observed.column(k), 1.0);
        }
        let repeated = &self.observed * overlap.component_mul(&self.within);
        weights * &self.responses + repeated * &self.repeated
    }
}
