//! An effect evaluated by its compiled terms.
//!
//! Next file to read: [`super::scope`] for what its terms may name, then [`super::extended`].

use super::scope::{Reach, Scope, names};
use super::{Addition, Effect, EffectDef, Moment, Target, Touches};
use crate::SetupError;
use crate::equations::{At, Direction, Program, Programs, Slot};
use crate::segment::Drive;
use crate::{Quantity, Spec, nearest};

/// One effect, made of expressions.
pub(crate) struct TermEffect {
    def: EffectDef,
    touches: Touches,
    rates: Vec<(usize, Program)>,
    outputs: Vec<(usize, Program)>,
    inputs: Vec<(usize, Program)>,
    parameters: Vec<(usize, Program)>,
    initial: Vec<(usize, Program)>,
    switches: Vec<Program>,
    /// The terms of each list, evaluated together.
    together: Together,
}

/// The values of several terms, evaluated together.
#[derive(Default)]
struct Together {
    rates: Programs,
    outputs: Programs,
    parameters: Programs,
    switches: Programs,
}

impl TermEffect {
    /// Compiles the terms of `def` against the extended model.
    ///
    /// # Errors
    /// When a term adds to something the model does not have, or an expression is wrong.
    pub(crate) fn new(def: &EffectDef, scope: Scope<'_>) -> Result<Self, SetupError> {
        let mut effect = Self {
            def: def.clone(),
            touches: Touches::default(),
            rates: Vec::new(),
            outputs: Vec::new(),
            inputs: Vec::new(),
            parameters: Vec::new(),
            initial: Vec::new(),
            switches: Vec::new(),
            together: Together::default(),
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
        let of = |list: &[(usize, Program)]| Programs::new(list.iter().map(|(_, program)| program));
        effect.together = Together {
            rates: of(&effect.rates),
            outputs: of(&effect.outputs),
            parameters: of(&effect.parameters),
            switches: Programs::new(&effect.switches),
        };
        Ok(effect)
    }

    /// Compiles one term into the list of what it is added to: a state's rate, an output, an input or a parameter.
    fn add(&mut self, add: &Addition, scope: Scope<'_>) -> Result<(), SetupError> {
        let spec = scope.spec;
        let place = format!("effect {}, added to {}", self.def.name, add.to);
        let Some(target) = Target::of(add, &self.def, spec, scope.n_own) else {
            let lists = [&spec.states, &spec.outputs, &spec.inputs];
            let own = &spec.parameters[..scope.n_own];
            return Err(SetupError::Unknown {
                what: "state, output, input or parameter of the model",
                name: add.to.clone(),
                nearest: nearest(&add.to, lists.into_iter().flatten().chain(own).map(|q| &q.name)),
            });
        };
        let (terms, list, reach) = match target {
            Target::Rate => (&mut self.rates, &spec.states, Reach::All),
            Target::Output => (&mut self.outputs, &spec.outputs, Reach::All),
            Target::Input => (&mut self.inputs, &spec.inputs, Reach::NoOutputs),
            Target::Parameter => (&mut self.parameters, &spec.parameters, Reach::NoOutputs),
        };
        terms.push((position(list, add.quantity())?, scope.compile(&add.term, reach, &place)?));
        if target != Target::Output {
            self.switches.extend(scope.switches(&add.term, &place)?);
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
        let is_state = |name: &String| matches!(scope.slot(name, Reach::All), Some(Slot::State(_)));
        let adding_to = |target: Target| {
            let of =
                move |add: &&Addition| Target::of(add, &self.def, scope.spec, scope.n_own) == Some(target);
            self.def.adds.iter().filter(of)
        };
        let to_inputs =
            EffectDef { adds: adding_to(Target::Input).cloned().collect(), ..EffectDef::default() };
        Ok(Touches {
            rates: !self.rates.is_empty(),
            outputs: !self.outputs.is_empty(),
            inputs: !self.inputs.is_empty(),
            parameters: !self.parameters.is_empty(),
            parameters_vary: adding_to(Target::Parameter).any(|add| !scope.is_fixed(&add.term)),
            reads_outputs: used.iter().any(is_output),
            inputs_follow_states: names(&[to_inputs])?.iter().any(is_state),
        })
    }
}

/// Position of a scalar quantity that a term can be added to.
fn position(list: &[Quantity], name: &str) -> Result<usize, SetupError> {
    match list.iter().find(|q| q.name == name) {
        Some(q) if q.size > 1 => Err(SetupError::Invalid(format!(
            "a term cannot be added to `{name}`: it has {} components and an expression has one",
            q.size
        ))),
        _ => Ok(Spec::offset(list, name).unwrap_or_default()),
    }
}

fn at(moment: Moment<'_>) -> At<'_> {
    At { t: moment.t, x: moment.x, theta: moment.theta, u: moment.u, y: moment.y }
}

impl Effect for TermEffect {
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
        self.together.parameters.each(&at(moment), |k, value| theta[self.parameters[k].0] += value);
    }

    fn add_to_rates(&self, moment: Moment<'_>, dx: &mut [f64]) {
        self.together.rates.each(&at(moment), |k, value| dx[self.rates[k].0] += value);
    }

    fn add_to_outputs(&self, moment: Moment<'_>, y: &mut [f64]) {
        self.together.outputs.each(&at(moment), |k, value| y[self.outputs[k].0] += value);
    }

    fn n_switch(&self) -> usize {
        self.switches.len()
    }

    fn switches(&self, moment: Moment<'_>, g: &mut [f64]) {
        self.together.switches.write(&at(moment), g);
    }
}
