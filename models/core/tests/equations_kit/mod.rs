//! A driven oscillator as equations, and the parts of which a test makes others.

#![allow(dead_code)] // every test file uses its own part

use starlings_models_core::Model;
use starlings_models_core::Role;
use starlings_models_core::equations::{EquationsDef, EquationsModel, InputDef, OutputDef, StateDef};
use starlings_models_core::segment::{Drive, History};

/// Every input is t² in its past.
pub(crate) struct Square;

impl History for Square {
    fn at(&self, _: usize, t: f64) -> f64 {
        t * t
    }
}

pub(crate) fn text(s: &str) -> String {
    s.to_owned()
}

pub(crate) fn state(name: &str, initial: &str, rate: &[(&str, &str)]) -> StateDef {
    let rate = rate.iter().map(|(term, value)| (text(term), text(value))).collect();
    StateDef { name: text(name), initial: text(initial), rate, ..StateDef::default() }
}

pub(crate) fn output(name: &str, value: &str) -> OutputDef {
    OutputDef { name: text(name), value: text(value), ..OutputDef::default() }
}

pub(crate) fn input(name: &str) -> InputDef {
    InputDef { name: text(name), ..InputDef::default() }
}

/// A driven oscillator with named terms.
pub(crate) fn oscillator() -> EquationsDef {
    let mut x = state("x", "x0", &[("x", "v")]);
    (x.unit, x.role) = (text("m"), Role::Displacement);
    let terms = [("spring", "-k*x/m"), ("viscous", "-c*v/m"), ("drive", "F/m")];
    EquationsDef {
        states: vec![x, state("v", "0", &terms)],
        outputs: vec![
            output("position", "x"),
            output("offset", "x + bias - F"),
            output("energy", "m*v^2/2 + k*x^2/2"),
        ],
        inputs: vec![input("F")],
        replaceable: vec![text("viscous")],
        ..EquationsDef::default()
    }
}

pub(crate) fn outputs(def: &EquationsDef, x: &[f64], theta: &[f64]) -> Vec<f64> {
    let model = EquationsModel::new(def).expect("valid equations");
    let mut y = vec![0.0; def.outputs.len()];
    model.output(3.0, x, theta, Drive { value: &[5.0], slope: &[7.0], history: &Square }, &mut y);
    y
}
