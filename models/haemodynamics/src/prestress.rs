//! Pre-stress: the unloaded shape of a vessel whose image shows it under pressure.
//!
//! An image is taken at some pressure, diastole at best, and a law of the wall counts its strain from the shape without
//! any. Taking the image for that shape makes the wall look too stiff. [`unloaded`] finds the shape which, loaded by the
//! measured pressure, is the image, for any load map; [`Rings`] is the map of an elastic tube of thin rings. Which pressure
//! belongs to the image is not decided here. Next file to read: [`starlings_models_core::surface`].

use nalgebra::{DMatrix, DVector};
use starlings_models_core::SetupError;

/// Largest accepted distance between the loaded shape and the image, relative to the largest entry of the image.
pub const TOLERANCE: f64 = 1e-12;

/// Steps after which the search gives up.
const MOST_STEPS: u32 = 50;

/// Halvings of one step after which the search gives up.
const MOST_HALVINGS: u32 = 20;

/// The shape without load.
#[derive(Clone, Debug, PartialEq)]
pub struct Unloaded {
    /// One entry per entry of the image, in its unit.
    pub shape: Vec<f64>,
    /// Steps taken.
    pub steps: u32,
    /// Largest distance between the loaded shape and the image, relative to the image's largest entry.
    pub residual: f64,
}

/// The shape which, loaded, is `image`. `load` writes the loaded shape for an unloaded one, both of the image's length n.
///
/// Newton's method from the image, with the slope of the load map by n differences and steps halved while they do not come
/// nearer: it also converges for a soft wall, from which the simple correction shape + image − loaded (Sellier 2011) runs away.
/// Each step loads n + 1 shapes or more.
///
/// # Errors
/// When the image is empty or not finite, or no shape is found: a suction collapses the wall, or the load map does not
/// increase. Under a positive pressure every elastic ring has a shape, however soft: a pressure in another unit is not refused.
pub fn unloaded(image: &[f64], mut load: impl FnMut(&[f64], &mut [f64])) -> Result<Unloaded, SetupError> {
    let scale = image.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if !image.iter().all(|v| v.is_finite()) || scale == 0.0 {
        return Err(SetupError::Invalid(
            "an image without extent, or with a value that is not finite".to_owned(),
        ));
    }
    let image = DVector::from_column_slice(image);
    let mut beyond = |shape: &DVector<f64>| {
        let mut loaded = DVector::zeros(shape.len());
        load(shape.as_slice(), loaded.as_mut_slice());
        loaded - &image
    };
    let mut shape = image.clone();
    let mut excess = beyond(&shape);
    for steps in 0..MOST_STEPS {
        let residual = excess.amax() / scale;
        if residual <= TOLERANCE {
            return Ok(Unloaded { shape: shape.as_slice().to_vec(), steps, residual });
        }
        let slope = slope(&shape, &excess, scale, &mut beyond);
        let Some(step) = slope.lu().solve(&-&excess) else { break };
        let Some((step, left)) = nearer(&shape, &excess, step, &mut beyond) else { break };
        shape += step;
        excess = left;
    }
    Err(SetupError::Invalid(format!(
        "no unloaded shape found: loaded, the nearest one is {:.1e} of the image's size away; either no shape \
         is that large under this suction, or a stiffness is not above zero: check the stiffness, and the pressure's sign and \
         unit",
        excess.amax() / scale
    )))
}

/// The slope of the load map by forward differences, n × n.
fn slope(
    shape: &DVector<f64>,
    excess: &DVector<f64>,
    scale: f64,
    beyond: &mut impl FnMut(&DVector<f64>) -> DVector<f64>,
) -> DMatrix<f64> {
    let by = scale * f64::EPSILON.sqrt();
    let mut slope = DMatrix::zeros(shape.len(), shape.len());
    let mut moved = shape.clone();
    for j in 0..shape.len() {
        moved[j] += by;
        slope.set_column(j, &((beyond(&moved) - excess) / (moved[j] - shape[j])));
        moved[j] = shape[j];
    }
    slope
}

/// The longest of step, step/2, step/4, ... that brings the loaded shape nearer to the image, and what is left then.
fn nearer(
    shape: &DVector<f64>,
    excess: &DVector<f64>,
    mut step: DVector<f64>,
    beyond: &mut impl FnMut(&DVector<f64>) -> DVector<f64>,
) -> Option<(DVector<f64>, DVector<f64>)> {
    let before = excess.norm();
    for _ in 0..MOST_HALVINGS {
        let left = beyond(&(shape + &step));
        // Not a number is not nearer.
        if left.norm() < before {
            return Some((step, left));
        }
        step *= 0.5;
    }
    None
}

/// An elastic tube of thin rings, each on its own: (β/R² + k_s) (R_loaded − R) = p, with R the ring's unloaded radius.
#[derive(Clone, Debug, PartialEq)]
pub struct Rings {
    /// β = E h/(1 − ν²) of each ring, force/length (dyn/cm).
    pub membrane: Vec<f64>,
    /// k_s, stiffness of the tissue around, pressure/length (dyn/cm³); zero without support.
    pub support: f64,
}

impl Rings {
    /// Rings of Young's moduli E and thicknesses h, with Poisson's ratio ν and no tissue around.
    pub fn new(young: &[f64], thickness: &[f64], poisson: f64) -> Self {
        let plane = 1.0 - poisson * poisson;
        let membrane = young.iter().zip(thickness).map(|(young, h)| young * h / plane).collect();
        Self { membrane, support: 0.0 }
    }

    /// Writes the radii under a pressure.
    pub fn load(&self, unloaded: &[f64], pressure: f64, loaded: &mut [f64]) {
        for ((loaded, radius), membrane) in loaded.iter_mut().zip(unloaded).zip(&self.membrane) {
            *loaded = radius + pressure / (membrane / (radius * radius) + self.support);
        }
    }

    /// The unloaded radii of rings that have the radii `image` under a pressure.
    ///
    /// # Errors
    /// When the lengths differ, or as [`unloaded`].
    pub fn unloaded(&self, image: &[f64], pressure: f64) -> Result<Unloaded, SetupError> {
        if image.len() != self.membrane.len() {
            let (radii, rings) = (image.len(), self.membrane.len());
            return Err(SetupError::Invalid(format!("an image of {radii} radii for {rings} rings")));
        }
        unloaded(image, |shape, loaded| self.load(shape, pressure, loaded))
    }
}
