//! Checks a model's equations and turns them into programs.
//!
//! Every fault names its place, column and remedy. Next file to read: [`super::model`], which runs the programs.

use std::cell::RefCell;
use std::collections::BTreeSet;

use super::def::{EquationsDef, Method, SolverDef};
use super::expression::{Expression, ExpressionError, Program, Slot};
use super::inline::Names;
use super::node::{Node, Operation};
use super::{affine, parse};
use crate::integrate::{Solver, Tolerance};
use crate::{Quantity, SetupError, Spec, nearest};

/// Everything that a model of equations evaluates.
#[derive(Clone, Debug)]
pub(super) struct Built {
    pub(super) spec: Spec,
    pub(super) initial: Vec<Program>,
    pub(super) rates: Vec<Program>,
    /// For each rate, the states that it depends on.
    pub(super) depends: Vec<Vec<usize>>,
    pub(super) outputs: Vec<Program>,
    pub(super) switches: Vec<Program>,
    pub(super) solver: Solver,
}

/// An expression with its place, for messages.
struct Placed {
    place: String,
    expression: Expression,
}

impl Placed {
    fn parse(place: String, text: &str) -> Result<Self, SetupError> {
        match Expression::parse(text) {
            Ok(expression) => Ok(Self { place, expression }),
            Err(e) => Err(fault(place, text, e)),
        }
    }

    fn fault(&self, error: ExpressionError) -> SetupError {
        fault(self.place.clone(), self.expression.text(), error)
    }
}

fn fault(place: String, text: &str, error: ExpressionError) -> SetupError {
    SetupError::Expression { place, expression: text.to_owned(), column: error.column, message: error.message }
}

/// Checks and compiles the equations.
pub(super) fn build(def: &EquationsDef) -> Result<Built, SetupError> {
    check_names(def)?;
    check_terms(def)?;
    let solver = solver(&def.solver)?;
    let parsed = Parsed::new(def)?;
    let names = parsed.names(def);
    let parameters = parsed.parameters(&names);
    let resolve = |name: &str| {
        let parameter = || parameters.iter().position(|p| p == name).map(Slot::Parameter);
        names.state(name).map(Slot::State).or_else(|| names.input(name).map(Slot::Input)).or_else(parameter)
    };
    let known = |name: &str| nearest(name, parameters.iter().map(String::as_str));
    let compile = |placed: &Placed| -> Result<(Expression, Program), SetupError> {
        let node = names.inline(placed.expression.node()).map_err(|e| placed.fault(e))?;
        let expression = placed.expression.derived(node);
        let program = expression.compile(&resolve, &known).map_err(|e| placed.fault(e))?;
        Ok((expression, program))
    };

    let values: Vec<_> = parsed.outputs.iter().map(&compile).collect::<Result<_, _>>()?;
    // Term by term first, so that a fault is shown in the text that was written.
    for term in parsed.rates.iter().flatten() {
        compile(term)?;
    }
    let place = |name: &str| format!("rate of `{name}`");
    let rates: Vec<_> = names
        .states
        .iter()
        .map(|(name, node)| Placed { place: place(name), expression: Expression::new(String::new(), node.clone()) })
        .map(|placed| compile(&placed))
        .collect::<Result<_, _>>()?;
    let initial = parsed.initial(&names, &resolve, &known)?;
    let depends = rates.iter().map(|(e, _)| dependencies(e.node(), &names)).collect();
    let switches = switches(&rates, &names, &resolve)?;
    let spec = spec(def, &names, &parameters, &values);
    Ok(Built {
        spec,
        initial,
        rates: rates.into_iter().map(|(_, p)| p).collect(),
        depends,
        outputs: values.into_iter().map(|(_, p)| p).collect(),
        switches,
        solver,
    })
}

fn check_names(def: &EquationsDef) -> Result<(), SetupError> {
    if def.states.is_empty() {
        return Err(SetupError::Invalid("the equations have no state: add at least one with a rate".to_owned()));
    }
    let mut seen = BTreeSet::new();
    let mut outputs = BTreeSet::new();
    let states = def.states.iter().map(|s| (&s.name, "state"));
    let inputs = def.inputs.iter().map(|s| (&s.name, "input"));
    for (name, what) in states.chain(inputs).chain(def.outputs.iter().map(|s| (&s.name, "output"))) {
        let mut letters = name.chars();
        let starts = letters.next().is_some_and(|c| c.is_alphabetic() || c == '_');
        if !starts || !letters.all(|c| c.is_alphanumeric() || c == '_') {
            let rule = "a letter or `_`, then letters, digits and `_`";
            return Err(SetupError::Invalid(format!("`{name}` cannot be the name of an {what}: expected {rule}")));
        }
        if ["t", "pi"].contains(&name.as_str()) || parse::FUNCTIONS.contains(&name.as_str()) {
            let message = format!("`{name}` cannot be the name of an {what}: it has a meaning in expressions");
            return Err(SetupError::Invalid(message));
        }
        let value = || def.outputs.iter().find(|o| o.name == *name).map(|o| o.value.trim());
        let is_state = what == "output" && def.states.iter().any(|s| s.name == *name) && value() == Some(name);
        let list = if is_state { &mut outputs } else { &mut seen };
        if !list.insert(name) {
            return Err(SetupError::Twice(name.clone()));
        }
    }
    Ok(())
}

fn check_terms(def: &EquationsDef) -> Result<(), SetupError> {
    for state in &def.states {
        if state.rate.is_empty() {
            return Err(SetupError::Invalid(format!("state `{}` has no rate", state.name)));
        }
        if state.initial.trim().is_empty() {
            return Err(SetupError::Invalid(format!("state `{}` has no initial value", state.name)));
        }
        let mut seen = BTreeSet::new();
        if let Some((term, _)) = state.rate.iter().find(|(term, _)| !seen.insert(term)) {
            return Err(SetupError::Twice(format!("{term} in the rate of {}", state.name)));
        }
    }
    let terms = || def.states.iter().flat_map(|s| s.rate.iter().map(|(term, _)| term.as_str()));
    for name in &def.replaceable {
        if !terms().any(|term| term == name) {
            let nearest = nearest(name, terms());
            return Err(SetupError::Unknown { what: "rate term", name: name.clone(), nearest });
        }
    }
    Ok(())
}

fn solver(def: &SolverDef) -> Result<Solver, SetupError> {
    let positive = |value: f64| value.is_finite() && value > 0.0;
    let tolerance = Tolerance { relative: def.rtol, absolute: def.atol };
    if !positive(def.rtol) || !positive(def.atol) {
        return Err(SetupError::Invalid("the solver's rtol and atol must be positive numbers".to_owned()));
    }
    match (def.method, def.step) {
        (Method::Auto, _) => Ok(Solver::Auto(tolerance)),
        (Method::Dopri5, _) => Ok(Solver::Dopri5(tolerance)),
        (Method::Rosenbrock, _) => Ok(Solver::Rosenbrock(tolerance)),
        (Method::Fixed, Some(step)) if positive(step) => Ok(Solver::Fixed { step }),
        (Method::Fixed, _) => {
            Err(SetupError::Invalid("the solver's method `fixed` needs a positive `step`".to_owned()))
        }
    }
}

/// Every expression of the definition.
struct Parsed {
    initial: Vec<Placed>,
    rates: Vec<Vec<Placed>>,
    outputs: Vec<Placed>,
}

impl Parsed {
    fn new(def: &EquationsDef) -> Result<Self, SetupError> {
        let mut parsed = Self { initial: Vec::new(), rates: Vec::new(), outputs: Vec::new() };
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
        }
        for output in &def.outputs {
            parsed.outputs.push(Placed::parse(format!("output `{}`", output.name), &output.value)?);
        }
        Ok(parsed)
    }

    fn names<'a>(&self, def: &'a EquationsDef) -> Names<'a> {
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
    fn parameters(&self, names: &Names<'_>) -> Vec<String> {
        let mut list = Vec::new();
        let states = self.initial.iter().zip(&self.rates).flat_map(|(i, rate)| std::iter::once(i).chain(rate));
        for (name, _) in states.chain(&self.outputs).flat_map(|placed| placed.expression.names()) {
            if !list.contains(&name) && !names.is_taken(&name) {
                list.push(name);
            }
        }
        list
    }

    fn initial(
        &self,
        names: &Names<'_>,
        resolve: &dyn Fn(&str) -> Option<Slot>,
        known: &dyn Fn(&str) -> Option<String>,
    ) -> Result<Vec<Program>, SetupError> {
        let compile = |placed: &Placed| {
            let text = placed.expression.text();
            if let Some((name, column)) = placed.expression.names().into_iter().find(|(n, _)| names.is_taken(n)) {
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

/// The states that a tree depends on.
fn dependencies(node: &Node, names: &Names<'_>) -> Vec<usize> {
    let mut found = BTreeSet::new();
    node.walk(&mut |part| found.extend(part.name().and_then(|n| names.state(&n.text))));
    found.into_iter().collect()
}

/// The rates' switching functions, each once, without those that only parameters decide.
fn switches(
    rates: &[(Expression, Program)],
    names: &Names<'_>,
    resolve: &dyn Fn(&str) -> Option<Slot>,
) -> Result<Vec<Program>, SetupError> {
    let mut list: Vec<Expression> = Vec::new();
    for found in rates.iter().flat_map(|(e, _)| e.discontinuities()) {
        let mut moves = false;
        found.node().walk(&mut |part| {
            moves |= matches!(part, Node::Time) || part.name().is_some_and(|n| names.is_taken(&n.text));
        });
        if moves && !list.iter().any(|known| known.node() == found.node()) {
            list.push(found);
        }
    }
    let compile = |e: &Expression| {
        e.compile(resolve, &|_| None).map_err(|error| fault("switching function".to_owned(), e.text(), error))
    };
    list.iter().map(compile).collect()
}

fn spec(def: &EquationsDef, names: &Names<'_>, parameters: &[String], values: &[(Expression, Program)]) -> Spec {
    let measures = def.outputs.iter().zip(values).filter_map(|(output, (value, _))| {
        let state = affine::measured(value.node(), &|name| names.state(name))?;
        Some((output.name.clone(), def.states[state].name.clone()))
    });
    let outputs = def.outputs.iter().zip(values).map(|(output, (value, _))| {
        let mut quantity = Quantity::new(&output.name, &output.unit).role(output.role);
        // An output that simply is a state has its unit and meaning.
        if let Node::Name(name) = value.node()
            && let Some(state) = names.state(&name.text).map(|i| &def.states[i])
        {
            if quantity.unit.is_empty() {
                quantity.unit.clone_from(&state.unit);
            }
            if quantity.role == crate::Role::Other {
                quantity.role = state.role;
            }
        }
        quantity
    });
    Spec {
        kind: "equations".to_owned(),
        says: "ordinary differential equations written in the study".to_owned(),
        states: def
            .states
            .iter()
            .map(|s| Quantity::new(&s.name, &s.unit).role(s.role).range(s.range[0], s.range[1]))
            .collect(),
        parameters: parameters.iter().map(|name| Quantity::new(name, "")).collect(),
        outputs: outputs.collect(),
        inputs: def.inputs.iter().map(|i| Quantity::new(&i.name, &i.unit).role(i.role)).collect(),
        measures: measures.collect(),
        restart: true,
    }
}
