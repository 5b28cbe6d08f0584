//! What goes into a fit and what comes out: prior, needs, ends.
//!
//! Next file to read: [`super`], which decides between them.

use nalgebra::DVector;

/// What is known of z before the data: an independent Gaussian and bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaled {
    /// Prior means, length p.
    pub mean: DVector<f64>,
    /// Prior precisions (1 / variance), length p; zero is no prior.
    pub precision: DVector<f64>,
    /// Smallest and largest value of each, length p.
    pub bounds: Vec<[f64; 2]>,
    /// For a component that is the logarithm of a quantity to which the rates are proportional: the growth of its logarithm per unit of
    /// z, above zero. Zero for all others. Length p.
    pub growth: DVector<f64>,
}

impl Scaled {
    /// Twice the negative logarithm of the density at z, up to a constant.
    pub fn cost(&self, z: &DVector<f64>) -> f64 {
        let pull = z - &self.mean;
        pull.component_mul(&pull).dot(&self.precision)
    }
}

/// The run, or runs, that a fit needs next.
#[derive(Debug, Clone, PartialEq)]
pub enum Need {
    /// The whitened residual (observed - predicted) / noise at this point.
    Residual(DVector<f64>),
    /// The whitened Jacobian d prediction / d z at this point, m x p.
    Jacobian(DVector<f64>),
    /// Nothing: the fit has ended.
    Nothing(End),
}

/// How a fit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// No step promises a fall of the cost above the tolerance; the Jacobian is of this point.
    Converged,
    /// As far as the secant tells; the Jacobian was not measured again.
    Tentative,
    /// No step lowers the cost although the Jacobian is of this point.
    Stalled,
    /// The limit of trials was reached.
    Limit,
    /// The first run failed.
    NoStart,
}
