//! Pre-stress: the unloaded shape of a vessel whose image shows it under pressure.
//!
//! An image is taken at some pressure, diastole at best, and a law of the wall counts its strain from the shape without
//! any. Taking the image for that shape makes the wall look too stiff. [`unloaded`] finds the shape which, loaded by the
//! measured pressure, is the image, for any load map; [`Rings`] is the map of an elastic tube of thin rings. Which pressure
//! belongs to the image is not decided here. Next file to read: [`crate::surface`].

use nalgebra::{DMatrix, DVector};

use crate::SetupError;

/// Largest accepted distance between the loaded shape and the image, relative to the largest entry of the image.
pub const TOLERANCE: f64 = 1e-12;

/// Steps after which the search gives up.
const MOST_STEPS: u32 = 200;

/// Halvings of one step after which the search gives up.
const MOST_HALVINGS: u32 = 40;

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

/// The shape which, loaded, is `image`. `load` writes the loaded shape for an unloaded one, both of the image's length.
///
/// The first step moves the shape by image − loaded (Sellier 2011, an iterative method for the inverse elastostatic
/// problem); the following ones learn the slope of the load map from the steps before (Broyden 1965, good method), and a
/// step that does not come nearer is halved. For a stiff wall this is the fixed point, for a soft one it converges where the
/// fixed point runs away.
///
/// # Errors
/// When the image is empty or not finite, or no shape is found: the wall is too soft for the pressure.
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
    let mut inverse = DMatrix::identity(image.len(), image.len());
    for steps in 0..MOST_STEPS {
        let residual = excess.amax() / scale;
        if residual <= TOLERANCE {
            return Ok(Unloaded { shape: shape.as_slice().to_vec(), steps, residual });
        }
        let Some((step, next)) = nearer(&shape, &excess, -(&inverse * &excess), &mut beyond) else { break };
        learn(&mut inverse, &step, &(&next - &excess));
        shape += step;
        excess = next;
    }
    Err(SetupError::Invalid(format!(
        "no unloaded shape found: loaded, the nearest one is {:.1e} of the image's size away; the wall is too soft for \
         the pressure of the image: raise the stiffness or check the pressure's unit",
        excess.amax() / scale
    )))
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

/// Broyden's update: the inverse slope that takes the change of the excess to the step, nearest to the one before.
fn learn(inverse: &mut DMatrix<f64>, step: &DVector<f64>, change: &DVector<f64>) {
    let expected = &*inverse * change;
    let weight = step.dot(&expected);
    if weight != 0.0 {
        let left = (step - expected) / weight;
        let right = inverse.tr_mul(step);
        *inverse += left * right.transpose();
    }
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
