//! Dynamical inference: drift and noise of stochastic differential equations from a recording, without a search.
//!
//! ẋ = f(x, t) + D^{1/2} ξ with f linear in unknown coefficients: their posterior is a formula over sums that add up over blocks of
//! the recording and over machines (Smelyanskiy, Luchinsky et al., "Physics-based methods of failure analysis and diagnostics in
//! human space flight", eqs. 1.1 to 1.26). The order of the files is that of the work: `basis.rs` (functions), `stream.rs` and
//! `sums.rs` (one pass over the data), `structure.rs` (which function in which equation), `fit.rs` and `posterior.rs`.
//! Deliberately no simulation here, and no nonlinear parameter inside a function.

mod basis;
mod change;
mod coarse;
mod constancy;
mod decimation;
mod detector;
mod diffusion;
mod draw;
mod em;
mod error;
mod evidence;
mod expected;
mod fit;
mod function;
mod functions;
mod history;
mod lagged;
mod missing;
mod noise_check;
mod noise_form;
mod normal;
mod pairs;
mod pass_noise;
mod path;
mod polynomial;
mod posterior;
mod prior;
mod products;
mod reduced;
mod regression;
mod residual_products;
mod residuals;
mod robust;
mod smoother;
mod stream;
mod structure;
mod subset;
mod sums;
mod text;
mod varying;
mod window;

pub use basis::{Basis, Rule};
pub use change::{Change, compare};
pub use coarse::{StepError, noise_errors, step_errors, step_in_rates};
pub use constancy::{Seam, most_changed};
pub use decimation::{Decimation, Extrapolated, Strength, extrapolate};
pub use detector::{Detector, DetectorState, Following, Report};
pub use diffusion::Diffusion;
pub use draw::{Drawn, Draws};
pub use em::{Iteration, Measured, Noisy, NoisyPosterior};
pub use error::InferenceError;
pub use fit::Fit;
pub use function::Function;
pub use functions::{Columns, Functions, Samples};
pub use missing::{Candidate, Missing, Named, Score, Search, joint, missing_terms};
pub use noise_check::{IncrementNoise, MATTERS, NoiseCheck, Verdict, increment_noise, noise_checks};
pub use noise_form::{NoiseForm, noise_form};
pub use pairs::Pairs;
pub use polynomial::Polynomial;
pub use posterior::{Estimate, Posterior, Value};
pub use prior::Prior;
pub use reduced::{Reduced, reduce};
pub use regression::Regression;
pub use residuals::lag_spread;
pub use stream::{STEP_TOLERANCE, Stream, StreamState};
pub use structure::{Coefficient, Place, Structure};
pub use sums::Sums;
pub use varying::{Varying, With, varying};
pub use window::{Memory, Window};
