//! The unit labels of a model, and what its equations and effects say against them.
//!
//! A mismatch is something to tell, never a refusal: wherever one side has no label, or one that cannot be read, nothing is
//! said. Next file to read: [`super::system`].

use std::collections::BTreeMap;
use std::fmt;

use super::Unit;
use crate::equations::dimension::{Conflict, Measure, Scope, measure};
use crate::equations::{EquationsDef, Expression};
use crate::{EffectDef, Spec, effect};

/// Labels of names, and of time.
#[derive(Clone, Debug, Default)]
pub struct Labels {
    units: BTreeMap<String, (String, Option<Unit>)>,
    time: (String, Option<Unit>),
    /// Whether labels hold with their factors; else they only tell dimensions.
    exact: bool,
}

/// A term whose unit is not what its place asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mismatch {
    /// Where it stands, such as ``term `drive` of the rate of `v` ``.
    pub place: String,
    /// The expression.
    pub term: String,
    /// Which part of it; `it` for all of it.
    pub part: String,
    /// The unit found.
    pub found: String,
    /// The unit expected.
    pub expected: String,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { place, term, part, found, expected } = self;
        write!(f, "{place}, `{term}`: {part} is in {found}, expected {expected}")
    }
}

/// What an expression is added to or is the value of.
struct Target {
    unit: Measure,
    text: String,
}

impl Labels {
    /// The labels of a model's states, outputs, inputs and parameters. `exact`: the model is written for exactly these units,
    /// as equations of a study are, and not for any consistent system.
    pub fn new(spec: &Spec, time: &str, exact: bool) -> Self {
        let mut labels = Self { time: (time.to_owned(), Unit::parse(time)), exact, ..Self::default() };
        // A state's name may also be an output's.
        for q in [&spec.outputs, &spec.parameters, &spec.inputs, &spec.states].into_iter().flatten() {
            labels.put(&q.name, &q.unit);
        }
        labels
    }

    /// Gives a name a label; an empty one changes nothing.
    pub fn put(&mut self, name: &str, label: &str) {
        if !label.is_empty() {
            self.units.insert(name.to_owned(), (label.to_owned(), Unit::parse(label)));
        }
    }

    /// Gives a name a label unless it has one that can be read, of another dimension.
    pub fn refine(&mut self, name: &str, label: &str) {
        let known = self.units.get(name).and_then(|(_, unit)| *unit);
        let given = Unit::parse(label);
        if known.zip(given).is_none_or(|(a, b)| a.same_dimension(&b)) {
            self.put(name, label);
        }
    }

    /// What the equations say against the labels.
    pub fn equations(&self, def: &EquationsDef) -> Vec<Mismatch> {
        let mut list = Vec::new();
        for state in &def.states {
            let name = &state.name;
            self.check(&format!("initial value of `{name}`"), &state.initial, &self.value(name), &mut list);
            for (term, text) in &state.rate {
                let one = state.rate.len() == 1 && term == name;
                let place = if one {
                    format!("rate of `{name}`")
                } else {
                    format!("term `{term}` of the rate of `{name}`")
                };
                self.check(&place, text, &self.rate(name), &mut list);
            }
        }
        for output in &def.outputs {
            self.check(
                &format!("output `{}`", output.name),
                &output.value,
                &self.value(&output.name),
                &mut list,
            );
        }
        list
    }

    /// What an effect, written out, says against the labels of the model that it is added to.
    pub fn effect(&self, def: &EffectDef, spec: &Spec) -> Vec<Mismatch> {
        let mut labels = self.clone();
        let own = def.parameters.iter().map(|p| (&p.name, &p.unit));
        for (name, unit) in own.chain(def.states.iter().map(|s| (&s.name, &s.unit))) {
            if !labels.units.contains_key(name) {
                labels.put(name, unit);
            }
        }
        let mut list = Vec::new();
        for add in &def.adds {
            let place = format!("effect `{}`, added to `{}`", def.name, add.to);
            let target = match effect::Target::of(add, def, spec, spec.parameters.len()) {
                Some(effect::Target::Rate) => labels.rate(&add.to),
                _ => labels.value(add.quantity()),
            };
            labels.check(&place, &add.term, &target, &mut list);
        }
        for state in &def.states {
            let place = |what: &str| format!("effect `{}`, {what} of `{}`", def.name, state.name);
            labels.check(&place("rate"), &state.rate, &labels.rate(&state.name), &mut list);
            labels.check(&place("initial value"), &state.initial, &labels.value(&state.name), &mut list);
        }
        list
    }

    fn measure(&self, unit: Option<Unit>) -> Measure {
        unit.map_or(Measure::Unknown, |unit| Measure::Known { unit, exact: self.exact })
    }

    fn of(&self, name: &str) -> Measure {
        self.measure(self.units.get(name).and_then(|(_, unit)| *unit))
    }

    fn value(&self, name: &str) -> Target {
        let label = self.units.get(name).map(|(label, _)| label.clone());
        Target { unit: self.of(name), text: label.unwrap_or_default() }
    }

    fn rate(&self, name: &str) -> Target {
        let value = self.value(name);
        let simple = value.text.chars().all(char::is_alphabetic);
        let per = if simple { "/" } else { " per " };
        let time = self.measure(self.time.1);
        Target { unit: value.unit.combined(time, -1.0), text: format!("{}{per}{}", value.text, self.time.0) }
    }

    fn check(&self, place: &str, text: &str, target: &Target, list: &mut Vec<Mismatch>) {
        let Ok(expression) = Expression::parse(text) else { return };
        let of = |name: &str| self.of(name);
        let mut conflicts = Vec::new();
        let found = measure(&expression, &Scope { of: &of, time: self.measure(self.time.1) }, &mut conflicts);
        let mut tell = |part: &str, found: String, expected: String| {
            list.push(Mismatch {
                place: place.to_owned(),
                term: text.to_owned(),
                part: part.to_owned(),
                found,
                expected,
            });
        };
        for Conflict { part, found, expected } in &conflicts {
            if let (Some(found), Some(expected)) = (found.text(), expected.text()) {
                tell(part, found, expected);
            }
        }
        if !found.goes_with(target.unit)
            && let Some(computed) = found.text()
        {
            // A name alone is told by its own label.
            let label =
                self.units.get(text.trim_matches([' ', '-', '(', ')'])).map(|(label, _)| label.clone());
            tell("it", label.unwrap_or(computed), target.text.clone());
        }
    }
}
