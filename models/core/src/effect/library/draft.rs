//! An effect in the making, so that a grower reads like the sentence that it stands for.
//!
//! Nothing is checked here: the family test builds every effect of the library. Next file to read: [`super::mechanics`].

use super::place::EffectPlace;
use crate::EffectDef;
use crate::effect::{Addition, EffectParameter, EffectState, Scale};

/// A coefficient that may have either sign.
pub(super) const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// A coefficient that physics does not let be negative.
pub(super) const POSITIVE: [f64; 2] = [0.0, f64::INFINITY];

/// An effect in the making.
pub(super) struct Draft(EffectDef);

impl Draft {
    /// Begins an effect at a place. `says` is one plain sentence.
    pub(super) fn new(place: &EffectPlace<'_>, stem: &str, says: impl Into<String>) -> Self {
        Self(EffectDef { name: place.effect(stem), says: says.into(), ..EffectDef::default() })
    }

    /// Adds a term to a state's rate, an output, an input or a parameter.
    pub(super) fn adds(mut self, to: &str, term: impl Into<String>) -> Self {
        self.0.adds.push(Addition { to: to.to_owned(), term: term.into() });
        self
    }

    /// Adds a coefficient; the first one is the amplitude.
    pub(super) fn coefficient(
        mut self,
        name: &str,
        unit: impl Into<String>,
        range: [f64; 2],
        says: &str,
    ) -> Self {
        self.0.parameters.push(EffectParameter {
            name: name.to_owned(),
            unit: unit.into(),
            range,
            says: says.to_owned(),
            ..EffectParameter::default()
        });
        self
    }

    /// Lets the range of the last coefficient count in a scale.
    pub(super) fn counted_in(mut self, scale: Scale) -> Self {
        if let Some(parameter) = self.0.parameters.last_mut() {
            parameter.scale = scale;
        }
        self
    }

    /// Adds a parameter inside a term. Its grid, whose middle entry is the default, and its range count in `scale`.
    pub(super) fn inner(
        mut self,
        name: &str,
        unit: impl Into<String>,
        (range, grid): ([f64; 2], &[f64]),
        scale: Scale,
        says: &str,
    ) -> Self {
        self.0.parameters.push(EffectParameter {
            name: name.to_owned(),
            unit: unit.into(),
            range,
            grid: grid.to_vec(),
            scale,
            says: says.to_owned(),
            ..EffectParameter::default()
        });
        self
    }

    /// Adds the width over which a term rounds a corner.
    pub(super) fn rounding(
        self,
        name: &str,
        unit: &str,
        (range, tried): ([f64; 2], f64),
        scale: Scale,
        says: &str,
    ) -> Self {
        let mut draft = self.inner(name, unit, (range, &[tried]), scale, says);
        if let Some(parameter) = draft.0.parameters.last_mut() {
            parameter.is_rounding = true;
        }
        draft
    }

    /// Adds the instant at which something changes; neither end of the record can tell it.
    pub(super) fn instant(self, name: &str, time: &str) -> Self {
        self.inner(name, time, ([0.02, 0.98], &[0.25, 0.5, 0.75]), Scale::Record, "When it changes.")
    }

    /// Adds the instant at which something jumps.
    pub(super) fn jump(self, name: &str, time: &str) -> Self {
        self.inner(name, time, ([0.02, 0.98], &[0.25, 0.5, 0.75]), Scale::Jump, "When it jumps.")
    }

    /// Adds the record's start, which is no unknown.
    pub(super) fn record_start(self, name: &str, time: &str) -> Self {
        self.inner(name, time, ([0.0, 0.0], &[0.0]), Scale::Record, "Start of the record.")
    }

    /// Adds a state of the effect's own.
    pub(super) fn state(
        mut self,
        name: &str,
        unit: impl Into<String>,
        initial: impl Into<String>,
        rate: impl Into<String>,
    ) -> Self {
        self.0.states.push(EffectState {
            name: name.to_owned(),
            unit: unit.into(),
            initial: initial.into(),
            rate: rate.into(),
        });
        self
    }

    /// Names what can look the same in data: stems of effects or names of parameters.
    pub(super) fn confounders(mut self, names: &[&str]) -> Self {
        self.0.confounders.extend(names.iter().map(|name| (*name).to_owned()));
        self
    }

    /// Ends the effect with the source of its form: author, year, place.
    pub(super) fn source(mut self, citation: &str) -> EffectDef {
        citation.clone_into(&mut self.0.source);
        self.0
    }
}
