//! Parameters of effects that do not count in the model's units: their ranges hold only once a recording has given the scale.
//!
//! Next file to read: [`super::scales`], which measures.

use starlings_models::effect::{EffectParameter, Scale};
use starlings_models::{EffectDef, Spec};

/// A range without bounds.
pub(super) const OPEN: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// The parameters of effects that do not count in the model's units.
pub(crate) fn relative(effects: &[EffectDef]) -> impl Iterator<Item = &EffectParameter> {
    effects.iter().flat_map(|effect| &effect.parameters).filter(|p| p.scale != Scale::Absolute)
}

/// Opens the ranges of parameters that do not count in the model's units: their scale is not known yet.
pub(crate) fn open(spec: &mut Spec, effects: &[EffectDef]) {
    for parameter in relative(effects) {
        if let Some(quantity) = spec.parameters.iter_mut().find(|q| q.name == parameter.name) {
            quantity.range = OPEN;
        }
    }
}
