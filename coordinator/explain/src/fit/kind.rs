//! The kinds of effects, and how likely each is before any data: a prior over explanations.
//!
//! An effect that the study describes was written for this system. One of the library fits the roles of its quantities, a generic
//! term fits any equation, an instrument's error can imitate almost anything, and a proposal was made to fit. Each is held a third as likely as the one before:
//! enough to settle what the data leave open, far too little against what they show. Next file to read: [`super::candidate`].

use serde::{Deserialize, Serialize};
use starlings_models::effect::library::{GENERIC, INSTRUMENTS, family_of};

/// Odds of a kind against the next one, as a fall of χ²: 2 ln 3.
const STEP: f64 = 2.197_224_577_336_219;

/// Where an effect comes from, the likelier first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Described in the study.
    #[default]
    Study,
    /// Of the library, grown from the roles of the model's quantities.
    Library,
    /// A term of no particular physics.
    Generic,
    /// An error of a sensor or of a recorded input.
    Instrument,
    /// A term that nobody listed, made from these very data.
    Proposal,
}

impl Kind {
    /// The kind of an effect of the library.
    pub(crate) fn built_in(name: &str) -> Self {
        match family_of(name) {
            Some(family) if family == GENERIC => Self::Generic,
            Some(family) if INSTRUMENTS.contains(&family) => Self::Instrument,
            _ => Self::Library,
        }
    }

    /// Whether it describes a dependence and no physics.
    pub(crate) fn is_of_no_field(self) -> bool {
        matches!(self, Self::Generic | Self::Proposal)
    }

    /// Whether it stands for a cause in the equation that it enters, as no error of an instrument does.
    pub(crate) fn is_of_a_field(self) -> bool {
        matches!(self, Self::Study | Self::Library)
    }

    /// What the prior takes from the support of an effect of this kind, in χ².
    pub(crate) fn price(self) -> f64 {
        STEP * f64::from(self as u8)
    }

    /// The kind in words, of several effects.
    pub(crate) fn plural(self) -> &'static str {
        match self {
            Self::Study => "effects of the study",
            Self::Library => "effects of the library",
            Self::Generic => "generic terms",
            Self::Instrument => "errors of instruments",
            Self::Proposal => "proposals",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_of_the_library_have_the_kind_of_their_family_wherever_they_enter() {
        assert_eq!(Kind::built_in("quadratic-drag:v2"), Kind::Library);
        assert_eq!(Kind::built_in("loss:X"), Kind::Generic);
        assert_eq!(
            (Kind::built_in("sensor-gain"), Kind::built_in("input-delay:q")),
            (Kind::Instrument, Kind::Instrument)
        );
    }

    #[test]
    fn every_kind_is_a_third_as_likely_as_the_one_before() {
        let kinds = [Kind::Study, Kind::Library, Kind::Generic, Kind::Instrument, Kind::Proposal];
        for (k, kind) in (0..).zip(kinds) {
            assert!((kind.price() - 2.0 * 3.0_f64.powi(k).ln()).abs() < 1e-12, "{kind:?}");
        }
        assert!(kinds.is_sorted());
    }
}
