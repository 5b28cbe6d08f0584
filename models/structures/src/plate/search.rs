//! Where a plate is damaged and how badly: matched filter over a grid, Born's approximation, then the exact modes.
//!
//! The recordings of a grid of places to first order are a dictionary, computed once for an arrangement. The best places are
//! refined with Born's approximation, the best of them with the exact modes; derivatives are always Born's, which are a few per
//! cent off and cost no decomposition. The half width of the patch is known: severity and size are told apart by their product ε d²
//! alone unless the noise is below 0.1 %. Next file to read: [`super::least_squares`].

use nalgebra::{DMatrix, DVector, Matrix3};

use super::least_squares::{Limits, minimise};
use super::{Damage, Inspection, Patch};
use crate::StructureError;

/// Places that are refined.
const REFINED: usize = 3;
/// Step in m by which derivatives by place are taken: a thousandth of a wave length of decimetres.
const PLACE_STEP: f64 = 1e-4;
/// Step of the severity by which its derivative is taken at the end.
const SEVERITY_STEP: f64 = 1e-4;
/// Largest severity that is tried.
const MOST: f64 = 0.95;

/// The recordings, per unit of severity, of damage at the places of a grid.
#[derive(Clone, Debug)]
pub struct Dictionary {
    half_width: f64,
    cells: Vec<([f64; 2], DMatrix<f64>)>,
}

/// What a search found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// The damage.
    pub damage: Damage,
    /// Covariance of (x_d in m, y_d in m, severity) at the stated noise.
    pub covariance: Matrix3<f64>,
    /// Fall of χ² from the whole plate to the damaged one.
    pub gain: f64,
    /// χ² that is left; about the number of values when the model explains the recording.
    pub misfit: f64,
}

impl Dictionary {
    /// Damage of one half width in m at the inner points of a grid that cuts each length into `grid + 1` equal parts.
    pub fn new(inspection: &Inspection, half_width: f64, grid: [usize; 2]) -> Self {
        let length = inspection.arrangement().geometry.length;
        let at = |i: usize, axis: usize| length[axis] * i as f64 / (grid[axis] + 1) as f64;
        let places = (1..=grid[0]).flat_map(|i| (1..=grid[1]).map(move |j| [at(i, 0), at(j, 1)]));
        let cells = places.map(|centre| (centre, inspection.born(Patch { centre, half_width }))).collect();
        Self { half_width, cells }
    }

    /// Places by how much a loss of stiffness there lowers χ², the best first, with that fall and the severity: (r·s)²/(s·s) and
    /// (r·s)/(s·s) of residual r and signal s in units of the noise.
    fn ranked(&self, residual: &DMatrix<f64>, noise: &[f64]) -> Vec<([f64; 2], f64, f64)> {
        let mut ranked: Vec<([f64; 2], f64, f64)> = self
            .cells
            .iter()
            .map(|(centre, signal)| {
                let signal = whitened(signal, noise);
                let (match_, size) = (residual.dot(&signal), signal.norm_squared());
                (*centre, match_ * match_ / size, match_ / size)
            })
            .filter(|(_, _, severity)| *severity > 0.0)
            .collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        ranked
    }
}

/// Rows in units of their noise.
fn whitened(recording: &DMatrix<f64>, noise: &[f64]) -> DMatrix<f64> {
    let mut whitened = recording.clone();
    whitened.row_iter_mut().zip(noise).for_each(|(mut row, sd)| row /= *sd);
    whitened
}

/// A recording with its noise, and the patch that is looked for.
struct Search<'a> {
    inspection: &'a Inspection,
    data: &'a DMatrix<f64>,
    noise: &'a [f64],
    half_width: f64,
}

impl Search<'_> {
    fn patch(&self, p: &[f64; 3]) -> Patch {
        Patch { centre: [p[0], p[1]], half_width: self.half_width }
    }

    fn misfit(&self, predicted: &DMatrix<f64>) -> DVector<f64> {
        DVector::from_column_slice(whitened(&(predicted - self.data), self.noise).as_slice())
    }

    /// Residual with Born's approximation.
    fn coarse(&self, p: &[f64; 3]) -> DVector<f64> {
        self.misfit(&(self.inspection.pristine() + self.inspection.born(self.patch(p)) * p[2]))
    }

    /// Residual with the exact modes.
    fn exact(&self, p: &[f64; 3]) -> DVector<f64> {
        self.misfit(&self.inspection.exact(&Damage { patch: self.patch(p), severity: p[2] }))
    }

    /// Derivatives of Born's approximation, values × 3.
    fn slopes(&self, p: &[f64; 3]) -> DMatrix<f64> {
        let born = |shift: [f64; 2]| {
            let signal = self.inspection.born(self.patch(&[p[0] + shift[0], p[1] + shift[1], 0.0]));
            DVector::from_column_slice(whitened(&signal, self.noise).as_slice())
        };
        let h = PLACE_STEP;
        let place = |to: [f64; 2]| (born(to) - born(to.map(|v| -v))) * (p[2] / (2.0 * h));
        DMatrix::from_columns(&[place([h, 0.0]), place([0.0, h]), born([0.0; 2])])
    }

    /// (JᵀJ)⁻¹ with differences of the exact residual.
    fn covariance(&self, p: &[f64; 3], residual: &DVector<f64>) -> Option<Matrix3<f64>> {
        let columns = [PLACE_STEP, PLACE_STEP, SEVERITY_STEP].iter().enumerate().map(|(i, h)| {
            let mut moved = *p;
            moved[i] += h;
            (self.exact(&moved) - residual) / *h
        });
        let jacobian = DMatrix::from_columns(&columns.collect::<Vec<_>>());
        let information = jacobian.tr_mul(&jacobian);
        Matrix3::from_iterator(information.iter().copied()).try_inverse()
    }
}

/// Finds place and severity of one damaged patch.
///
/// `data` is sensors × samples in m, `noise` the standard deviation of each sensor in m.
///
/// # Errors
/// When the recording does not fit the arrangement, has values that are no numbers, or no loss of stiffness explains any of it.
pub fn locate(
    inspection: &Inspection,
    dictionary: &Dictionary,
    data: &DMatrix<f64>,
    noise: &[f64],
) -> Result<Located, StructureError> {
    check(inspection, data, noise)?;
    let search = Search { inspection, data, noise, half_width: dictionary.half_width };
    let residual = whitened(&(data - inspection.pristine()), noise);
    let length = inspection.arrangement().geometry.length;
    let limits = Limits { lowest: [0.0; 3], largest: [length[0], length[1], MOST] };
    let best = dictionary
        .ranked(&residual, noise)
        .into_iter()
        .take(REFINED)
        .map(|([x, y], _, severity)| {
            let start = [x, y, severity.min(MOST)];
            minimise(start, &limits, |p| search.coarse(p), |p| search.slopes(p))
        })
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
        .ok_or(StructureError::NothingFound { cells: dictionary.cells.len() })?;
    let end = minimise(best.at, &limits, |p| search.exact(p), |p| search.slopes(p));
    let covariance = search.covariance(&end.at, &end.residual).ok_or(StructureError::NotDetermined)?;
    Ok(Located {
        damage: Damage { patch: search.patch(&end.at), severity: end.at[2] },
        covariance,
        gain: residual.norm_squared() - end.cost,
        misfit: end.cost,
    })
}

fn check(inspection: &Inspection, data: &DMatrix<f64>, noise: &[f64]) -> Result<(), StructureError> {
    let (sensors, samples) = inspection.pristine().shape();
    let (rows, columns) = data.shape();
    if (rows, columns) != (sensors, samples) {
        return Err(StructureError::Shape { rows, columns, sensors, samples });
    }
    if noise.len() != sensors || !noise.iter().all(|sd| sd.is_finite() && *sd > 0.0) {
        return Err(StructureError::Noise { sensors });
    }
    match data.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(at) => {
            let (sensor, sample) = (at % sensors, at / sensors);
            Err(StructureError::NotFinite { sensor, sample, value: data[at] })
        }
    }
}
