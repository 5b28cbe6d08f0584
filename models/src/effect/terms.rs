//! An effect evaluated by its compiled terms.
//!
//! Names are resolved against the extended model: its states, parameters, inputs and outputs, then the study's constants.
//! Next file to read: [`super::extended`].

use std::collections::BTreeMap;

use super::{Addition, Effect, EffectDef, Moment, Touches};
use crate::equations::expression::{At, Direction, Expression, ExpressionError, Program, Slot};
use crate::model::Drive;
use crate::setup::SetupError;
use crate::{Quantity, Spec, nearest};

/// One effect, made of expressions.
pub struct TermEffect {
    def: EffectDef,
    touches: Touches,
    rates: Vec<(usize, Program)>,
    outputs: Vec<(usize, Program)>,
    inputs: Vec<(usize, Program)>,
    initial: Vec<(usize, Program)>,
    switches: Vec<Program>,
}

/// What the expressions of an effect may name.
#[derive(Clone, Copy)]
pub struct Scope<'a> {
    /// The model with the states and parameters of all effects.
    pub spec: &'a Spec,
    /// Fixed values that are no parameter of the model.
    pub constants: &'a BTreeMap<String, f64>,
}

/// Which names an expression may use.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Reach {
    /// Everything.
    All,
    /// Everything but outputs, which depend on the input that the term changes.
    NoOutputs,
    /// Parameters and constants.
    Fixed,
}

impl Scope<'_> {
    fn slot(self, name: &str, reach: Reach) -> Option<Slot> {
        let scalar = |list: &[Quantity]| {
            let q = list.iter().find(|q| q.name == name)?;
            (q.size == 1).then(|| Spec::offset(list, name))?
        };
        let spec = self.spec;
        let parameter = || spec.parameters.iter().position(|q| q.name == name).map(Slot::Parameter);
        let constant = || self.constants.get(name).map(|&value| Slot::Constant(value));
        if reach == Reach::Fixed {
            return parameter().or_else(constant);
        }
        let output = || if reach == Reach::All { scalar(&spec.outputs).map(Slot::Output) } else { None };
        scalar(&spec.states)
            .map(Slot::State)
            .or_else(parameter)
            .or_else(|| scalar(&spec.inputs).map(Slot::Input))
            .or_else(output)
            .or_else(constant)
    }

    fn names(self, reach: Reach) -> Vec<String> {
        let spec = self.spec;
        let lists = [&spec.states, &spec.parameters, &spec.inputs, &spec.outputs];
        let all = lists.into_iter().flatten().map(|q| q.name.clone());
        all.chain(self.constants.keys().cloned()).filter(|name| self.slot(name, reach).is_some()).collect()
    }

    /// Compiles one expression; `place` says in an error where it stands.
    fn compile(self, text: &str, reach: Reach, place: &str) -> Result<Program, SetupError> {
        Expression::parse(text)
            .and_then(|expression| self.program(&expression, reach))
            .map_err(|error| located(place, text, error))
    }

    fn program(self, expression: &Expression, reach: Reach) -> Result<Program, ExpressionError> {
        let resolve = |name: &str| self.slot(name, reach);
        let close = |name: &str| nearest(name, self.names(reach));
        expression.compile(&resolve, &close)
    }

    /// Compiles the switching functions of one expression.
    fn switches(self, text: &str, place: &str) -> Result<Vec<Program>, SetupError> {
        let compiled = || -> Result<Vec<Program>, ExpressionError> {
            let functions = Expression::parse(text)?.discontinuities();
            functions.iter().map(|g| self.program(g, Reach::All)).collect()
        };
        compiled().map_err(|error| located(place, text, error))
    }
}

fn located(place: &str, text: &str, error: ExpressionError) -> SetupError {
    SetupError::Expression {
        place: place.to_owned(),
        expression: text.to_owned(),
        column: error.column,
        message: error.message,
    }
}

/// Every name that the expressions of these effects use.
///
/// # Errors
/// When an expression does not parse.
pub(crate) fn names(defs: &[EffectDef]) -> Result<Vec<String>, SetupError> {
    let mut names = Vec::new();
    for def in defs {
        let place = format!("effect {}", def.name);
        let terms = def.adds.iter().map(|a| &a.term);
        let states = def.states.iter().flat_map(|s| [&s.rate, &s.initial]);
        for text in terms.chain(states).filter(|text| !text.is_empty()) {
            let expression = Expression::parse(text).map_err(|error| located(&place, text, error))?;
            names.extend(expression.names().into_iter().map(|(name, _)| name));
        }
    }
    Ok(names)
}

impl TermEffect {
    /// Compiles the terms of `def` against the extended model.
    ///
    /// # Errors
    /// When a term adds to something the model does not have, or an expression is wrong.
    pub fn new(def: &EffectDef, scope: Scope<'_>) -> Result<Self, SetupError> {
        let mut effect = Self {
            def: def.clone(),
            touches: Touches::default(),
            rates: Vec::new(),
            outputs: Vec::new(),
            inputs: Vec::new(),
            initial: Vec::new(),
            switches: Vec::new(),
        };
        for add in &def.adds {
            effect.add(add, scope)?;
        }
        for state in &def.states {
            let place = format!("effect {}, state {}", def.name, state.name);
            let at = Spec::offset(&scope.spec.states, &state.name).unwrap_or_default();
            let rate_place = format!("{place}, rate");
            effect.rates.push((at, scope.compile(&state.rate, Reach::All, &rate_place)?));
            effect.switches.extend(scope.switches(&state.rate, &rate_place)?);
            if !state.initial.is_empty() {
                let program = scope.compile(&state.initial, Reach::Fixed, &format!("{place}, initial"))?;
                effect.initial.push((at, program));
            }
        }
        effect.check_parameters_used()?;
        effect.touches = effect.find_touches(scope)?;
        Ok(effect)
    }

    /// Compiles one term into the list of what it is added to: a state's rate, an output or an input.
    fn add(&mut self, add: &Addition, scope: Scope<'_>) -> Result<(), SetupError> {
        let spec = scope.spec;
        let place = format!("effect {}, added to {}", self.def.name, add.to);
        let compile = |reach| scope.compile(&add.term, reach, &place);
        if let Some(i) = target(&spec.states, &add.to)? {
            self.rates.push((i, compile(Reach::All)?));
            self.switches.extend(scope.switches(&add.term, &place)?);
        } else if let Some(i) = target(&spec.outputs, &add.to)? {
            self.outputs.push((i, compile(Reach::All)?));
        } else if let Some(i) = target(&spec.inputs, &add.to)? {
            self.inputs.push((i, compile(Reach::NoOutputs)?));
            self.switches.extend(scope.switches(&add.term, &place)?);
        } else {
            let lists = [&spec.states, &spec.outputs, &spec.inputs];
            return Err(SetupError::Unknown {
                what: "state, output or input",
                name: add.to.clone(),
                nearest: nearest(&add.to, lists.into_iter().flatten().map(|q| &q.name)),
            });
        }
        Ok(())
    }

    /// Refuses a parameter that no expression uses: it could never be estimated.
    fn check_parameters_used(&self) -> Result<(), SetupError> {
        let used = names(std::slice::from_ref(&self.def))?;
        match self.def.parameters.iter().find(|parameter| !used.contains(&parameter.name)) {
            Some(parameter) => Err(SetupError::Invalid(format!(
                "parameter `{}` of effect `{}` stands in none of its terms",
                parameter.name, self.def.name
            ))),
            None => Ok(()),
        }
    }

    fn find_touches(&self, scope: Scope<'_>) -> Result<Touches, SetupError> {
        let used = names(std::slice::from_ref(&self.def))?;
        let is_output = |name: &String| matches!(scope.slot(name, Reach::All), Some(Slot::Output(_)));
        Ok(Touches {
            rates: !self.rates.is_empty(),
            outputs: !self.outputs.is_empty(),
            inputs: !self.inputs.is_empty(),
            reads_outputs: used.iter().any(is_output),
            inputs_follow_states: inputs_follow_states(&self.def, scope)?,
        })
    }
}

/// Whether a term that adds to an input uses a state.
fn inputs_follow_states(def: &EffectDef, scope: Scope<'_>) -> Result<bool, SetupError> {
    let has = |list: &[Quantity], name: &str| list.iter().any(|q| q.name == name);
    let (states, outputs) = (&scope.spec.states, &scope.spec.outputs);
    let to_inputs = def.adds.iter().filter(|a| !has(states, &a.to) && !has(outputs, &a.to));
    let alone = EffectDef { adds: to_inputs.cloned().collect(), ..EffectDef::default() };
    Ok(names(&[alone])?.iter().any(|name| matches!(scope.slot(name, Reach::All), Some(Slot::State(_)))))
}

/// Position of a scalar quantity that a term can be added to.
fn target(list: &[Quantity], name: &str) -> Result<Option<usize>, SetupError> {
    match list.iter().find(|q| q.name == name) {
        Some(q) if q.size > 1 => Err(SetupError::Invalid(format!(
            "a term cannot be added to `{name}`: it has {} components and an expression has one",
            q.size
        ))),
        Some(_) => Ok(Spec::offset(list, name)),
        None => Ok(None),
    }
}

fn at(moment: Moment<'_>) -> At<'_> {
    At { t: moment.t, x: moment.x, theta: moment.theta, u: moment.u, y: moment.y }
}

impl Effect for TermEffect {
    fn def(&self) -> &EffectDef {
        &self.def
    }

    fn touches(&self) -> Touches {
        self.touches
    }

    fn initial(&self, theta: &[f64], x: &mut [f64]) {
        for (i, program) in &self.initial {
            x[*i] = program.eval(&At { t: 0.0, x: &[], theta, u: Drive::NONE, y: &[] });
        }
    }

    fn add_to_inputs(&self, moment: Moment<'_>, rate: &[f64], value: &mut [f64], slope: &mut [f64]) {
        let along = Direction { t: 1.0, x: rate, theta: &[], u: moment.u.slope, y: &[] };
        for (i, program) in &self.inputs {
            let (term, term_slope) = program.eval_dual(&at(moment), &along);
            value[*i] += term;
            slope[*i] += term_slope;
        }
    }

    fn add_to_rates(&self, moment: Moment<'_>, dx: &mut [f64]) {
        for (i, program) in &self.rates {
            dx[*i] += program.eval(&at(moment));
        }
    }

    fn add_to_outputs(&self, moment: Moment<'_>, y: &mut [f64]) {
        for (i, program) in &self.outputs {
            y[*i] += program.eval(&at(moment));
        }
    }

    fn n_switch(&self) -> usize {
        self.switches.len()
    }

    fn switches(&self, moment: Moment<'_>, g: &mut [f64]) {
        for (g, program) in g.iter_mut().zip(&self.switches) {
            *g = program.eval(&at(moment));
        }
    }
}
