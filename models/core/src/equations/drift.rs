//! The functions of a drift: rows φ(t, x, u) with their derivatives by the states, and where each enters.
//!
//! A rate that is linear in unknown parameters is f = F₀(t, x, u) + Σ_p θ_p F_p(t, x, u), found exactly from the equations; a function
//! that several equations share up to a number is one function. Nothing is estimated here. Next file to read: [`super::linear`].

use std::collections::BTreeMap;

use super::at::{At, Direction, Slot};
use super::def::EquationsDef;
use super::expression::Expression;
use super::expression_error::ExpressionError;
use super::inline::Names;
use super::linear::{factored, split};
use super::node::Node;
use super::parsed::{Parsed, fault};
use super::program::Program;
use crate::{Drive, SetupError, nearest};

/// One function of states, inputs and time.
#[derive(Clone, Debug)]
pub struct DriftFunction {
    /// What it is, such as `c12 in h1`, or its text.
    pub name: String,
    /// Whether it is to be taken at the start of a step, without derivatives (Itô).
    pub left: bool,
    program: Program,
    /// The states that it depends on.
    depends: Vec<usize>,
}

/// Where a function enters: an equation and a factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriftPlace {
    /// Equation, as the states are ordered.
    pub equation: usize,
    /// Index in [`Drift::functions`].
    pub function: usize,
    /// Number that the function is multiplied by.
    pub factor: f64,
}

/// The drift of equations that are linear in unknown parameters.
#[derive(Clone, Debug, Default)]
pub struct Drift {
    /// The functions, first used first.
    pub functions: Vec<DriftFunction>,
    /// For every unknown parameter, where it enters.
    pub places: Vec<Vec<DriftPlace>>,
    /// What enters without any of them.
    pub known: Vec<DriftPlace>,
}

impl DriftFunction {
    /// The value at time `t`, states `x` and inputs `u`.
    pub fn value(&self, t: f64, x: &[f64], u: &[f64]) -> f64 {
        self.program.eval(&At { t, x, theta: &[], u: drive(u), y: &[] })
    }

    /// The derivatives by the states; `unit` has room for as many numbers and is zero.
    pub fn slopes(&self, t: f64, x: &[f64], u: &[f64], unit: &mut [f64], slopes: &mut [f64]) {
        let at = At { t, x, theta: &[], u: drive(u), y: &[] };
        slopes.fill(0.0);
        for &l in &self.depends {
            unit[l] = 1.0;
            slopes[l] = self.program.eval_dual(&at, &Direction { x: unit, ..Direction::default() }).1;
            unit[l] = 0.0;
        }
    }
}

fn drive(u: &[f64]) -> Drive<'_> {
    Drive { value: u, ..Drive::NONE }
}

impl Drift {
    /// The drift of equations in their parameters `unknown`. Functions of a parameter or of an equation that `left` names are to be
    /// taken at the start of a step, as are those that jump where a state moves them.
    ///
    /// # Errors
    /// [`SetupError::Unknown`] for an unknown that no rate has, [`SetupError::Expression`] for a rate that is not linear in the
    /// unknowns or that uses the past, and as [`super::EquationsModel::new`].
    pub fn of_rates(
        def: &EquationsDef,
        constants: &BTreeMap<String, f64>,
        unknown: &[String],
        left: &[String],
    ) -> Result<Self, SetupError> {
        let parsed = Parsed::new(def)?;
        let names = parsed.names(def);
        let told = |equation: usize, error: ExpressionError| {
            let state = &def.states[equation];
            let terms: Vec<&str> = state.rate.iter().map(|(_, text)| text.as_str()).collect();
            fault(format!("rate of `{}`", state.name), &terms.join(" + "), error)
        };
        let rates = names.states.iter().enumerate();
        let rates = rates.map(|(l, (_, rate))| names.inline(rate).map_err(|error| told(l, error)));
        let rates = rates.collect::<Result<Vec<_>, _>>()?;
        used(unknown, &rates, &names)?;
        let mut collected = Collected { names: &names, constants, drift: Self::default(), nodes: Vec::new() };
        collected.drift.places = vec![Vec::new(); unknown.len()];
        for (l, rate) in rates.iter().enumerate() {
            collected.add(l, rate, unknown, left).map_err(|error| told(l, error))?;
        }
        Ok(collected.drift)
    }

    /// Functions written as texts, of the states, inputs and outputs of the equations and of constants.
    ///
    /// # Errors
    /// [`SetupError::Expression`] for a text that is no expression, has an unknown name or uses the past.
    pub fn of_texts(
        def: &EquationsDef,
        constants: &BTreeMap<String, f64>,
        texts: &[String],
        left: &[String],
    ) -> Result<Vec<DriftFunction>, SetupError> {
        let parsed = Parsed::new(def)?;
        let names = parsed.names(def);
        let mut collected = Collected { names: &names, constants, drift: Self::default(), nodes: Vec::new() };
        for text in texts {
            let told = |error| fault("function of the inference".to_owned(), text, error);
            let node = names.inline(Expression::parse(text).map_err(told)?.node()).map_err(told)?;
            let left = left.contains(text) || collected.jumps(&node);
            let function = collected.function(&node, text.clone(), left).map_err(told)?;
            collected.drift.functions.push(function);
        }
        Ok(collected.drift.functions)
    }
}

/// Whether every unknown stands in a rate.
fn used(unknown: &[String], rates: &[Node], names: &Names<'_>) -> Result<(), SetupError> {
    let mut parameters: Vec<&str> = Vec::new();
    for rate in rates {
        rate.walk(&mut |part| {
            parameters
                .extend(part.name().map(|name| name.text.as_str()).filter(|name| !names.is_taken(name)));
        });
    }
    let Some(name) = unknown.iter().find(|name| !parameters.contains(&name.as_str())) else { return Ok(()) };
    let nearest = nearest(name, parameters.iter().filter(|known| !unknown.iter().any(|u| u == *known)));
    Err(SetupError::Unknown { what: "parameter of a rate", name: name.clone(), nearest })
}

/// Functions found so far.
struct Collected<'a> {
    names: &'a Names<'a>,
    constants: &'a BTreeMap<String, f64>,
    drift: Drift,
    nodes: Vec<Node>,
}

impl Collected<'_> {
    /// Takes the rate of an equation apart.
    fn add(
        &mut self,
        equation: usize,
        rate: &Node,
        unknown: &[String],
        left: &[String],
    ) -> Result<(), ExpressionError> {
        let state = self.names.states[equation].0;
        let of_state = left.iter().any(|l| l == state);
        let parts = split(rate, unknown)?;
        if let Some(rest) = &parts.rest {
            let place = self.take(equation, rest, format!("known part of {state}"), of_state)?;
            self.drift.known.extend(place);
        }
        for (p, factor) in parts.factors.iter().enumerate() {
            let Some(factor) = factor else { continue };
            let left = of_state || left.contains(&unknown[p]);
            let place = self.take(equation, factor, format!("{} in {state}", unknown[p]), left)?;
            self.drift.places[p].extend(place);
        }
        Ok(())
    }

    /// Where a part of a rate enters, its function added where it is new; nothing for a part that is zero.
    fn take(
        &mut self,
        equation: usize,
        part: &Node,
        name: String,
        left: bool,
    ) -> Result<Option<DriftPlace>, ExpressionError> {
        let (factor, node) = factored(part);
        if factor.abs() <= 0.0 {
            return Ok(None);
        }
        let left = left || self.jumps(&node);
        let same = |k: &usize| self.nodes[*k] == node && self.drift.functions[*k].left == left;
        if let Some(function) = (0..self.nodes.len()).find(same) {
            return Ok(Some(DriftPlace { equation, function, factor }));
        }
        let function = self.function(&node, name, left)?;
        self.drift.functions.push(function);
        self.nodes.push(node);
        Ok(Some(DriftPlace { equation, function: self.nodes.len() - 1, factor }))
    }

    /// Whether a function jumps where a state moves it: its slope has no value there, and the term that the mid-point needs of it none either.
    fn jumps(&self, node: &Node) -> bool {
        let moves = |name: &str| self.names.state(name).is_some();
        Expression::new(String::new(), node.clone()).jumps(&moves)
    }

    fn function(&self, node: &Node, name: String, left: bool) -> Result<DriftFunction, ExpressionError> {
        let mut depends = Vec::new();
        let mut past = None;
        node.walk(&mut |part| {
            if let Node::Delay(name, _) | Node::DelayedSlope(name, _) | Node::Ddt(name) = part {
                past = past.or(Some(name.column));
            }
            depends.extend(part.name().and_then(|name| self.names.state(&name.text)));
        });
        if let Some(column) = past {
            let message =
                "an inference knows the values of one time alone: no `delay` and no `ddt`".to_owned();
            return Err(ExpressionError::new(column, message));
        }
        depends.sort_unstable();
        depends.dedup();
        let resolve = |name: &str| {
            let constant = || self.constants.get(name).map(|value| Slot::Constant(*value));
            let input = || self.names.input(name).map(Slot::Input);
            self.names.state(name).map(Slot::State).or_else(input).or_else(constant)
        };
        let states = self.names.states.iter().map(|(name, _)| *name);
        let all: Vec<&str> = states
            .chain(self.names.inputs.iter().copied())
            .chain(self.constants.keys().map(String::as_str))
            .collect();
        let known = |name: &str| nearest(name, all.iter().copied());
        let program = Expression::new(name.clone(), node.clone()).compile(&resolve, &known)?;
        Ok(DriftFunction { name, left, program, depends })
    }
}
