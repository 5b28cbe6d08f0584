//! The noise of a model made of expressions: which source moves which state, and how much.
//!
//! Next file to read: [`super::model`].

use super::expression::Expression;
use super::parsed::{Parsed, Placed};
use super::program::Program;
use crate::SetupError;

/// Sources of white noise and the amplitudes that are not zero.
#[derive(Clone, Debug, Default)]
pub(super) struct Noise {
    /// Names, in the order of first use.
    pub(super) sources: Vec<String>,
    pub(super) amplitudes: Vec<Amplitude>,
}

/// How much one source moves one state.
#[derive(Clone, Debug)]
pub(super) struct Amplitude {
    pub(super) state: usize,
    pub(super) source: usize,
    pub(super) value: Program,
}

impl Noise {
    pub(super) fn new(
        parsed: &Parsed,
        compile: impl Fn(&Placed) -> Result<(Expression, Program), SetupError>,
    ) -> Result<Self, SetupError> {
        let mut noise = Self::default();
        for (state, all) in parsed.noise.iter().enumerate() {
            for (name, placed) in all {
                let source = noise.sources.iter().position(|known| known == name).unwrap_or_else(|| {
                    noise.sources.push(name.clone());
                    noise.sources.len() - 1
                });
                noise.amplitudes.push(Amplitude { state, source, value: compile(placed)?.1 });
            }
        }
        Ok(noise)
    }
}
