//! Motion along switching surfaces, several at once and under several names, on problems with closed-form solutions.

use std::collections::BTreeMap;

use starlings_models_core::effect::{Addition, EffectDef, EffectParameter, Extended};
use starlings_models_core::equations::{EquationsDef, EquationsModel, InputDef, Method, StateDef};
use starlings_models_core::segment::{History, Segment};
use starlings_models_core::{Model, ModelFailure};

struct Ramp;

impl History for Ramp {
    fn at(&self, _: usize, t: f64) -> f64 {
        t
    }
}

fn model(states: &[(&str, &str, &str)], method: Method) -> EquationsModel {
    let state = |(name, initial, rate): &(&str, &str, &str)| StateDef {
        name: (*name).to_owned(),
        initial: (*initial).to_owned(),
        rate: vec![((*name).to_owned(), (*rate).to_owned())],
        ..StateDef::default()
    };
    let mut def = EquationsDef {
        states: states.iter().map(state).collect(),
        inputs: vec![InputDef { name: "u".to_owned(), ..InputDef::default() }],
        ..EquationsDef::default()
    };
    def.solver.method = method;
    EquationsModel::new(&def).expect("valid equations")
}

/// The model with terms added to the rate of a state, each with an amplitude of its own, in the order of its parameters.
fn with_terms(model: EquationsModel, to: &str, terms: &[&str]) -> Extended {
    let effect = |(i, term): (usize, &&str)| EffectDef {
        name: format!("effect {i}"),
        adds: vec![Addition { to: to.to_owned(), term: format!("a{i}*{term}") }],
        parameters: vec![EffectParameter { name: format!("a{i}"), ..EffectParameter::default() }],
        ..EffectDef::default()
    };
    let effects: Vec<EffectDef> = terms.iter().enumerate().map(effect).collect();
    Extended::new(Box::new(model), &effects, &BTreeMap::new()).expect("effects that fit")
}

/// Runs over `[0, end]` in `pieces` equal windows with the input u = t and at most so many steps.
fn run(
    model: &dyn Model,
    theta: &[f64],
    end: f64,
    pieces: u32,
    max_steps: u64,
) -> Result<Vec<f64>, ModelFailure> {
    let mut x = vec![0.0; model.spec().n_state()];
    model.initial(theta, &mut x);
    let limits = starlings_models_core::limits::Limits::at_most(max_steps);
    let time = |i: u32| end * f64::from(i) / f64::from(pieces);
    for i in 0..pieces {
        let (t0, t1) = (time(i), time(i + 1));
        let segment =
            Segment { t0, t1, u0: &[t0], slope: &[1.0], history: &Ramp, limits: &limits, noise: None };
        model.advance(segment, theta, &mut x)?;
    }
    Ok(x)
}

const ADAPTIVE: [Method; 3] = [Method::Auto, Method::Dopri5, Method::Rosenbrock];

/// The tolerance of 1e-8 per step and the width of the last bracket, over a few dozen steps.
const CLOSE: f64 = 1e-7;

/// Steps of a run that crosses or follows surfaces a few times: an attempt to narrow a crossing down counts as one.
const FEW: u64 = 1000;

fn assert_close(value: f64, exact: f64, what: &str) {
    assert!((value - exact).abs() < CLOSE * (1.0 + exact.abs()), "{what}: {value} against {exact}");
}

#[test]
fn a_kink_of_an_effect_where_the_model_has_one_is_no_second_surface() {
    // v' = -sign(v) from 1 stops at t = 1 after 1/2 and stays, whatever else has a kink at rest, absent as it is.
    for terms in [
        &["abs(v)*v"][..],
        &["sign(v)", "max(v, 0)"],
        &["min(-v, 0)", "sign(2*v)", "abs(v^3)", "if(v > 0, v, 0)"],
    ] {
        for method in ADAPTIVE {
            for pieces in [1, 30] {
                let block = model(&[("x", "0", "v"), ("v", "1", "-sign(v)")], method);
                let block = with_terms(block, "v", terms);
                let theta = vec![0.0; terms.len()];
                let x = run(&block, &theta, 5.0, pieces, FEW * u64::from(pieces)).expect("few steps");
                assert_close(x[0], 0.5, &format!("braking distance with {terms:?}"));
                assert_close(x[1], 0.0, "held");
            }
        }
    }
}

#[test]
fn dry_friction_that_two_effects_share_stops_a_block_as_one_does() {
    // v' = -(0.4 + 0.6) sign(v) - 0.5 |v| v from 1: 1/v² + ... stops at t = atan(sqrt(0.5))/sqrt(0.5) after ln(1.5).
    let block = model(&[("x", "0", "v"), ("v", "1", "-0.4*sign(v)")], Method::Auto);
    let block = with_terms(block, "v", &["sign(v)", "abs(v)*v"]);
    let stop = 0.5_f64.sqrt().atan() / 0.5_f64.sqrt();
    let before = run(&block, &[-0.6, -0.5], stop - 1e-3, 1, FEW).expect("few steps");
    let after = run(&block, &[-0.6, -0.5], stop + 1e-3, 1, FEW).expect("few steps");
    // Just before the stop the deceleration is 1.
    assert!((before[1] - 1e-3).abs() < 1e-6, "a millisecond before the stop: {}", before[1]);
    assert_close(after[1], 0.0, "at rest after the stop");
    let rest = run(&block, &[-0.6, -0.5], 5.0, 1, FEW).expect("few steps");
    assert_close(rest[0], 1.5_f64.ln(), "braking distance");
}

#[test]
fn two_blocks_are_held_at_once_and_break_loose_one_after_the_other() {
    // v' = -sign(v) from 1 and w' = t - 2 sign(w) from -1: w turns at rest, v stays; w is held until t = 2.
    let states = [("x", "0", "v"), ("v", "1", "-sign(v)"), ("y", "0", "w"), ("w", "0", "u - 3*sign(w)")];
    for method in ADAPTIVE {
        for pieces in [1, 7, 100] {
            let blocks = model(&states, method);
            let x = run(&blocks, &[], 5.0, pieces, FEW * u64::from(pieces)).expect("few steps");
            assert_close(x[0], 0.5, &format!("way of the first, {method:?} in {pieces}"));
            assert_close(x[1], 0.0, "the first rests");
            assert_close(x[3], 2.0, "the second moves since t = 3");
            assert_close(x[2], 8.0 / 6.0, "way of the second");
        }
    }
}

#[test]
fn blocks_that_a_spring_joins_rest_where_friction_holds_both() {
    // The force between them, 0.8 at most, is below the friction of 1 each: both stop and stay.
    let states = [
        ("x", "0", "v"),
        ("v", "0.4", "-sign(v) - (x - y)"),
        ("y", "0", "w"),
        ("w", "-0.4", "-sign(w) + (x - y)"),
    ];
    let blocks = model(&states, Method::Auto);
    let x = run(&blocks, &[], 20.0, 40, 40 * FEW).expect("few steps");
    assert_close(x[1], 0.0, "the first rests");
    assert_close(x[3], 0.0, "the second rests");
    // By symmetry d = x - y obeys d'' = -2 - 2 d from d' = 0.8: it stops where (d + 1)² = 1 + 0.8²/2.
    assert_close(x[0] - x[2], 1.32_f64.sqrt() - 1.0, "distance");
}

#[test]
fn a_block_on_a_belt_sticks_and_slips_in_the_exact_period() {
    // x'' = -x + friction of a belt of speed 1: 1.5 where their speeds differ by less than 0.001, else 1.
    let states = [("x", "0.5", "v"), ("v", "1", "-x + if(abs(v - 1) < 0.001, 1.5, 1)*sign(1 - v)")];
    let block = model(&states, Method::Auto);
    // It sticks until x = 1.5, then moves as x - 1.5 = sin out of the band, then as x - 1 = a cos + b sin until its speed is b again,
    let (b, start) = (0.999_f64, 0.999_f64.acos());
    let a = 0.5 + start.sin();
    let slip = 2.0 * std::f64::consts::PI - 2.0 * a.atan2(b);
    // then as x - 1.5 = b sin - (a + 0.5) cos up to the speed of the belt.
    let catch = (1.0 / (a + 0.5).hypot(b)).asin() - b.atan2(a + 0.5);
    let caught = 1.5 + b * catch.sin() - (a + 0.5) * catch.cos();
    let period = start + slip + catch + 1.5 - caught;
    let third = 1.0 + 3.0 * period;
    let x = run(&block, &[], third - 0.3, 1, 20 * FEW).expect("few steps");
    // What leaves a rest by an acceleration that grows from zero is late by the root of its error: 1e-8 of the speed are 2e-7 of time.
    assert!((x[0] - 1.2).abs() < 1e-5, "on the belt at the end of the third period: {}", x[0]);
    assert_close(x[1], 1.0, "with the belt");
}

#[test]
fn a_tank_stays_at_its_rim_while_more_flows_in_and_falls_when_less_does() {
    // h' = 2 - u, what would rise above the rim at 1 runs over: full at t = 2 - sqrt(2), falls from t = 2 on.
    for overflow in ["if(h < 1, 2 - u, min(2 - u, 0))", "2 - u - if(h > 1, 5, 0)"] {
        for pieces in [1, 50] {
            let tank = model(&[("h", "0", overflow)], Method::Auto);
            let full = run(&tank, &[], 1.9, pieces, FEW * u64::from(pieces)).expect(overflow);
            assert_close(full[0], 1.0, &format!("at the rim with {overflow} in {pieces}"));
            let later = run(&tank, &[], 3.0, pieces, FEW * u64::from(pieces)).expect("few steps");
            assert_close(later[0], 0.5, "below the rim");
        }
    }
}

#[test]
fn friction_that_stiffens_a_sliding_motion_does_not_slow_it_down() {
    // Held at v = 0 while z' = 1e5 (x - z) would take steps of 1e-5.
    let states = [("x", "1", "v"), ("v", "0", "-sign(v)"), ("z", "0", "1e5*(x - z)")];
    let x = run(&model(&states, Method::Auto), &[], 50.0, 1, FEW).expect("few steps");
    assert_close(x[2], 1.0, "at its quasi-steady value");
}

#[test]
fn switching_points_that_accumulate_end_at_rest() {
    // Fuller (1960): infinitely many of them in a finite time.
    let model = model(&[("x", "1", "v"), ("v", "0", "-sign(x + 0.4*v*abs(v))")], Method::Auto);
    let x = run(&model, &[], 10.0, 1, 10 * FEW).expect("few steps");
    assert_close(x[0], 0.0, "at rest");
    assert_close(x[1], 0.0, "at rest");
}

#[test]
fn a_state_that_turns_around_a_corner_without_end_is_given_up_after_a_few_thousand_steps() {
    // On a square of half a diagonal of 1e-9, once around in 4e-9: nothing holds it, and nothing is resolved.
    let model = model(&[("x", "1e-9", "-sign(y)"), ("y", "0", "sign(x)")], Method::Auto);
    let ended = run(&model, &[], 10.0, 1, 10 * FEW);
    assert!(matches!(ended, Err(ModelFailure::StepTooSmall { .. })), "{ended:?}");
}
