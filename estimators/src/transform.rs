//! Parameter transforms: a value with physical limits becomes a number without limits, in which the prior is Gaussian.
//!
//! Deliberately scalar: parameters are transformed one by one. Medians and intervals are reported by transforming
//! mean +- k sd, which is exact because every transform is monotonic. Read next: `gaussian.rs`.

use std::f64::consts::LN_2;
use std::fmt;

/// Map between a physical value v and its transformed value theta.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Transform {
    /// v = exp(theta), positive values.
    Log,
    /// v = 2^theta, positive values; theta counts octaves.
    Log2,
    /// v = theta.
    Linear,
    /// v = lo + (hi - lo) / (1 + exp(-theta)), values between two bounds.
    Logit {
        /// Lower bound, not reached.
        lo: f64,
        /// Upper bound, not reached.
        hi: f64,
    },
}

/// As a study has it: the name, of a logit with its bounds.
impl fmt::Display for Transform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Logit { lo, hi } => write!(f, "{}({lo:?}, {hi:?})", self.name()),
            _ => f.write_str(self.name()),
        }
    }
}

impl Transform {
    /// The names, in the order of the variants.
    pub const NAMES: [&'static str; 4] = ["log", "log2", "linear", "logit"];

    /// The name of this transform.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Log => Self::NAMES[0],
            Self::Log2 => Self::NAMES[1],
            Self::Linear => Self::NAMES[2],
            Self::Logit { .. } => Self::NAMES[3],
        }
    }

    /// Physical value of a transformed one.
    pub fn to_physical(&self, theta: f64) -> f64 {
        match *self {
            Self::Log => theta.exp(),
            Self::Log2 => theta.exp2(),
            Self::Linear => theta,
            Self::Logit { lo, hi } => {
                // Each bound is approached from its own side, so that no digit is lost close to either.
                let v = if theta > 0.0 {
                    hi - (hi - lo) / (1.0 + theta.exp())
                } else {
                    lo + (hi - lo) / (1.0 + (-theta).exp())
                };
                // Beyond about 37 the distance to the bound is lost in rounding.
                if v <= lo {
                    lo.next_up()
                } else if v >= hi {
                    hi.next_down()
                } else {
                    v
                }
            }
        }
    }

    /// Transformed value of a physical one; NaN or infinite outside the domain (see [`Transform::contains`]).
    pub fn to_transformed(&self, value: f64) -> f64 {
        match *self {
            Self::Log => value.ln(),
            Self::Log2 => value.log2(),
            Self::Linear => value,
            Self::Logit { lo, hi } => ((value - lo) / (hi - value)).ln(),
        }
    }

    /// Derivative dv/dtheta at a transformed value: the physical sd is about this times the transformed sd.
    pub fn derivative(&self, theta: f64) -> f64 {
        match *self {
            Self::Log => theta.exp(),
            Self::Log2 => LN_2 * theta.exp2(),
            Self::Linear => 1.0,
            Self::Logit { lo, hi } => {
                let e = (-theta.abs()).exp();
                (hi - lo) * e / ((1.0 + e) * (1.0 + e))
            }
        }
    }

    /// Does the value have a finite transform?
    pub fn contains(&self, value: f64) -> bool {
        match *self {
            Self::Log | Self::Log2 => value > 0.0 && value.is_finite(),
            Self::Linear => value.is_finite(),
            Self::Logit { lo, hi } => lo < value && value < hi,
        }
    }
}
