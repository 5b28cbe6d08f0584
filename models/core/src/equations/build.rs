//! Turns a model's equations into programs.
//!
//! Every fault names its place, column and remedy. Next file to read: [`super::model`], which runs the programs.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use super::affine;
use super::at::Slot;
use super::check;
use super::def::EquationsDef;
use super::expression::Expression;
use super::inline::Names;
use super::node::Node;
use super::noise::Noise;
use super::parsed::{Parsed, Placed, fault};
use super::program::{Program, Programs};
use super::smooth;
use crate::bounds::unbounded;
use crate::integrate::Solver;
use crate::memory::{self, Memory};
use crate::{Quantity, SetupError, Spec, nearest};

/// Everything that a model of equations evaluates.
#[derive(Clone, Debug)]
pub(super) struct Built {
    pub(super) spec: Spec,
    pub(super) initial: Programs,
    pub(super) rates: Programs,
    /// For each rate, the states that it depends on.
    pub(super) depends: Vec<Vec<usize>>,
    pub(super) outputs: Programs,
    pub(super) noise: Noise,
    pub(super) switches: Programs,
    pub(super) memories: Vec<Memory>,
    /// For each memory, the state or output that it remembers.
    pub(super) sources: Vec<Slot>,
    pub(super) solver: Solver,
    /// Why the derivatives by the parameters that no constant fixes are not to be had, if so.
    pub(super) not_smooth: Option<String>,
}

/// Checks and compiles the equations.
pub(super) fn build(def: &EquationsDef, constants: &BTreeMap<String, f64>) -> Result<Built, SetupError> {
    check::names(def)?;
    check::terms(def)?;
    let solver = check::solver(&def.solver)?;
    let parsed = Parsed::new(def)?;
    let names = parsed.names(def);
    let parameters = parsed.parameters(&names);
    let memories = RefCell::new(Vec::<Memory>::new());
    let resolve = |name: &str| {
        let parameter = || parameters.iter().position(|p| p == name).map(Slot::Parameter);
        let signal = || names.input(name).map(Slot::Input);
        // Outputs are rewritten into their values; one that is left stands under a `delay`.
        let output = || names.is_taken(name).then_some(Slot::Output(0));
        if let Some(delayed) = name.strip_prefix("delay:") {
            let i = memories.borrow().iter().position(|memory| memory.of == delayed)?;
            return Some(Slot::Input(def.inputs.len() + i));
        }
        names.state(name).map(Slot::State).or_else(signal).or_else(output).or_else(parameter)
    };
    let known = |name: &str| nearest(name, parameters.iter().map(String::as_str));
    let kept = |name: &str| names.is_taken(name) && names.input(name).is_none();
    let range = |name: &str| constants.get(name).map_or_else(unbounded, |value| [*value, *value]);
    let compile = |placed: &Placed| -> Result<(Expression, Program), SetupError> {
        let node = names.inline(placed.expression.node()).map_err(|e| placed.fault(e))?;
        let expression = placed.expression.derived(node);
        for (name, longest) in expression.delays(&kept, &range).map_err(|e| placed.fault(e))? {
            memory::note(&mut memories.borrow_mut(), &name, longest);
        }
        let program = expression.compile(&resolve, &known).map_err(|e| placed.fault(e))?;
        Ok((expression, program))
    };

    let values: Vec<_> = parsed.outputs.iter().map(&compile).collect::<Result<_, _>>()?;
    // Term by term first, so that a fault is shown in the text that was written.
    for term in parsed.rates.iter().flatten() {
        compile(term)?;
    }
    let rates: Vec<_> = names
        .states
        .iter()
        .map(|(name, node)| Placed {
            place: format!("rate of `{name}`"),
            expression: Expression::new(String::new(), node.clone()),
        })
        .map(|placed| compile(&placed))
        .collect::<Result<_, _>>()?;
    let initial = parsed.initial(&names, &resolve, &known)?;
    let noise = Noise::new(&parsed, compile)?;
    let switches = switches(&rates, &names, &resolve)?;
    let spec = spec(def, &names, &parameters, &values);
    let memories = memories.take();
    Ok(Built {
        spec,
        initial: Programs::new(&initial),
        depends: rates.iter().map(|(e, _)| dependencies(e.node(), &names)).collect(),
        rates: Programs::new(rates.iter().map(|(_, p)| p)),
        outputs: Programs::new(values.iter().map(|(_, p)| p)),
        noise,
        not_smooth: smooth::fault(def, &names, constants, [&rates, &values], &memories),
        switches: Programs::new(&switches),
        sources: memories.iter().map(|memory| source(&memory.of, def, &names)).collect(),
        memories,
        solver,
    })
}

/// Where the value of a remembered name is found.
fn source(name: &str, def: &EquationsDef, names: &Names<'_>) -> Slot {
    let output = || def.outputs.iter().position(|o| o.name == name).unwrap_or_default();
    names.state(name).map_or_else(|| Slot::Output(output()), Slot::State)
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

fn spec(
    def: &EquationsDef,
    names: &Names<'_>,
    parameters: &[String],
    values: &[(Expression, Program)],
) -> Spec {
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
        kind: super::KIND.to_owned(),
        says: super::SAYS.to_owned(),
        states: def
            .states
            .iter()
            .map(|s| Quantity::new(&s.name, &s.unit).role(s.role).range(s.range[0], s.range[1]))
            .collect(),
        parameters: parameters
            .iter()
            .map(|name| Quantity::new(name, "").role(def.roles.get(name).copied().unwrap_or_default()))
            .collect(),
        outputs: outputs.collect(),
        inputs: def.inputs.iter().map(|i| Quantity::new(&i.name, &i.unit).role(i.role)).collect(),
        measures: measures.collect(),
        restart: true,
    }
}
