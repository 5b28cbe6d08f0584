//! The built-in effects: they grow from a model's roles, so that one entry serves every model that has its place for it.
//!
//! A study names one by `built_in`, or lets a search try them all. Adding an effect is one function in the file of its family
//! and one line in that family's list; being listed is being tested. Numbers that depend on how far a recording moves are
//! counted in a [`super::Scale`]. Next files to read: [`mechanics`] for how an effect is written, then
//! [`super::scale`].

mod draft;
mod generic;
mod haemodynamics;
mod hydraulics;
mod inputs;
mod levels;
mod mechanics;
mod place;
mod propulsion;
mod sensors;
mod specimen;
mod thermal;
mod unit;

use std::sync::OnceLock;

use super::{EffectDef, Target};
use crate::SetupError;
use crate::{Spec, nearest};

pub use mechanics::{MOST_SIGN_WIDTH, SIGN_WIDTH};
use place::Host;

/// Finds every place for one kind of effect in a model.
type Grow = fn(Host<'_>) -> Vec<EffectDef>;

/// Effects of one part of physics.
pub struct Family {
    /// Name.
    pub name: &'static str,
    /// What a model needs to host its effects, as one sentence.
    pub needs: &'static str,
    growers: &'static [Grow],
}

/// Every family of built-in effects.
pub const FAMILIES: &[Family] = &[
    Family {
        name: "mechanics",
        needs: "A state with the role velocity, for some effects also a displacement, a force or an inertia.",
        growers: mechanics::GROWERS,
    },
    Family {
        name: "hydraulics",
        needs: "Quantities with the roles level, pressure, flow or resistance.",
        growers: hydraulics::GROWERS,
    },
    Family { name: "thermal", needs: "A state with the role temperature.", growers: thermal::GROWERS },
    Family {
        name: "propulsion",
        needs: "A combustion chamber: quantities with roles such as throat-area, burn-rate or thrust.",
        growers: propulsion::GROWERS,
    },
    Family {
        name: "haemodynamics",
        needs: "A pressure, with a compliance or a flow.",
        growers: haemodynamics::GROWERS,
    },
    Family { name: "sensors", needs: "Any output of one component.", growers: sensors::GROWERS },
    Family { name: "inputs", needs: "Any input of one component.", growers: inputs::GROWERS },
    Family {
        name: GENERIC,
        needs: "States of one component, eight at most, that are no displacements. Tried where no other effect explains the gap.",
        growers: generic::GROWERS,
    },
];

/// Name of the family of terms that have no particular physics.
pub const GENERIC: &str = "generic";

/// Names of the families whose effects are errors of instruments.
pub const INSTRUMENTS: [&str; 2] = ["sensors", "inputs"];

/// Name of the family of a built-in effect.
pub fn family_of(effect: &str) -> Option<&'static str> {
    static STEMS: OnceLock<Vec<(String, &'static str)>> = OnceLock::new();
    let of = |family: &'static Family| family.catalogue().into_iter().map(|def| (def.name, family.name));
    let stems = STEMS.get_or_init(|| FAMILIES.iter().flat_map(of).collect());
    stems.iter().find(|(known, _)| known == stem(effect)).map(|(_, family)| *family)
}

impl Family {
    /// Name with a capital.
    pub fn title(&self) -> String {
        let (first, rest) = self.name.split_at(1);
        first.to_uppercase() + rest
    }

    /// One of every kind of effect of this family, as it enters an imagined model that has a place for it;
    /// the name is without the place.
    pub fn catalogue(&self) -> Vec<EffectDef> {
        let one = |grow: &Grow| -> Vec<EffectDef> {
            let grown =
                specimen::specimens().into_iter().flat_map(|spec| grow(Host { spec: &spec, time: "s" }));
            let mut kinds: Vec<EffectDef> = Vec::new();
            for mut effect in grown {
                effect.name.truncate(stem(&effect.name).len());
                if kinds.iter().all(|known| known.name != effect.name) {
                    kinds.push(effect);
                }
            }
            kinds
        };
        self.growers.iter().flat_map(one).collect()
    }

    /// Number of kinds of effects.
    pub fn n_grower(&self) -> usize {
        self.growers.len()
    }

    /// The effects of this family that a model can host. `time` is the label of the time unit.
    pub fn grow(&self, spec: &Spec, time: &str) -> Vec<EffectDef> {
        self.growers.iter().flat_map(|grow| grow(Host { spec, time })).collect()
    }
}

/// The built-in effects that this model can host, with time in seconds.
pub fn library(spec: &Spec) -> Vec<EffectDef> {
    library_in(spec, "s")
}

/// The built-in effects that this model can host. `time` is the label of the time unit; it only enters unit labels.
pub fn library_in(spec: &Spec, time: &str) -> Vec<EffectDef> {
    FAMILIES.iter().flat_map(|family| family.grow(spec, time)).collect()
}

/// Name of the kind of effect, without the place where it enters.
pub fn stem(name: &str) -> &str {
    name.split_once(':').map_or(name, |(stem, _)| stem)
}

/// Whether an effect can show in what is measured: one that adds only to outputs shows in these alone.
pub fn shows_in(def: &EffectDef, spec: &Spec, measured: &[String]) -> bool {
    def.adds.iter().any(|add| {
        let target = Target::of(add, def, spec, spec.parameters.len());
        target != Some(Target::Output) || measured.iter().any(|name| name == add.quantity())
    })
}

/// Writes out a definition: one that names a built-in effect becomes that effect, under its own name if it has one. Its numbers
/// go on counting in their scales: see [`super::scale`]. `time` is the label of the time unit; it only enters unit labels.
///
/// # Errors
/// When the model has no such built-in effect, or the definition also writes out terms.
pub fn write_out(def: &EffectDef, spec: &Spec, time: &str) -> Result<EffectDef, SetupError> {
    let Some(name) = &def.built_in else { return Ok(def.clone()) };
    if !(def.adds.is_empty() && def.parameters.is_empty() && def.states.is_empty()) {
        return Err(SetupError::Invalid(format!(
            "effect `{name}` is built in: give either `built_in` or its terms, parameters and states"
        )));
    }
    let library = library_in(spec, time);
    let Some(found) = library.iter().find(|effect| effect.name == *name) else {
        return Err(SetupError::Unknown {
            what: "effect",
            name: name.clone(),
            nearest: nearest(name, library.iter().map(|effect| &effect.name)),
        });
    };
    let name = if def.name.is_empty() { found.name.clone() } else { def.name.clone() };
    Ok(EffectDef { name, ..found.clone() })
}
