//! A decay that is wanted of an observer.
//!
//! Next file to read: [`super::gain`].

use super::SpectrumError;

/// Every error shrinks by a factor within a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decay {
    factor: f64,
    time: f64,
}

impl Decay {
    /// By `factor`, above 1, within `time`, above 0.
    ///
    /// # Errors
    /// When factor or time is none.
    pub fn new(factor: f64, time: f64) -> Result<Self, SpectrumError> {
        if factor.is_finite() && factor > 1.0 && time.is_finite() && time > 0.0 {
            Ok(Self { factor, time })
        } else {
            Err(SpectrumError::NoDecay { factor, time })
        }
    }

    /// The factor by which errors shrink.
    pub fn factor(self) -> f64 {
        self.factor
    }

    /// The time in which they do.
    pub fn time(self) -> f64 {
        self.time
    }

    /// The largest real part with which every error decays so: −ln(factor)/time.
    pub fn max_re(self) -> f64 {
        -self.factor.ln() / self.time
    }
}
