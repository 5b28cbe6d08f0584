//! Estimation as pure functions: sigma points, the reduced-order unscented Kalman filter, the batch fit, diagnostics.
//!
//! What it deliberately does not do: it runs no model, reads no file, keeps no clock and starts no thread. It sees the
//! predictions of the particles, never their states: the caller applies the transform of an analysis to whatever the
//! states are (`recombine`). Everything here is in transformed parameters (see [`Transform`]), a particle is a column,
//! and every reduction runs in a fixed order, so the same input gives the same bits.
//!
//! Read next: `kind.rs` (which estimators there are), then `sigma_set.rs` (where the particles are) and `roukf.rs` (what an
//! analysis does with them). `inference.rs` and `unknown_input.rs` stand apart: they see a recording and a
//! formula, no particles; `forecast.rs` sees the courses of an ensemble.

mod analysis;
mod batch;
mod block_angular;
mod blocks;
mod correlated_noise;
mod data;
pub mod departures;
mod diagnostics;
mod drift;
mod error;
mod exchange;
mod filter;
pub mod forecast;
mod from_start;
mod gauss_newton;
mod gaussian;
mod gram;
mod identifiability;
pub mod inference;
mod information;
mod kind;
mod least_squares;
mod linearisation;
mod outliers;
mod particles;
mod pooled;
mod qr;
pub mod quantiles;
mod recombine;
mod roukf;
mod sandwich;
pub mod scenarios;
mod score;
mod sigma_set;
mod spectral;
mod stored;
mod transform;
pub mod unknown_input;
mod whiten;
mod whiteness;

pub use analysis::Analysis;
pub use batch::{BATCH, Batch, BatchState, BatchStep};
pub use block_angular::{BlockAngular, BlockRow};
pub use blocks::Block;
pub use correlated_noise::{CorrelatedNoise, FittedNoise, Part, Series, fit_noise};
pub use data::{Data, Noise};
pub use diagnostics::{
    autocorrelation, correlation, effective_nis_band, effective_sample_size, freedom_of_third_differences,
    n_third_difference, nis_band, nis_band_of_uncertain_noise, noise_from_third_differences,
};
pub use drift::Drift;
pub use error::EstimatorError;
pub use exchange::{Exchanged, exchange_prior};
pub use filter::{Filter, Resampled};
pub use from_start::FromStart;
pub use gauss_newton::GAUSS_NEWTON;
pub use gaussian::Gaussian;
pub use identifiability::{
    Collinearity, Direction, Fisher, Sensitivities, Subset, sigma_point_sensitivities, weak_directions,
};
pub use kind::{Form, Kind, MakeFilter, Options, Slope};
pub use least_squares::{End, LeastSquares, Need, Scaled};
pub use linearisation::Linearisation;
pub use outliers::{Outlier, are_too_many, ends_apart, outliers};
pub use particles::Particles;
pub use pooled::Pooled;
pub use recombine::{Recombination, recombine};
pub use roukf::{ROUKF, Root, Roukf};
pub use sandwich::{DataPoint, Residuals};
pub use score::{Optimum, Score, null_maxima, score_correlation};
pub use sigma_set::{Points, SigmaSet};
pub use spectral::{Svd, svd};
pub use transform::Transform;
pub use whiteness::ljung_box;

/// All estimators, the default first.
pub const KINDS: &[&Kind] = &[&ROUKF, &BATCH, &GAUSS_NEWTON];
