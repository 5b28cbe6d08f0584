//! Unit sigma points and their weights: sum a = 1, I a = 0, I D I^T = 1.
//!
//! Deliberately without scale or mean: those belong to the particles. All weights are positive.
//! Read next: `particles.rs`.

use nalgebra::{DMatrix, DVector};

use crate::EstimatorError;

/// Which sigma points: p parameters, r particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Points {
    /// The fewest: r = p + 1, equal weights (Moireau & Chapelle 2011, section 2.3).
    Simplex,
    /// Pairs without a centre: r = 2 p, equal weights.
    Canonical,
    /// Pairs and a centre, all weights equal: r = 2 p + 1.
    Star,
    /// Pairs and a centre of free weight: r = 2 p + 1 (Julier & Uhlmann 1997); kappa = 1/2 is the star, 3 - p matches
    /// the fourth moment of a Gaussian.
    JulierUhlmann {
        /// Weight of the centre is kappa / (p + kappa); positive.
        kappa: f64,
    },
}

/// Unit sigma points of p parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct SigmaSet {
    /// Points, p x r: zero mean and unit covariance under the weights.
    pub points: DMatrix<f64>,
    /// Weights, length r: positive, sum one.
    pub weights: DVector<f64>,
}

impl SigmaSet {
    /// The sigma points of `p` parameters.
    ///
    /// # Errors
    /// `NoParameters` for p = 0, `Kappa` when the centre would not have a positive weight.
    pub fn new(kind: Points, p: usize) -> Result<Self, EstimatorError> {
        if p == 0 {
            return Err(EstimatorError::NoParameters);
        }
        let n = p as f64;
        match kind {
            Points::Simplex => Ok(simplex(p)),
            Points::Canonical => Ok(pairs(p, n.sqrt(), 0.5 / n, None)),
            Points::Star => {
                Ok(pairs(p, (n + 0.5).sqrt(), 1.0 / (2.0 * n + 1.0), Some(1.0 / (2.0 * n + 1.0))))
            }
            Points::JulierUhlmann { kappa } if kappa > 0.0 && kappa.is_finite() => {
                Ok(pairs(p, (n + kappa).sqrt(), 0.5 / (n + kappa), Some(kappa / (n + kappa))))
            }
            Points::JulierUhlmann { kappa } => Err(EstimatorError::Kappa { kappa }),
        }
    }

    /// Number of parameters p.
    pub fn n_param(&self) -> usize {
        self.points.nrows()
    }

    /// Number of particles r.
    pub fn n_particle(&self) -> usize {
        self.points.ncols()
    }
}

/// Row i (from 1) is s_i i times, then -i s_i, with s_i = sqrt((p+1) / (i (i+1))); the first row carries a minus sign.
fn simplex(p: usize) -> SigmaSet {
    let r = p + 1;
    let mut points = DMatrix::zeros(p, r);
    for i in 1..=p {
        let s = (r as f64 / (i * (i + 1)) as f64).sqrt() * if i == 1 { -1.0 } else { 1.0 };
        for j in 0..i {
            points[(i - 1, j)] = s;
        }
        points[(i - 1, i)] = -(i as f64) * s;
    }
    SigmaSet { points, weights: DVector::from_element(r, 1.0 / r as f64) }
}

/// Pairs +-reach e_i, then the centre when it has a weight.
fn pairs(p: usize, reach: f64, weight: f64, centre: Option<f64>) -> SigmaSet {
    let r = 2 * p + usize::from(centre.is_some());
    let mut points = DMatrix::zeros(p, r);
    let mut weights = DVector::from_element(r, weight);
    for i in 0..p {
        points[(i, i)] = reach;
        points[(i, p + i)] = -reach;
    }
    if let Some(w) = centre {
        weights[r - 1] = w;
    }
    SigmaSet { points, weights }
}
