//! The integrators across jumps, kinks and along switching surfaces, on problems with closed-form solutions.

use starlings_models_core::equations::{EquationsDef, EquationsModel, InputDef, Method, StateDef};
use starlings_models_core::limits::Limits;
use starlings_models_core::segment::{History, Segment};
use starlings_models_core::{Model, ModelFailure};

struct Ramp;

impl History for Ramp {
    fn at(&self, _: usize, t: f64) -> f64 {
        t
    }
}

fn state(name: &str, initial: &str, rate: &str) -> StateDef {
    StateDef {
        name: name.to_owned(),
        initial: initial.to_owned(),
        rate: vec![(name.to_owned(), rate.to_owned())],
        ..StateDef::default()
    }
}

fn model(states: &[(&str, &str, &str)], method: Method) -> EquationsModel {
    let mut def = EquationsDef {
        states: states.iter().map(|(name, initial, rate)| state(name, initial, rate)).collect(),
        inputs: vec![InputDef { name: "u".to_owned(), ..InputDef::default() }],
        ..EquationsDef::default()
    };
    def.solver.method = method;
    EquationsModel::new(&def).expect("valid equations")
}

/// Runs over `[0, end]` in `pieces` equal windows; the input is u = t.
fn run(model: &EquationsModel, end: f64, pieces: u32) -> Result<Vec<f64>, ModelFailure> {
    let mut x = vec![0.0; model.spec().n_state()];
    model.initial(&[], &mut x);
    let time = |i: u32| end * f64::from(i) / f64::from(pieces);
    for i in 0..pieces {
        let (t0, t1) = (time(i), time(i + 1));
        model.advance(
            Segment {
                t0,
                t1,
                u0: &[t0],
                slope: &[1.0],
                history: &Ramp,
                limits: &Limits::none(),
                noise: None,
            },
            &[],
            &mut x,
        )?;
    }
    Ok(x)
}

const ADAPTIVE: [Method; 3] = [Method::Auto, Method::Dopri5, Method::Rosenbrock];

/// The tolerance of 1e-8 per step and the width of the last bracket, over a few dozen steps.
const CLOSE: f64 = 1e-7;

fn assert_close(value: f64, exact: f64, what: &str) {
    assert!((value - exact).abs() < CLOSE * (1.0 + exact.abs()), "{what}: {value} against {exact}");
}

#[test]
fn a_switched_force_keeps_the_tolerance() {
    // x' = -x + step(sin t): in each half period towards 1 or 0.
    for method in ADAPTIVE {
        for pieces in [1, 7, 400] {
            let x = run(&model(&[("x", "0", "-x + step(sin(t))")], method), 10.0, pieces).unwrap();
            let pi = std::f64::consts::PI;
            let decay = (-pi).exp();
            let first = 1.0 - decay;
            let second = 1.0 - (1.0 - first * decay) * decay;
            // 10 lies 10 - 3π after the third half period, in which the force was on, and sin is negative there.
            let exact = second * (-(10.0 - 3.0 * pi)).exp();
            assert_close(x[0], exact, &format!("{method:?} in {pieces}"));
        }
    }
}

#[test]
fn a_force_that_starts_on_a_window_boundary_keeps_the_tolerance() {
    for condition in ["t >= 1", "t > 1"] {
        for pieces in [1, 2, 20] {
            let rate = format!("if({condition}, 3, 0)");
            let x = run(&model(&[("x", "0", &rate)], Method::Auto), 2.0, pieces).unwrap();
            assert_close(x[0], 3.0, &format!("{condition} in {pieces}"));
        }
    }
}

#[test]
fn a_spring_that_stiffens_at_a_stop_keeps_its_energy() {
    // x'' = -x - 99 max(x - 1, 0), from (0, 2): the energy v²/2 + x²/2 + 99/2 max(x - 1, 0)² stays 2.
    for method in ADAPTIVE {
        let states = [("x", "0", "v"), ("v", "2", "-x - 99*max(x - 1, 0)")];
        let x = run(&model(&states, method), 20.0, 1).unwrap();
        let energy = 0.5 * (x[1].powi(2) + x[0].powi(2) + 99.0 * (x[0] - 1.0).max(0.0).powi(2));
        // Some six hundred steps of tolerance 1e-8.
        assert!((energy - 2.0).abs() < 5e-6, "{method:?}: {energy}");
    }
}

#[test]
fn two_switches_in_one_step_are_both_met() {
    let x = run(&model(&[("x", "0", "step(t - 0.3)*step(0.4 - t) + step(t - 0.7)")], Method::Auto), 1.0, 1)
        .unwrap();
    assert_close(x[0], 0.1 + 0.3, "both switches");
}

#[test]
fn a_state_that_crosses_its_switch_changes_its_rate_there() {
    // x' = 1 below 1 and 0.5 above: reaches 1 at t = 1 and then 1.5 at t = 2.
    let x = run(&model(&[("x", "0", "if(x < 1, 1, 0.5)")], Method::Dopri5), 2.0, 1).unwrap();
    assert_close(x[0], 1.5, "refracted");
}

#[test]
fn dry_friction_slows_a_block_down_and_then_holds_it() {
    // v' = -sign(v) from 1: stops at t = 1 at x = 1/2 and stays.
    for method in ADAPTIVE {
        let x = run(&model(&[("x", "0", "v"), ("v", "1", "-sign(v)")], method), 5.0, 1).unwrap();
        assert_close(x[0], 0.5, "braking distance");
        assert_close(x[1], 0.0, "held");
    }
}

#[test]
fn a_held_block_breaks_loose_when_the_force_exceeds_friction() {
    // v' = t - 2 sign(v) from rest: held until t = 2, then v = (t - 2)²/2.
    for pieces in [1, 10, 333] {
        let x =
            run(&model(&[("x", "0", "v"), ("v", "0", "u - 2*sign(v)")], Method::Auto), 4.0, pieces).unwrap();
        assert_close(x[1], 2.0, &format!("velocity, in {pieces}"));
        assert_close(x[0], 8.0 / 6.0, &format!("way, in {pieces}"));
    }
}

#[test]
fn a_state_held_on_a_moving_surface_follows_it() {
    // x' = 2 sign(sin(t) - x): catches up with sin t and then stays on it.
    let x = run(&model(&[("x", "-1", "2*sign(sin(t) - x)")], Method::Auto), 6.0, 1).unwrap();
    assert_close(x[0], 6.0_f64.sin(), "on the surface");
}
