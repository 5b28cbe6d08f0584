//! Reading the model and the effects of a study file.
//!
//! A rate is one expression or a table of named terms, an initial value a number or an expression; both end as text with a
//! place. Next file to read: [`crate::check::model`], which asks the model whether they make sense.

use starlings_models::{Role, SOLVER};
use starlings_proto::adapters::AdapterDef;
use toml::Spanned;

use super::layout::Layout;
use super::quantity::{named_role, role, unit};
use super::roles::{told_by_rates, told_by_unit};
use super::solver::{self, program};
use super::table::{Node, Table, named_texts, number, text, wrong_type};
use super::{
    EffectParameterSection, EffectSection, EquationsSection, ModelSection, Named, QuantitySection,
    SolverSection, StateSection,
};
use crate::problem::Source;

/// Keys of `[model]` that only a model of equations has.
const EQUATIONS: [&str; 6] = ["outputs", "inputs", "replaceable", "roles", "solver", "states"];

/// Reads `[model]`.
pub(crate) fn model(source: &Source, root: &Table<'_>, adapters: &[AdapterDef]) -> ModelSection {
    let mut keys = [
        &["kind", "constants", "initial", "layout", "start", "period", "max_steps", "timeout"],
        &EQUATIONS[..],
        &solver::KEYS[..],
    ]
    .concat();
    keys.sort_unstable();
    keys.dedup();
    if root.get("model").is_none() {
        root.missing("model", "a section `[model]` with a `kind`");
    }
    let Some(t) = root.table("model", "[model]", &keys) else {
        let kind = Spanned::new(0..0, String::new());
        return ModelSection {
            kind,
            constants: Vec::new(),
            initial: None,
            layout: None,
            start: None,
            period: None,
            max_steps: None,
            timeout: None,
            equations: None,
            solver: None,
        };
    };
    let kind = t
        .required_text("kind", "a model's name (`starlings models` lists them), \"equations\" or \"solver\"");
    let of_kind = kind.get_ref().as_str();
    let equations = (of_kind == "equations").then(|| equations(source, &t));
    let solver = (of_kind == SOLVER).then(|| program(source, &t, kind.span(), adapters));
    refuse_foreign(source, &t, of_kind);
    let timeout = if of_kind == SOLVER { None } else { t.number("timeout") };
    let layout = t.get("layout").map(|node| Layout::read(source, node));
    ModelSection {
        constants: constants(source, &t),
        initial: t.text("initial"),
        kind,
        layout,
        start: t.text("start"),
        period: t.number("period"),
        max_steps: t.count("max_steps"),
        timeout,
        equations,
        solver,
    }
}

/// Keys of another kind of model.
fn refuse_foreign(source: &Source, model: &Table<'_>, kind: &str) {
    let kinds = [("equations", &EQUATIONS[..]), (SOLVER, &solver::KEYS[..])];
    for (key, _) in model.entries() {
        let owners: Vec<&str> = kinds
            .iter()
            .filter(|(_, keys)| keys.contains(&key.get_ref().as_str()) && key.get_ref() != "timeout")
            .map(|(owner, _)| *owner)
            .collect();
        if !owners.is_empty() && !owners.contains(&kind) {
            let owners = owners.join("\" or \"");
            let message =
                format!("`{}` belongs to models of kind \"{owners}\", this one is \"{kind}\"", key.get_ref());
            source.report(key.span(), message);
        }
    }
}

fn constants(source: &Source, model: &Table<'_>) -> Named<f64> {
    let read = |(key, node): (Spanned<String>, &Node<'_>)| {
        number(source, node, &format!("constant `{}`", key.get_ref())).map(|value| (key, value))
    };
    model.free_entries("constants").into_iter().filter_map(read).collect()
}

fn equations(source: &Source, model: &Table<'_>) -> EquationsSection {
    let keys = ["name", "unit", "role", "initial", "rate", "noise"];
    let states = model.tables("states", "[[model.states]]", &keys);
    if model.get("states").is_none() {
        model.missing("states", "at least one `[[model.states]]` with `name`, `initial` and `rate`");
    }
    if model.get("outputs").is_none() {
        model.missing("outputs", "such as `[ { name = \"position\", unit = \"m\", value = \"x\" } ]`");
    }
    let mut states: Vec<StateSection> = states.iter().map(|t| state(source, t)).collect();
    told_by_rates(&mut states);
    EquationsSection {
        states,
        outputs: quantities(source, model, "outputs", "an output", true),
        inputs: quantities(source, model, "inputs", "an input", false),
        replaceable: model.texts("replaceable"),
        roles: roles(source, model),
        solver: solver(model),
    }
}

fn quantities(
    source: &Source,
    model: &Table<'_>,
    key: &str,
    name: &str,
    with_value: bool,
) -> Vec<QuantitySection> {
    let keys: &[&str] =
        if with_value { &["name", "unit", "role", "value"] } else { &["name", "unit", "role"] };
    let read = |t: Table<'_>| QuantitySection {
        name: t.required_text("name", "how other parts of the study call it"),
        unit: unit(&t),
        role: role(source, &t).or_else(|| told_by_unit(&unit(&t))).unwrap_or_default(),
        value: if with_value {
            t.required_text("value", "an expression such as \"x\"")
        } else {
            Spanned::new(t.span.clone(), String::new())
        },
    };
    model.tables(key, name, keys).into_iter().map(read).collect()
}

fn solver(model: &Table<'_>) -> SolverSection {
    let Some(t) = model.table("solver", "`solver`", &["method", "rtol", "atol", "step"]) else {
        return SolverSection::default();
    };
    SolverSection {
        span: t.span.clone(),
        method: t.text("method"),
        rtol: t.number("rtol"),
        atol: t.number("atol"),
        step: t.number("step"),
    }
}

fn state(source: &Source, t: &Table<'_>) -> StateSection {
    if t.get("rate").is_none() {
        t.missing("rate", "an expression, or named terms `{ spring = \"-k*x/m\" }`");
    }
    let zero = Spanned::new(t.span.clone(), "0".to_owned());
    StateSection {
        name: t.required_text("name", "how expressions call the state"),
        unit: unit(t),
        role: role(source, t).or_else(|| told_by_unit(&unit(t))),
        initial: t.get("initial").and_then(|node| value(source, node, "`initial`")).unwrap_or(zero),
        rate: t.get("rate").map(|node| rate(source, t, node)).unwrap_or_default(),
        noise: t.get("noise").map(|node| noise(source, t, node)).unwrap_or_default(),
    }
}

/// A number or an expression, as text.
fn value(source: &Source, node: &Node<'_>, what: &str) -> Option<Spanned<String>> {
    if node.get_ref().is_str() {
        return text(source, node, what);
    }
    if node.get_ref().is_float() || node.get_ref().is_integer() {
        return number(source, node, what).map(|n| Spanned::new(n.span(), format!("{:?}", n.get_ref())));
    }
    wrong_type(source, node, what, "a number or an expression in quotes");
    None
}

/// One amplitude, or a table of amplitudes by source.
fn noise(source: &Source, state: &Table<'_>, node: &Node<'_>) -> Named<String> {
    if node.get_ref().is_table() {
        return named_texts(source, &state.free_entries("noise"));
    }
    let unnamed = Spanned::new(node.span(), String::new());
    value(source, node, "`noise`").map(|value| (unnamed, value)).into_iter().collect()
}

/// One expression, or a table of named terms.
fn rate(source: &Source, state: &Table<'_>, node: &Node<'_>) -> Named<String> {
    if node.get_ref().is_table() {
        return named_texts(source, &state.free_entries("rate"));
    }
    if node.get_ref().is_str() {
        let unnamed = Spanned::new(node.span(), String::new());
        return text(source, node, "`rate`").map(|value| (unnamed, value)).into_iter().collect();
    }
    wrong_type(source, node, "`rate`", "an expression in quotes or a table of named terms");
    Vec::new()
}

/// The meanings of parameters, by name.
fn roles(source: &Source, model: &Table<'_>) -> Vec<(Spanned<String>, Role)> {
    let named = named_texts(source, &model.free_entries("roles"));
    named.into_iter().map(|(parameter, name)| (parameter, named_role(source, &name))).collect()
}

/// Reads `[[effects]]`.
pub(crate) fn effects(source: &Source, root: &Table<'_>) -> Vec<EffectSection> {
    let keys = ["name", "says", "source", "built_in", "adds", "parameters", "states", "confounders"];
    root.tables("effects", "[[effects]]", &keys).iter().map(|t| effect(source, t)).collect()
}

fn effect(source: &Source, t: &Table<'_>) -> EffectSection {
    let built_in = t.text("built_in");
    if built_in.is_none() {
        if t.get("adds").is_none() {
            t.missing(
                "adds",
                "such as `[ { to = \"x\", term = \"-q*x\" } ]`, or `built_in` with an effect's name",
            );
        }
        if t.get("parameters").is_none() {
            t.missing("parameters", "at least the amplitude, such as `[ { name = \"q\", range = [0, 5] } ]`");
        }
    }
    let add = |a: &Table<'_>| {
        let to = a.required_text("to", "a state, an output, an input or a parameter of the model");
        (to, a.required_text("term", "an expression"))
    };
    let states = t.tables("states", "a state of an effect", &["name", "unit", "initial", "rate"]);
    EffectSection {
        name: t.required_text("name", "how the study and the report call it"),
        says: t.text("says").map(Spanned::into_inner).unwrap_or_default(),
        source: t.text("source").map(Spanned::into_inner).unwrap_or_default(),
        built_in,
        adds: t.tables("adds", "an entry of `adds`", &["to", "term"]).iter().map(add).collect(),
        parameters: effect_parameters(t),
        states: states.iter().map(|s| state(source, s)).collect(),
        confounders: t.texts("confounders").into_iter().map(Spanned::into_inner).collect(),
    }
}

fn effect_parameters(effect: &Table<'_>) -> Vec<EffectParameterSection> {
    let read = |t: Table<'_>| EffectParameterSection {
        name: t.required_text("name", "how the terms call it"),
        unit: unit(&t),
        range: t.interval("range").map(Spanned::into_inner),
        grid: t.numbers("grid").into_iter().map(Spanned::into_inner).collect(),
        rounds: t.flag("rounds").is_some_and(Spanned::into_inner),
    };
    let keys = ["name", "unit", "range", "grid", "rounds"];
    effect.tables("parameters", "a parameter of an effect", &keys).into_iter().map(read).collect()
}
