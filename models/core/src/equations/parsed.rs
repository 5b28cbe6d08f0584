//! A model's expressions, parsed, each with its place for messages.
//!
//! Next file to read: [`super::build`].

use std::cell::RefCell;

use super::at::Slot;
use super::def::EquationsDef;
use super::expression::Expression;
use super::expression_error::ExpressionError;
use super::inline::Names;
use super::node::{Node, Operation};
use super::parse;
use super::program::Program;
use crate::SetupError;

/// An expression with its place, for messages.
pub(super) struct Placed {
    pub(super) place: String,
    pub(super) expression: Expression,
}

impl Placed {
    fn parse(place: String, text: &str) -> Result<Self, SetupError> {
        match Expression::parse(text) {
            Ok(expression) => Ok(Self { place, expression }),
            Err(e) => Err(fault(place, text, e)),
        }
    }

    pub(super) fn fault(&self, error: ExpressionError) -> SetupError {
        fault(self.place.clone(), self.expression.text(), error)
    }
}

pub(super) fn fault(place: String, text: &str, error: ExpressionError) -> SetupError {
    SetupError::Expression {
        place,
        expression: text.to_owned(),
        column: error.column,
        message: error.message,
    }
}

/// Every expression of the definition.
pub(super) struct Parsed {
    initial: Vec<Placed>,
    pub(super) rates: Vec<Vec<Placed>>,
    /// For each state, its sources of noise and their amplitudes.
    pub(super) noise: Vec<Vec<(String, Placed)>>,
    pub(super) outputs: Vec<Placed>,
}

impl Parsed {
    pub(super) fn new(def: &EquationsDef) -> Result<Self, SetupError> {
        let mut parsed =
            Self { initial: Vec::new(), rates: Vec::new(), noise: Vec::new(), outputs: Vec::new() };
        for state in &def.states {
            let name = &state.name;
            parsed.initial.push(Placed::parse(format!("initial value of `{name}`"), &state.initial)?);
            let mut terms = Vec::new();
            for (term, text) in &state.rate {
                let place = if state.rate.len() == 1 && term == name {
                    format!("rate of `{name}`")
                } else {
                    format!("term `{term}` of the rate of `{name}`")
                };
                terms.push(Placed::parse(place, text)?);
            }
            parsed.rates.push(terms);
            let amplitude = |(source, text): &(String, String)| {
                let place = if state.noise.len() == 1 && source == name {
                    format!("noise of `{name}`")
                } else {
                    format!("noise `{source}` of `{name}`")
                };
                Ok((source.clone(), Placed::parse(place, text)?))
            };
            parsed.noise.push(state.noise.iter().map(amplitude).collect::<Result<_, SetupError>>()?);
        }
        for output in &def.outputs {
            parsed.outputs.push(Placed::parse(format!("output `{}`", output.name), &output.value)?);
        }
        Ok(parsed)
    }

    pub(super) fn names<'a>(&self, def: &'a EquationsDef) -> Names<'a> {
        let sum = |terms: &Vec<Placed>| {
            let mut nodes = terms.iter().map(|t| t.expression.node().clone());
            let first = nodes.next().unwrap_or(Node::Number(0.0));
            nodes.fold(first, |sum, term| Node::Pair(Operation::Add, Box::new(sum), Box::new(term)))
        };
        let values = self.outputs.iter().map(|o| o.expression.node().clone());
        Names {
            states: def.states.iter().map(|s| s.name.as_str()).zip(self.rates.iter().map(sum)).collect(),
            outputs: def.outputs.iter().map(|o| o.name.as_str()).zip(values).collect(),
            inputs: def.inputs.iter().map(|i| i.name.as_str()).collect(),
            open: RefCell::new(Vec::new()),
        }
    }

    /// Every name that stands for nothing else, in the order of first use.
    pub(super) fn parameters(&self, names: &Names<'_>) -> Vec<String> {
        let mut list = Vec::new();
        let states =
            self.initial.iter().zip(&self.rates).flat_map(|(i, rate)| std::iter::once(i).chain(rate));
        let noise = self.noise.iter().flatten().map(|(_, amplitude)| amplitude);
        for (name, _) in states.chain(&self.outputs).chain(noise).flat_map(|placed| placed.expression.names())
        {
            if !list.contains(&name) && !names.is_taken(&name) {
                list.push(name);
            }
        }
        list
    }

    pub(super) fn initial(
        &self,
        names: &Names<'_>,
        resolve: &dyn Fn(&str) -> Option<Slot>,
        known: &dyn Fn(&str) -> Option<String>,
    ) -> Result<Vec<Program>, SetupError> {
        let compile = |placed: &Placed| {
            let text = placed.expression.text();
            if let Some((name, column)) =
                placed.expression.names().into_iter().find(|(n, _)| names.is_taken(n))
            {
                let message = format!("an initial value may use only parameters: `{name}` is not one");
                return Err(placed.fault(ExpressionError { column, message }));
            }
            if let Some(column) = parse::column_of_time(text) {
                let message = "an initial value may use only parameters: `t` is not one".to_owned();
                return Err(placed.fault(ExpressionError { column, message }));
            }
            placed.expression.compile(resolve, known).map_err(|e| placed.fault(e))
        };
        self.initial.iter().map(compile).collect()
    }
}
