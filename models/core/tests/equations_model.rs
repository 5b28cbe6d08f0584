//! Models of equations: what they say of themselves and what they compute.

#![allow(clippy::float_cmp)]

mod equations_kit;

use equations_kit::{Square, input, oscillator, output, outputs, state, text};
use starlings_models_core::equations::{EquationsDef, EquationsModel, Method};
use starlings_models_core::limits::Limits;
use starlings_models_core::segment::{Drive, Segment};
use starlings_models_core::{Model, Role};

fn rates(model: &EquationsModel, x: &[f64], theta: &[f64]) -> Vec<f64> {
    let mut dx = vec![0.0; x.len()];
    model.rhs(3.0, x, theta, Drive { value: &[5.0], slope: &[7.0], history: &Square }, &mut dx);
    dx
}

#[test]
fn the_specification_follows_from_the_equations() {
    let model = EquationsModel::new(&oscillator()).unwrap();
    let spec = model.spec();
    let names =
        |list: &[starlings_models_core::Quantity]| list.iter().map(|q| q.name.clone()).collect::<Vec<_>>();
    assert_eq!(spec.kind, "equations");
    assert_eq!(names(&spec.states), ["x", "v"]);
    assert_eq!(names(&spec.inputs), ["F"]);
    assert_eq!(names(&spec.outputs), ["position", "offset", "energy"]);
    assert_eq!(names(&spec.parameters), ["x0", "k", "m", "c", "bias"], "in the order of first use");
    let measures = [("position", "x"), ("offset", "x")].map(|(a, b)| (text(a), text(b)));
    assert_eq!(spec.measures, measures, "energy is not a state up to terms without states");
    assert_eq!((spec.outputs[0].unit.as_str(), spec.outputs[0].role), ("m", Role::Displacement));
    assert!(spec.restart);
}

#[test]
fn rates_outputs_and_initial_values_are_those_written() {
    let model = EquationsModel::new(&oscillator()).unwrap();
    let theta = [0.1, 8.0, 2.0, 0.5, 100.0];
    let mut x = [f64::NAN; 2];
    model.initial(&theta, &mut x);
    assert_eq!(x, [0.1, 0.0]);
    assert_eq!(rates(&model, &[2.0, 4.0], &theta), [4.0, -8.0 - 1.0 + 2.5]);
    assert_eq!(outputs(&oscillator(), &[2.0, 4.0], &theta), [2.0, 97.0, 32.0]);
}

#[test]
fn a_term_can_be_left_out() {
    let model = EquationsModel::new(&oscillator()).unwrap();
    let without = model.without(&["viscous"]).unwrap();
    let parameters: Vec<_> = without.spec().parameters.iter().map(|q| q.name.as_str()).collect();
    assert_eq!(parameters, ["x0", "k", "m", "bias"], "the term's own parameter is gone");
    assert_eq!(rates(&without, &[2.0, 4.0], &[0.1, 8.0, 2.0, 100.0]), [4.0, -8.0 + 2.5]);
    let error = model.without(&["viscus"]).unwrap_err();
    assert_eq!(error.to_string(), "no replaceable term named `viscus`; did you mean `viscous`?");
    assert!(model.without(&["spring"]).is_err(), "it exists but is not replaceable");
}

#[test]
fn a_term_shared_by_two_rates_leaves_both() {
    let def = EquationsDef {
        states: vec![
            state("a", "1", &[("flow", "-q*a")]),
            state("b", "0", &[("flow", "q*a"), ("leak", "-b")]),
        ],
        replaceable: vec![text("flow")],
        ..EquationsDef::default()
    };
    let model = EquationsModel::new(&def).unwrap().without(&["flow"]).unwrap();
    assert_eq!(rates(&model, &[2.0, 4.0], &[]), [0.0, -4.0]);
}

#[test]
fn outputs_may_use_each_other_in_any_order_and_enter_rates() {
    let mut def = oscillator();
    def.outputs = vec![output("double", "2*single"), output("single", "x + 1")];
    def.states[0].rate = vec![(text("x"), text("double*v"))];
    assert_eq!(outputs(&def, &[2.0, 4.0], &[0.0; 5]), [6.0, 3.0]);
    let model = EquationsModel::new(&def).unwrap();
    assert_eq!(rates(&model, &[2.0, 4.0], &[0.0, 8.0, 2.0, 0.5])[0], 24.0);
    assert_eq!(model.spec().measures, [(text("single"), text("x"))]);
}

#[test]
fn ddt_is_the_slope_of_an_input_and_the_total_derivative_of_an_output_or_state() {
    let theta = [0.1, 8.0, 2.0, 0.5];
    let value = |expression: &str| {
        let mut def = oscillator();
        def.outputs = vec![output("y", "x^2*F + t"), output("z", expression)];
        outputs(&def, &[2.0, 4.0], &theta)[1]
    };
    let acceleration = -8.0 - 1.0 + 2.5;
    assert_eq!(value("ddt(F)"), 7.0);
    assert_eq!(value("ddt(x)"), 4.0);
    assert_eq!(value("ddt(v)"), acceleration);
    assert_eq!(value("ddt(y)"), 2.0 * 2.0 * 4.0 * 5.0 + 4.0 * 7.0 + 1.0);
    assert_eq!(value("m*ddt(v) + c*v + k*x"), 5.0, "Newton's second law gives the force back");
}

#[test]
fn the_derivative_of_every_function_agrees_with_differences_along_the_motion() {
    let parts = "sin(x) + cos(x)*tan(x/9) + exp(x/5) + log(x)/x + sqrt(x) + abs(-x) + tanh(x/3) + min(x, 9)^2 + max(x, v) \
                 + x^v + if(x > 1, x^3, 0) + sign(x) + step(x) + 2^x";
    let mut def = oscillator();
    def.outputs = vec![output("y", parts), output("rate", "ddt(y)")];
    let theta = [0.1, 8.0, 2.0, 0.5];
    let at = |h: f64| outputs(&def, &[2.0 + h * 1.5, 1.5 + h * (-8.0 - 0.375 + 2.5)], &theta);
    let h = 1e-3;
    let value = |h: f64| at(h)[0];
    let difference = (8.0 * (value(h) - value(-h)) - (value(2.0 * h) - value(-2.0 * h))) / (12.0 * h);
    // The difference is of order four: h⁴ times a fifth derivative of some hundreds.
    assert!(
        (at(0.0)[1] - difference).abs() < 1e-8 * difference.abs().max(1.0),
        "{} {difference}",
        at(0.0)[1]
    );
}

#[test]
fn a_delay_reads_the_past_of_an_input_or_of_an_output_without_states() {
    let value = |expression: &str| {
        let mut def = oscillator();
        def.outputs = vec![output("sensor", "2*F + t"), output("z", expression)];
        outputs(&def, &[2.0, 4.0], &[0.1, 8.0, 2.0, 0.5])[1]
    };
    assert_eq!(value("delay(F, 1)"), 4.0);
    assert_eq!(value("delay(F, c)"), 6.25);
    assert_eq!(value("delay(sensor, 1)"), 2.0 * 4.0 + 2.0);
}

#[test]
fn the_jacobian_is_that_of_the_equations() {
    let def = EquationsDef {
        states: vec![state("a", "1", &[("a", "-a*b + sin(t)*F")]), state("b", "0", &[("b", "q*a^2 - b")])],
        inputs: vec![input("F")],
        ..EquationsDef::default()
    };
    let model = EquationsModel::new(&def).unwrap();
    let (mut dfdx, mut dfdt) = ([f64::NAN; 4], [f64::NAN; 2]);
    let u = Drive { value: &[5.0], slope: &[7.0], history: &Square };
    assert!(model.jacobian(3.0, &[2.0, 4.0], &[0.5], u, &mut dfdx, &mut dfdt));
    assert_eq!(dfdx, [-4.0, 2.0, -2.0, -1.0], "column by column");
    assert_eq!(dfdt, [3.0_f64.cos() * 5.0 + 3.0_f64.sin() * 7.0, 0.0]);
}

#[test]
fn every_solver_runs_the_damped_oscillator_to_its_closed_form() {
    // m = 1, k = 1.01, c = 0.2: x = e^{-t/10} (cos t + sin(t)/10) from (1, 0).
    let exact = |t: f64| (-0.1 * t).exp() * (t.cos() + 0.1 * t.sin());
    for method in [Method::Auto, Method::Dopri5, Method::Rosenbrock, Method::Fixed] {
        let mut def = oscillator();
        (def.solver.method, def.solver.step) = (method, Some(0.01));
        let model = EquationsModel::new(&def).unwrap();
        let mut x = [1.0, 0.0];
        let segment = Segment {
            t0: 0.0,
            t1: 5.0,
            u0: &[0.0],
            slope: &[0.0],
            history: &Square,
            limits: &Limits::none(),
            noise: None,
        };
        model.advance(segment, &[1.0, 1.01, 1.0, 0.2], &mut x).unwrap();
        // Some hundred steps of tolerance 1e-8; h⁴/120 for the fixed step.
        assert!((x[0] - exact(5.0)).abs() < 2e-7, "{method:?}: {} against {}", x[0], exact(5.0));
    }
}

#[test]
fn a_definition_survives_json() {
    let mut def = oscillator();
    def.states[0].range = [0.0, f64::INFINITY];
    let json = serde_json::to_string(&def).unwrap();
    assert_eq!(serde_json::from_str::<EquationsDef>(&json).unwrap(), def);
}
