//! The expression language: what it computes, what it refuses and where it says so, and its derivatives.

#![allow(clippy::float_cmp)]

use proptest::prelude::*;
use starlings_models_core::equations::{At, Direction, Expression, ExpressionError, Program, Slot};
use starlings_models_core::segment::{Drive, History};

/// Input 0 is t², so that a delay is recognised.
struct Square;

impl History for Square {
    fn at(&self, _: usize, t: f64) -> f64 {
        t * t
    }
}

const X: [f64; 2] = [3.0, -0.5];
const THETA: [f64; 2] = [2.0, 0.25];

fn at<'a>(x: &'a [f64], theta: &'a [f64]) -> At<'a> {
    At { t: 1.5, x, theta, u: Drive { value: &[2.25], slope: &[7.0], history: &Square }, y: &[11.0] }
}

fn resolve(name: &str) -> Option<Slot> {
    Some(match name {
        "x" => Slot::State(0),
        "v" => Slot::State(1),
        "k" => Slot::Parameter(0),
        "m" => Slot::Parameter(1),
        "u" => Slot::Input(0),
        "y" => Slot::Output(0),
        "g" => Slot::Constant(9.81),
        _ => return None,
    })
}

fn compile(text: &str) -> Result<Program, ExpressionError> {
    let nearest =
        |name: &str| starlings_models_core::nearest(name, ["x", "v", "k", "m", "u", "y", "g", "pressure"]);
    Expression::parse(text)?.compile(&resolve, &nearest)
}

fn value(text: &str) -> f64 {
    compile(text).unwrap_or_else(|e| panic!("{text}: {e}")).eval(&at(&X, &THETA))
}

fn fault(text: &str) -> (usize, String) {
    let error = compile(text).expect_err(text);
    (error.column, error.message)
}

#[test]
fn operators_bind_as_in_mathematics() {
    let table = [
        ("1 + 2*3", 7.0),
        ("(1 + 2)*3", 9.0),
        ("2^3^2", 512.0),
        ("-2^2", -4.0),
        ("-x^2", -9.0),
        ("(-2)^2", 4.0),
        ("2^-1", 0.5),
        ("2*-3", -6.0),
        ("2 - -3", 5.0),
        ("- -3", 3.0),
        ("+3 - 1", 2.0),
        ("8/4/2", 1.0),
        ("8 - 4 - 2", 2.0),
        ("8/4*2", 4.0),
        ("-6/2*3", -9.0),
        ("1 + 1 == 2", 1.0),
        ("1 < 2", 1.0),
        ("2 <= 2", 1.0),
        ("1 > 2", 0.0),
        ("2 >= 3", 0.0),
        ("1 != 1", 0.0),
        ("(1 < 2) == (3 < 4)", 1.0),
        ("if(1 < 2, 10, 20)", 10.0),
        ("if(0, 10, 20)", 20.0),
        ("if(x > 5, sqrt(-1), k)", 2.0),
        ("1.5e-3*1e3", 1.5),
        (".5 + 2.", 2.5),
        ("x ^ 0.5", 3.0_f64.sqrt()),
        ("x^k", 9.0),
        ("k^x", 8.0),
        ("x^-2", 1.0 / 9.0),
    ];
    for (text, expected) in table {
        assert_eq!(value(text), expected, "{text}");
    }
}

#[test]
fn functions_mean_what_they_are_called() {
    let table = [
        ("sin(x)", 3.0_f64.sin()),
        ("cos(x)", 3.0_f64.cos()),
        ("tan(x)", 3.0_f64.tan()),
        ("exp(v)", (-0.5_f64).exp()),
        ("log(x)", 3.0_f64.ln()),
        ("sqrt(x)", 3.0_f64.sqrt()),
        ("abs(v)", 0.5),
        ("sign(v)", -1.0),
        ("sign(0)", 0.0),
        ("min(x, v)", -0.5),
        ("max(x, v)", 3.0),
        ("tanh(v)", (-0.5_f64).tanh()),
        ("step(0)", 1.0),
        ("step(v)", 0.0),
        ("step(x)", 1.0),
        ("pi", std::f64::consts::PI),
        ("t", 1.5),
        ("u", 2.25),
        ("y", 11.0),
        ("g", 9.81),
        ("ddt(u)", 7.0),
        ("delay(u, 0.5)", 1.0),
        ("delay(u, m)", 1.5625),
    ];
    for (text, expected) in table {
        assert_eq!(value(text), expected, "{text}");
    }
    assert!(value("step(sqrt(v))").is_nan(), "NaN must not turn into a number");
    assert!(value("sign(sqrt(v))").is_nan(), "NaN must not turn into a number");
}

#[test]
fn constants_are_folded() {
    assert_eq!(compile("2*pi/4 + sin(0)^2 - 1").unwrap().n_operations(), 1);
    assert_eq!(compile("if(1 > 2, x, 3*4)").unwrap().n_operations(), 1);
    assert_eq!(compile("x + 2*3").unwrap().n_operations(), 2, "load x, add 6");
}

#[test]
fn faults_name_their_column_and_what_was_expected() {
    let table = [
        ("", 1, "expected a number, a name, a function or `(`, found the end"),
        ("1 +", 4, "expected a number, a name, a function or `(`, found the end"),
        ("1 + * 2", 5, "expected a number, a name, a function or `(`, found `*`"),
        ("2x", 2, "expected an operator or the end, found `x` (a product needs `*`)"),
        ("k (x)", 1, "no function named `k`; a product is written `k*(...)`"),
        ("(1 + 2", 7, "expected an operator or `)`, found the end"),
        ("1 + 2)", 6, "expected an operator or the end, found `)`"),
        ("x ** 2", 4, "expected a number, a name, a function or `(`, found `*` (a power is written `^`)"),
        ("x = 2", 3, "expected an operator or the end, found `=` (equality is written `==`)"),
        ("1 < x < 2", 7, "comparisons do not chain: put one of them in parentheses"),
        ("sin", 1, "`sin` is a function: expected `sin(...)`"),
        ("1 + sni(x)", 5, "no function named `sni`; did you mean `sin`?"),
        ("max(x)", 6, "`max` takes 2 arguments: expected `,`"),
        ("sin(x, v)", 6, "`sin` takes 1 argument: expected `)`"),
        ("if(x > 0, 1)", 12, "`if` takes 3 arguments: expected `,`"),
        ("sin()", 5, "expected a number, a name, a function or `(`, found `)`"),
        ("1.2.3", 4, "expected an operator or the end, found `.`"),
        (".", 1, "expected a number, found `.`"),
        ("1e999", 1, "`1e999` is too large a number"),
        ("x $ 2", 3, "expected an operator or the end, found `$`"),
        ("ddt(x + v)", 5, "`ddt` needs the name of an input or an output"),
        ("delay(2*u, 1)", 7, "`delay` needs the name of an input or an output"),
        ("2*presure", 3, "unknown name `presure`; did you mean `pressure`?"),
        ("2*abcdefgh", 3, "unknown name `abcdefgh`"),
        ("ε + zz", 1, "unknown name `ε`"),
        ("ddt(k)", 5, "`k` is constant: `ddt` needs an input or an output"),
        ("ddt(y)", 5, "the time derivative of `y` is not known here"),
    ];
    for (text, column, message) in table {
        assert_eq!(fault(text), (column, message.to_owned()), "{text}");
    }
}

#[test]
fn columns_count_characters_not_bytes() {
    assert_eq!(fault("\u{3bc}\u{3bc} + )").0, 6);
}

#[test]
fn deep_and_long_expressions_are_refused_and_not_fatal() {
    let deep = format!("{}x{}", "(".repeat(5000), ")".repeat(5000));
    assert!(fault(&deep).1.contains("longer than"));
    let deep = format!("{}x{}", "(".repeat(1000), ")".repeat(1000));
    assert!(fault(&deep).1.contains("nested more than"));
    let right = format!("{}x{}", "1 - (k - ".repeat(90), ")".repeat(90));
    assert!(fault(&right).1.contains("nested too deep"));
    let long = vec!["x"; 1900].join("+");
    assert_eq!(value(&long), 5700.0);
}

#[test]
fn names_come_with_the_column_of_their_first_use() {
    let names = Expression::parse("k*x + sin(t)*pi - k*delay(q, tau) + ddt(w)").unwrap().names();
    let expected = [("k", 1), ("x", 3), ("q", 27), ("tau", 30), ("w", 41)];
    assert_eq!(names, expected.map(|(n, c)| (n.to_owned(), c)));
}

#[test]
fn switching_functions_are_found_and_vanish_where_the_expression_switches() {
    let g = |text: &str| -> Vec<f64> {
        let list = Expression::parse(text).unwrap().discontinuities();
        list.iter().map(|e| e.compile(&resolve, &|_| None).unwrap().eval(&at(&X, &THETA))).collect()
    };
    assert_eq!(g("sign(x - 3) + step(v)"), [0.0, -0.5]);
    assert_eq!(g("max(x - k, 0)"), [1.0]);
    assert_eq!(g("if(x > k, abs(v), 1)"), [1.0, -0.5]);
    assert_eq!(g("min(x, v) + min(x, v)"), [3.5], "the same one is listed once");
    assert!(g("x*v + sin(t)").is_empty());
    assert!(g("abs(3)").is_empty(), "a constant never switches");
}

#[test]
fn derivatives_pass_through_branches() {
    let slope = |text: &str| {
        let direction = Direction { x: &[1.0, 10.0], ..Direction::default() };
        compile(text).unwrap().eval_dual(&at(&X, &THETA), &direction).1
    };
    assert_eq!(slope("if(x > 2, x^2, v)"), 6.0);
    assert_eq!(slope("if(x > 4, x^2, v)"), 10.0);
    assert_eq!(slope("min(x, v)"), 10.0);
    assert_eq!(slope("max(x, v)"), 1.0);
    assert_eq!(slope("abs(v)"), -10.0);
    assert_eq!(slope("sqrt(k - 2)"), 0.0, "nothing moves under the root, although its slope is infinite");
    assert_eq!(slope("x^0"), 0.0);
    assert_eq!(slope("(k - 2)^x"), 0.0, "0^x stays 0 although log 0 is infinite");
}

#[test]
fn derivatives_follow_time_parameters_inputs_and_outputs() {
    let direction = Direction { t: 1.0, x: &[], theta: &[1.0], u: &[100.0], y: &[1000.0] };
    let slope = |text: &str| compile(text).unwrap().eval_dual(&at(&X, &THETA), &direction).1;
    assert_eq!(slope("t^2 + x"), 3.0);
    assert_eq!(slope("k*x"), 3.0);
    assert_eq!(slope("2*u + m"), 200.0);
    assert_eq!(slope("y"), 1000.0);
    // d/dt (t - 0.5)² = 2; the delayed input's slope is a difference of length 1e-7, good to about 1e-8.
    assert!((slope("delay(u, 0.5)") - 2.0).abs() < 1e-6);
}

/// Texts of smooth expressions of x, v and k whose values stay moderate.
fn smooth() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        Just("x".to_owned()),
        Just("v".to_owned()),
        Just("k".to_owned()),
        Just("t".to_owned()),
        (-3.0..3.0_f64).prop_map(|n| format!("({n:.3})")),
    ];
    leaf.prop_recursive(4, 24, 2, |inner| {
        prop_oneof![
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("({a} + {b})")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("({a} - {b})")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("({a}*{b})")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("({a}/(2 + {b}^2))")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("(1.5 + sin({a}))^tanh({b})")),
            inner.clone().prop_map(|a| format!("sin({a})")),
            inner.clone().prop_map(|a| format!("cos({a})")),
            inner.clone().prop_map(|a| format!("tanh({a})")),
            inner.clone().prop_map(|a| format!("exp(tanh({a}))")),
            inner.clone().prop_map(|a| format!("log(1 + {a}^2)")),
            inner.clone().prop_map(|a| format!("sqrt(1 + {a}^2)")),
            inner.clone().prop_map(|a| format!("tan(tanh({a}))")),
            inner.prop_map(|a| format!("-tanh({a})^3")),
        ]
    })
}

proptest! {
    #[test]
    fn the_derivative_is_the_limit_of_differences(
        text in smooth(), x in -2.0..2.0_f64, v in -2.0..2.0_f64, k in 0.1..2.0_f64,
        dx in -1.0..1.0_f64, dv in -1.0..1.0_f64, dk in -1.0..1.0_f64,
    ) {
        let program = compile(&text).unwrap();
        let moved = |h: f64| program.eval(&at(&[x + h * dx, v + h * dv], &[k + h * dk, 0.0]));
        let along = Direction { x: &[dx, dv], theta: &[dk], ..Direction::default() };
        let (value, slope) = program.eval_dual(&at(&[x, v], &[k, 0.0]), &along);
        prop_assert_eq!(value.to_bits(), moved(0.0).to_bits());
        // Differences of order 4: the error is h⁴ times the fifth derivative and rounding over h.
        let h = 1e-3;
        let difference = (8.0 * (moved(h) - moved(-h)) - (moved(2.0 * h) - moved(-2.0 * h))) / (12.0 * h);
        let coarse = (8.0 * (moved(2.0 * h) - moved(-2.0 * h)) - (moved(4.0 * h) - moved(-4.0 * h))) / (24.0 * h);
        // The two step lengths tell how well the difference itself is known.
        let unsure = (coarse - difference).abs();
        prop_assert!((slope - difference).abs() <= 1e-8 * (1.0 + slope.abs() + value.abs()) + unsure, "{slope} {difference}");
    }

    #[test]
    fn no_text_makes_the_parser_panic(text in "[-+*/^()<>=!,. a-e0-9]{0,40}") {
        if let Err(e) = compile(&text) {
            prop_assert!(e.column >= 1 && e.column <= text.chars().count() + 1);
        }
    }
}

#[test]
fn a_product_has_its_moving_names_in_no_sum_function_or_condition() {
    let is_product =
        |text: &&str| Expression::parse(text).unwrap().is_product_in(&|name| "xyv".contains(name));
    let products = ["-k*x", "k*x*y/v^2", "(1 + k)*x", "exp(k)*x^2", "-(x/y)", "t*x", "x^-1", "x^k"];
    let others = ["-k*(x - m)", "k*x + y", "exp(-k/x)*y", "x^k*y^v", "sin(k*t)", "if(x > 1, k, 0)"];
    assert!(products.iter().all(is_product) && !others.iter().any(is_product));
}
