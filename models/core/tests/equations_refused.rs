//! Equations that cannot be: what is refused, where, and with which remedy.

mod equations_kit;

use equations_kit::{oscillator, output, outputs, text};
use starlings_models_core::SetupError;
use starlings_models_core::equations::{EquationsDef, EquationsModel, Method};

fn refused(change: impl FnOnce(&mut EquationsDef)) -> SetupError {
    let mut def = oscillator();
    change(&mut def);
    EquationsModel::new(&def).expect_err("invalid equations")
}

#[test]
fn faults_name_place_text_and_column() {
    let expression = |change: fn(&mut EquationsDef)| match refused(change) {
        SetupError::Expression { place, expression, column, message } => (place, expression, column, message),
        other => panic!("{other}"),
    };
    let (place, written, column, message) = expression(|def| def.states[1].rate[1].1 = text("-c*sni(v)"));
    assert_eq!(
        (place.as_str(), written.as_str(), column),
        ("term `viscous` of the rate of `v`", "-c*sni(v)", 4)
    );
    assert_eq!(message, "no function named `sni`; did you mean `sin`?");
    let (place, _, column, _) = expression(|def| def.states[0].rate[0].1 = text("v +"));
    assert_eq!((place.as_str(), column), ("rate of `x`", 4));
    let (place, _, column, message) = expression(|def| def.states[0].initial = text("2*v"));
    assert_eq!((place.as_str(), column), ("initial value of `x`", 3));
    assert_eq!(message, "an initial value may use only parameters: `v` is not one");
    let (_, _, column, _) = expression(|def| def.states[0].initial = text("tau + t"));
    assert_eq!(column, 7);
    let (place, _, column, message) = expression(|def| def.outputs[2].value = text("1 + energy"));
    assert_eq!((place.as_str(), column), ("output `energy`", 5));
    assert_eq!(message, "`energy` would depend on itself");
    let (place, _, column, message) = expression(|def| def.states[1].rate[1].1 = text("-c*ddt(v)"));
    assert_eq!((place.as_str(), column), ("term `viscous` of the rate of `v`", 8));
    assert_eq!(message, "`ddt(v)` would depend on itself");
    let (_, _, column, message) = expression(|def| def.outputs[2].value = text("ddt(k)"));
    assert_eq!((column, message.as_str()), (5, "`k` is constant: `ddt` needs an input or an output"));
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let says = |change: fn(&mut EquationsDef), part: &str| {
        let message = refused(change).to_string();
        assert!(message.contains(part), "{message}");
    };
    says(|def| def.states.clear(), "no state");
    says(|def| def.states[0].rate.clear(), "state `x` has no rate");
    says(|def| def.states[0].initial.clear(), "state `x` has no initial value");
    says(|def| def.states[1].name = text("x"), "`x` is given twice");
    says(|def| def.inputs[0].name = text("v"), "`v` is given twice");
    says(|def| def.outputs[1].name = text("position"), "`position` is given twice");
    says(|def| def.outputs[1].name = text("v"), "`v` is given twice");
    says(|def| def.states[1].rate[1].0 = text("spring"), "`spring in the rate of v` is given twice");
    says(|def| def.replaceable.push(text("sprin")), "no rate term named `sprin`; did you mean `spring`?");
    says(|def| def.inputs[0].name = text("sin"), "has a meaning in expressions");
    says(|def| def.inputs[0].name = text("2F"), "cannot be the name of an input");
    says(|def| def.states[0].name = text("t"), "`t` cannot be the name of a state: it has a meaning");
    says(|def| def.states[0].range = [1.0, -1.0], "the range of state `x` is [1, -1]");
    says(|def| def.states[0].range = [f64::NAN, 1.0], "the range of state `x` is [NaN, 1]");
    says(|def| def.solver.rtol = 0.0, "must be positive");
    says(|def| def.solver.method = Method::Fixed, "needs a positive `step`");
}

#[test]
fn a_long_chain_of_outputs_is_refused_and_not_fatal() {
    let mut def = oscillator();
    def.outputs = vec![output("y0", "x")];
    for i in 1..10 {
        def.outputs.push(output(&format!("y{i}"), &format!("y{}{}", i - 1, "+x".repeat(1900))));
    }
    let error = EquationsModel::new(&def).unwrap_err().to_string();
    assert!(error.contains("nested 38") && error.contains("use states for some of them"), "{error}");
}

#[test]
fn an_output_may_have_the_name_of_the_state_that_it_is() {
    let mut def = oscillator();
    def.outputs = vec![output("x", "x"), output("twice", "2*x")];
    assert_eq!(outputs(&def, &[2.0, 4.0], &[0.1, 8.0, 2.0, 0.5]), [2.0, 4.0]);
}
