//! The built-in effects: they grow from a model's roles, so that one entry serves every model that has its place for it.
//!
//! A study names one by `built_in`, or lets a search try them all. Adding an effect is one function and one line in
//! `GROWERS`. Next file to read: [`crate::catalogue`].

use super::{Addition, EffectDef, EffectParameter};
use crate::setup::SetupError;
use crate::{Quantity, Role, Spec, nearest};

/// Finds every place for one kind of effect in a model.
type Grow = fn(&Spec) -> Vec<EffectDef>;

/// Every kind of built-in effect.
const GROWERS: &[Grow] = &[series_resistance];

/// The built-in effects that this model can host.
pub fn library(spec: &Spec) -> Vec<EffectDef> {
    GROWERS.iter().flat_map(|grow| grow(spec)).collect()
}

/// Writes out a definition: one that names a built-in effect becomes that effect, under its own name if it has one.
///
/// # Errors
/// When the model has no such built-in effect, or the definition also writes out terms.
pub fn write_out(def: &EffectDef, spec: &Spec) -> Result<EffectDef, SetupError> {
    let Some(name) = &def.built_in else { return Ok(def.clone()) };
    if !(def.adds.is_empty() && def.parameters.is_empty() && def.states.is_empty()) {
        return Err(SetupError::Invalid(format!(
            "effect `{name}` is built in: give either `built_in` or its terms, parameters and states"
        )));
    }
    let library = library(spec);
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

/// A pressure drop Rs q at the place where a flow enters and its pressure is measured.
fn series_resistance(spec: &Spec) -> Vec<EffectDef> {
    places(&spec.outputs, Role::Pressure, &spec.inputs, Role::Flow)
        .map(|place| EffectDef {
            name: place.named("series-resistance", ':'),
            says: format!("Part of the pressure is lost in proportion to the {}.", place.cause.name),
            adds: vec![Addition {
                to: place.host.name.clone(),
                term: format!("{}*{}", place.named("Rs", '_'), place.cause.name),
            }],
            parameters: vec![EffectParameter {
                name: place.named("Rs", '_'),
                unit: over(&place.host.unit, &place.cause.unit),
                range: [0.0, f64::INFINITY],
                grid: Vec::new(),
            }],
            confounders: vec![
                "a characteristic impedance".to_owned(),
                "a flow-dependent sensor error".to_owned(),
            ],
            ..EffectDef::default()
        })
        .collect()
}

/// A quantity that an effect can add to, and the one that causes it.
struct Place<'a> {
    host: &'a Quantity,
    cause: &'a Quantity,
    /// Whether the model has no other such pair, so that names need no suffix.
    only: bool,
}

impl Place<'_> {
    /// `stem`, with the names of the pair when there are several.
    fn named(&self, stem: &str, separator: char) -> String {
        if self.only {
            return stem.to_owned();
        }
        let (host, cause) = (&self.host.name, &self.cause.name);
        format!("{stem}{separator}{host}{separator}{cause}")
    }
}

/// Every pair of scalar quantities with these roles.
fn places<'a>(
    hosts: &'a [Quantity],
    host_role: Role,
    causes: &'a [Quantity],
    cause_role: Role,
) -> impl Iterator<Item = Place<'a>> {
    let of = |list: &'a [Quantity], role: Role| -> Vec<&'a Quantity> {
        list.iter().filter(|q| q.role == role && q.size == 1).collect()
    };
    let (hosts, causes) = (of(hosts, host_role), of(causes, cause_role));
    let only = hosts.len() * causes.len() == 1;
    hosts
        .into_iter()
        .flat_map(move |host| causes.clone().into_iter().map(move |cause| Place { host, cause, only }))
}

/// The unit of a quantity per another, as text: `mmHg` over `mL/s` is `mmHg s/mL`.
fn over(unit: &str, per: &str) -> String {
    match (unit, per.split_once('/')) {
        ("", _) => String::new(),
        (_, None) if per.is_empty() => unit.to_owned(),
        (_, None) => format!("{unit}/{per}"),
        (_, Some((amount, time))) => format!("{unit} {time}/{amount}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Model;
    use crate::native::{Oscillator, Windkessel2};

    #[test]
    fn a_pressure_outlet_with_a_flow_hosts_a_series_resistance() {
        let library = library(Windkessel2::default().spec());
        assert_eq!(library.len(), 1);
        assert_eq!(library[0].adds, [Addition { to: "pressure".to_owned(), term: "Rs*flow".to_owned() }]);
        assert_eq!(library[0].parameters[0].unit, "mmHg s/mL");
    }

    #[test]
    fn an_oscillator_hosts_no_series_resistance() {
        assert!(library(Oscillator::default().spec()).is_empty());
    }

    #[test]
    fn two_outlets_get_names_of_their_own() {
        let mut spec = Windkessel2::default().spec().clone();
        spec.outputs.push(Quantity::new("distal", "mmHg").role(Role::Pressure));
        let names: Vec<String> = library(&spec).into_iter().map(|effect| effect.name).collect();
        assert_eq!(names, ["series-resistance:pressure:flow", "series-resistance:distal:flow"]);
    }

    #[test]
    fn a_mistyped_built_in_effect_offers_the_nearest() {
        let def = EffectDef { built_in: Some("serial-resistance".to_owned()), ..EffectDef::default() };
        let error = write_out(&def, Windkessel2::default().spec()).expect_err("typo");
        assert!(error.to_string().contains("did you mean `series-resistance`"), "{error}");
    }
}
