//! The poles of a model's error under a state observer, which explain which observer to choose.
//!
//! With correct parameters and data without noise the error of the state obeys de/dt = (A − Γ) e, A being the linearisation
//! of the model and Γ the feedback of its observer ([`crate::Observer::feedback`]). The eigenvalues of A − Γ are the poles;
//! the largest real part is the rate at which the slowest part of a wrong initial state is forgotten. Nothing is run in time
//! here, and steps, noise and parameters that are being estimated are left out.
//!
//! Read [`linearised_setup`] for all of it together, [`linearise`] for A, [`pole`] for its eigenvalues, [`sensitivity`] for their
//! slopes in the gain, [`gain`] for the gain to choose, [`locus`] for the way of each pole. Source: Moireau, Chapelle &
//! Le Tallec (2008, 2009).

mod component;
mod coordinates;
mod decay;
mod gain;
mod linearise;
mod linearised_setup;
mod locus;
mod observed;
mod pole;
mod sensitivity;
mod vector;

use nalgebra::DMatrix;

use crate::{Model, Observer, SetupError};

pub use component::ROUNDING;
pub use coordinates::{Energy, natural};
pub use decay::Decay;
pub use gain::{Best, Beyond, GainCurve};
pub use linearise::linearisation;
pub use linearised_setup::{LinearisedSetup, ObserverSpectrum, start};
pub use locus::Follower;
pub use observed::{Feedback, ObservedSystem};
pub use pole::poles;
pub use sensitivity::{Slope, slopes};

/// A − Γ in the state's own coordinates, n_state × n_state: the matrix of the error under this observer.
///
/// # Errors
/// When the model has no linearisation at its initial state.
pub fn observed(
    model: &dyn Model,
    theta: &[f64],
    observer: &dyn Observer,
) -> Result<DMatrix<f64>, SpectrumError> {
    Ok(linearisation(model, theta)? - observer.feedback(model, theta))
}

/// Why there is no spectrum.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpectrumError {
    /// The future of the model depends on its past, so that a matrix does not describe it.
    #[error(
        "model `{model}` depends on its own past (`delay` or `ddt` of an output): no matrix describes it and it has no finite set \
         of poles"
    )]
    Delayed {
        /// The model's kind.
        model: String,
    },
    /// The rate has a jump or a kink at the state where the model is linearised.
    #[error(
        "model `{model}` switches exactly where it is linearised, and its linearisation differs on the two sides: start \
         it elsewhere, for example with another value of initial:{state}"
    )]
    Switching {
        /// The model's kind.
        model: String,
        /// A state component that crosses the switch.
        state: String,
    },
    /// The rate is not a number near the state where the model is linearised.
    #[error(
        "the rate of state `{state}` of model `{model}` is not finite near the state where it is linearised"
    )]
    NotFinite {
        /// The model's kind.
        model: String,
        /// The state component.
        state: String,
    },
    /// A gain so large that the model is lost in the rounding of the feedback.
    #[error(
        "the gain {gain:e} is too large: the model's own rates are lost in the rounding of its feedback, and no pole can be found; \
         give gains below {largest:.0e}"
    )]
    GainTooLarge {
        /// The gain.
        gain: f64,
        /// The gain from which on it is so.
        largest: f64,
    },
    /// The QR iteration did not converge.
    #[error("the poles of a matrix of {n} states were not found: the QR iteration did not converge")]
    NotConverged {
        /// Size of the matrix.
        n: usize,
    },
    /// A wanted decay that is none.
    #[error(
        "a decay by the factor {factor} within {time} is none: give a factor above 1 and a time above 0, such as 10 and 0.1"
    )]
    NoDecay {
        /// The factor.
        factor: f64,
        /// The time.
        time: f64,
    },
    /// The feedback of an observer is not a polynomial of second degree in its gain.
    #[error("the feedback of the observer `{observer}` is no polynomial of second degree in its gain")]
    NotPolynomial {
        /// The observer's kind.
        observer: String,
    },
    /// The setup does not build, or cannot host the observer.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// A matrix with an entry that is not finite.
    #[error("a matrix of {n} states has an entry that is not finite: it has no poles")]
    NotAMatrix {
        /// Size of the matrix.
        n: usize,
    },
}
