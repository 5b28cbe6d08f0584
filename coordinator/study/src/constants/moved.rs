//! The fixed numbers of a study's model, each as a setup in which it is a little larger.
//!
//! Constants of the study, parameters of a built-in model at their defaults, the numbers of a layout (all of one key together),
//! and a given initial state as a whole. Whole numbers of a layout are counts and are not moved. Next file to read:
//! [`starlings_models::Setup`].

use std::collections::BTreeMap;

use serde_json::Value;
use starlings_models::solver::SOLVER;
use starlings_models::{BuildSetup, Setup};

use crate::Study;
use crate::expand::INITIAL;

/// Share by which a constant is moved: upwards, or downwards where the model allows no more.
const STEPS: [f64; 2] = [0.01, -0.01];

/// A constant and the setup with it moved.
pub struct Moved {
    /// Its name.
    pub name: String,
    /// Its value, where it is one number.
    pub value: Option<f64>,
    /// The share by which it is moved and the setup; `None` for a constant of value zero, or that the model refuses.
    pub setup: Option<(f64, Setup)>,
}

/// Every constant of the study's model that has a name.
pub fn all(study: &Study) -> Vec<Moved> {
    let mut found = Vec::new();
    for (name, value) in numbers(study) {
        let raised = |setup: &mut Setup, by: f64| {
            setup.model.constants.insert(name.clone(), value * by);
        };
        let setup = if value.abs() > 0.0 { moved(study, raised) } else { None };
        found.push(Moved { name, value: Some(value), setup });
    }
    for key in layout_keys(study) {
        let raised = |setup: &mut Setup, by: f64| {
            if let Some(layout) = &mut setup.model.layout {
                scale(layout, &key, by);
            }
        };
        let setup = moved(study, raised);
        found.push(Moved { name: format!("layout:{key}"), value: None, setup });
    }
    if study.setup.model.constants.keys().any(|name| name.starts_with(INITIAL)) {
        let raised = |setup: &mut Setup, by: f64| {
            let initial = setup.model.constants.iter_mut().filter(|(name, _)| name.starts_with(INITIAL));
            initial.for_each(|(_, value)| *value *= by);
        };
        found.push(Moved { name: "initial".to_owned(), value: None, setup: moved(study, raised) });
    }
    found
}

/// How many there are, without their setups.
pub(super) fn count(study: &Study) -> usize {
    let given = study.setup.model.constants.keys().any(|name| name.starts_with(INITIAL));
    numbers(study).len() + layout_keys(study).len() + usize::from(given)
}

/// The first step that the model accepts, where it can be asked in this process.
fn moved(study: &Study, raise: impl Fn(&mut Setup, f64)) -> Option<(f64, Setup)> {
    let sound = |setup: &Setup| {
        study.setup.model.kind == SOLVER
            || (setup.build().is_ok()
                && setup.spec().is_ok_and(|spec| spec.n_state() == study.spec.n_state()))
    };
    let by = |step: f64| {
        let mut setup = study.setup.clone();
        raise(&mut setup, 1.0 + step);
        (step, setup)
    };
    STEPS.into_iter().map(by).find(|(_, setup)| sound(setup))
}

/// Constants of the study, and defaults of a model in this program; initial values are not among them.
fn numbers(study: &Study) -> BTreeMap<String, f64> {
    let constants = &study.setup.model.constants;
    let mut all = BTreeMap::new();
    if study.setup.model.kind != SOLVER {
        let free = |name: &String| !study.setup.parameters.contains(name);
        let defaults = study.spec.parameters.iter().filter(|q| free(&q.name));
        all.extend(defaults.filter_map(|q| Some((q.name.clone(), q.default?))));
    }
    all.extend(
        constants.iter().filter(|(name, _)| !name.starts_with(INITIAL)).map(|(name, v)| (name.clone(), *v)),
    );
    all
}

/// Keys of the layout under which there are numbers with a fractional part or a point, once each.
fn layout_keys(study: &Study) -> Vec<String> {
    let mut keys = Vec::new();
    if let Some(layout) = &study.setup.model.layout {
        gather(layout, &mut keys);
    }
    keys.sort();
    keys.dedup();
    keys
}

fn gather(value: &Value, keys: &mut Vec<String>) {
    match value {
        Value::Object(entries) => {
            for (key, value) in entries {
                if is_measure(value) {
                    keys.push(key.clone());
                }
                gather(value, keys);
            }
        }
        Value::Array(all) => all.iter().for_each(|value| gather(value, keys)),
        _ => {}
    }
}

/// A number written with a point: a length, not a count. Zero is left out: one per cent of it is zero.
fn is_measure(value: &Value) -> bool {
    matches!(value, Value::Number(n) if n.is_f64() && n.as_f64().is_some_and(|v| v.abs() > 0.0))
}

/// Raises every number of this key.
fn scale(value: &mut Value, key: &str, by: f64) {
    match value {
        Value::Object(entries) => {
            for (name, value) in entries.iter_mut() {
                if name == key && is_measure(value) {
                    *value = value.as_f64().map_or(Value::Null, |v| Value::from(v * by));
                }
                scale(value, key, by);
            }
        }
        Value::Array(all) => all.iter_mut().for_each(|value| scale(value, key, by)),
        _ => {}
    }
}
