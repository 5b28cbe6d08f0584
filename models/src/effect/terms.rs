//! An effect evaluated by its compiled terms.
//!
//! Next file to read: [`super::scope`] for what its terms may name, then [`super::extended`].

use super::scope::{Reach, Scope, names};
use super::{Addition, Effect, EffectDef, Moment, Touches};
use crate::equations::expression::{At, Direction, Program, Slot};
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
    parameters: Vec<(usize, Program)>,
    parameters_vary: bool,
    initial: Vec<(usize, Program)>,
    switches: Vec<Program>,
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
            parameters: Vec::new(),
            parameters_vary: false,
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

    /// Compiles one term into the list of what it is added to: a state's rate, an output, an input or a parameter.
    fn add(&mut self, add: &Addition, scope: Scope<'_>) -> Result<(), SetupError> {
        let spec = scope.spec;
        let place = format!("effect {}, added to {}", self.def.name, add.to);
        let compile = |reach| scope.compile(&add.term, reach, &place);
        // No state's name has a colon.
        if let Some(i) = target(&spec.states, &add.to)? {
            self.rates.push((i, compile(Reach::All)?));
            self.switches.extend(scope.switches(&add.term, &place)?);
        } else if let Some(i) = target(&spec.outputs, add.quantity())? {
            self.outputs.push((i, compile(Reach::All)?));
        } else if let Some(i) = target(&spec.inputs, &add.to)? {
            self.inputs.push((i, compile(Reach::NoOutputs)?));
            self.switches.extend(scope.switches(&add.term, &place)?);
        } else if let Some(i) = scope.own_parameter(&add.to) {
            self.parameters.push((i, compile(Reach::NoOutputs)?));
            self.parameters_vary |= !scope.is_fixed(&add.term);
            self.switches.extend(scope.switches(&add.term, &place)?);
        } else {
            let lists = [&spec.states, &spec.outputs, &spec.inputs];
            let own = &spec.parameters[..scope.n_own];
            return Err(SetupError::Unknown {
                what: "state, output, input or parameter of the model",
                name: add.to.clone(),
                nearest: nearest(&add.to, lists.into_iter().flatten().chain(own).map(|q| &q.name)),
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
            parameters: !self.parameters.is_empty(),
            parameters_vary: self.parameters_vary,
            reads_outputs: used.iter().any(is_output),
            inputs_follow_states: inputs_follow_states(&self.def, scope)?,
        })
    }
}

/// Whether a term that adds to an input uses a state.
fn inputs_follow_states(def: &EffectDef, scope: Scope<'_>) -> Result<bool, SetupError> {
    let has = |list: &[Quantity], name: &str| list.iter().any(|q| q.name == name);
    let (states, outputs) = (&scope.spec.states, &scope.spec.outputs);
    let to_inputs = def
        .adds
        .iter()
        .filter(|a| !has(states, &a.to) && !has(outputs, a.quantity()) && has(&scope.spec.inputs, &a.to));
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

    fn add_to_parameters(&self, moment: Moment<'_>, theta: &mut [f64]) {
        for (i, program) in &self.parameters {
            theta[*i] += program.eval(&at(moment));
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
