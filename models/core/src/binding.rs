//! Which value goes where: constants, defaults and a job's parameter vector against a model's parameters and initial states.
//!
//! Names are resolved once, when a setup is built; a run only follows indices. Next file to read: [`crate::simulator`].

use crate::SetupError;
use crate::setup::Setup;
use crate::{ModelFailure, Quantity, Spec, nearest};

/// Prefix of a name that gives a state its initial value.
const INITIAL: &str = "initial:";

/// Where one value goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// A parameter of the model.
    Parameter(usize),
    /// A state's initial value.
    Initial(usize),
}

/// The way from a job's values to a model's parameters and initial state.
#[derive(Debug)]
pub(crate) struct Binding {
    names: Vec<String>,
    /// Constants and defaults in the model's order; the places of estimated parameters hold zero until a job fills them.
    theta: Vec<f64>,
    targets: Vec<Target>,
    initial: Vec<(usize, f64)>,
}

impl Binding {
    /// Resolves every name of the setup against the model. `free` are names of constants used by terms of effects only.
    ///
    /// # Errors
    /// When a name is unknown or given twice, a constant is not finite or out of range, or a parameter has no value.
    pub(crate) fn new(setup: &Setup, spec: &Spec, free: &[String]) -> Result<Self, SetupError> {
        let mut theta: Vec<Option<f64>> = spec.parameters.iter().map(|q| q.default).collect();
        let mut initial = Vec::new();
        for (name, &value) in &setup.model.constants {
            match resolve(spec, name, "constant") {
                Ok(target) => {
                    check_value(quantity(spec, target), name, value)?;
                    match target {
                        Target::Parameter(i) => theta[i] = Some(value),
                        Target::Initial(i) => initial.push((i, value)),
                    }
                }
                Err(_) if free.contains(name) => check_value(None, name, value)?,
                Err(error) => return Err(error),
            }
        }
        let mut targets = Vec::with_capacity(setup.parameters.len());
        for (i, name) in setup.parameters.iter().enumerate() {
            if setup.parameters[..i].contains(name) {
                return Err(SetupError::Twice(name.clone()));
            }
            if setup.model.constants.contains_key(name) {
                return Err(SetupError::Invalid(format!(
                    "`{name}` is both a constant and an estimated parameter: remove one of the two"
                )));
            }
            let target = resolve(spec, name, "parameter")?;
            if let Target::Parameter(i) = target {
                theta[i] = Some(0.0);
            }
            targets.push(target);
        }
        let theta = spec.parameters.iter().zip(theta).map(|(q, value)| {
            value.ok_or_else(|| SetupError::Missing { model: spec.kind.clone(), name: q.name.clone() })
        });
        Ok(Self {
            names: setup.parameters.clone(),
            theta: theta.collect::<Result<_, _>>()?,
            targets,
            initial,
        })
    }

    /// The model's parameters: constants and defaults, zero for what a job gives.
    pub(crate) fn constants(&self) -> &[f64] {
        &self.theta
    }

    /// Names of the values in a job.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// Where each value of a job goes.
    pub(crate) fn targets(&self) -> &[Target] {
        &self.targets
    }

    /// States whose initial value a constant or a job gives.
    pub(crate) fn given(&self) -> impl Iterator<Item = usize> {
        let of_job = self.targets.iter().filter_map(|target| match *target {
            Target::Initial(i) => Some(i),
            Target::Parameter(_) => None,
        });
        self.initial.iter().map(|(i, _)| *i).chain(of_job)
    }

    /// Number of values in a job.
    pub(crate) fn len(&self) -> usize {
        self.targets.len()
    }

    /// The model's parameter vector for a job's values, at time `t`.
    ///
    /// # Errors
    /// When a value is not finite.
    pub(crate) fn theta(&self, values: &[f64], t: f64) -> Result<Vec<f64>, ModelFailure> {
        let mut theta = self.theta.clone();
        for ((target, &value), name) in self.targets.iter().zip(values).zip(&self.names) {
            if !value.is_finite() {
                return Err(ModelFailure::NotFinite { what: format!("parameter `{name}`"), time: t });
            }
            if let Target::Parameter(i) = *target {
                theta[i] = value;
            }
        }
        Ok(theta)
    }

    /// Overrides the model's initial state by the constants and by a job's values.
    pub(crate) fn initial(&self, values: &[f64], x: &mut [f64]) {
        for (i, value) in self.initial_values(values) {
            x[i] = value;
        }
    }

    /// The initial values that the constants and a job's values give, each with the place of its state; a later one counts.
    pub(crate) fn initial_values<'a>(&'a self, values: &'a [f64]) -> impl Iterator<Item = (usize, f64)> + 'a {
        let of_job = self.targets.iter().zip(values).filter_map(|(target, &value)| match *target {
            Target::Initial(i) => Some((i, value)),
            Target::Parameter(_) => None,
        });
        self.initial.iter().copied().chain(of_job)
    }
}

/// The quantity behind a target; a field's component is the field.
fn quantity(spec: &Spec, target: Target) -> Option<&Quantity> {
    match target {
        Target::Parameter(i) => spec.parameters.get(i),
        Target::Initial(i) => spec.states.iter().find(|q| Spec::offset(&spec.states, &q.name) == Some(i)),
    }
}

/// Finds the parameter or `initial:<state>` of this name.
fn resolve(spec: &Spec, name: &str, what: &'static str) -> Result<Target, SetupError> {
    if let Some(i) = spec.parameters.iter().position(|q| q.name == name) {
        return Ok(Target::Parameter(i));
    }
    if let Some(state) = name.strip_prefix(INITIAL) {
        return match Spec::range_of(&spec.states, state) {
            Some(range) if range.len() == 1 => Ok(Target::Initial(range.start)),
            Some(range) => Err(SetupError::Invalid(format!(
                "`{name}`: state `{state}` has {} components; name one, such as `{name}[0]`",
                range.len()
            ))),
            None => Err(SetupError::Unknown {
                what: "state",
                name: state.to_owned(),
                nearest: nearest(state, spec.states.iter().map(|q| &q.name)),
            }),
        };
    }
    let parameters = spec.parameters.iter().map(|q| q.name.clone());
    let states = spec.states.iter().map(|q| format!("{INITIAL}{}", q.name));
    Err(SetupError::Unknown { what, name: name.to_owned(), nearest: nearest(name, parameters.chain(states)) })
}

/// Refuses a constant that is not finite or that physics forbids.
fn check_value(quantity: Option<&Quantity>, name: &str, value: f64) -> Result<(), SetupError> {
    if !value.is_finite() {
        return Err(SetupError::Invalid(format!("constant `{name}` is {value}: give a finite number")));
    }
    match quantity {
        Some(q) if value < q.range[0] || value > q.range[1] => Err(SetupError::Invalid(format!(
            "constant `{name}` is {value}, outside its range ({})",
            q.range_text()
        ))),
        _ => Ok(()),
    }
}
