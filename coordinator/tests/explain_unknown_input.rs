//! The input that an equation would need: dry friction missing in an oscillator shows as a force with the sign of the
//! velocity, and a leak missing in a tank as a flow that follows the level.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

mod study_kit;

use starlings_coordinator::explain::locate::{MOST_RUNS, UnknownInput, unknown_inputs};
use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::Study;
use study_kit::fleets::Mortal;
use study_kit::{Case, csv, grid, normals};

const OSCILLATOR: &str = r#"
[study]
name = "friction"
time_unit = "s"
[model]
kind = "equations"
constants = { m = 1.0 }
outputs = [ { name = "position", unit = "m", value = "x" } ]
[[model.states]]
name = "x"
unit = "m"
initial = 1.0
rate = "v"
[[model.states]]
name = "v"
unit = "m/s"
initial = 0.0
rate = "-k*x/m"
[[parameters]]
name = "k"
prior = { transform = "log", median = 10.0, factor = 1.1 }
[[records]]
name = "decay"
file = "decay.csv"
time = "t"
channels = [ { column = "x", output = "position", noise = 0.002 } ]
"#;

/// Friction force per mass.
const FRICTION: f64 = 0.4;

/// Free decay with dry friction and noise, by steps far below the spacing of the record.
fn decay(friction: f64, seed: u64) -> Study {
    let (n, dt, fine) = (400, 0.02, 200);
    let (mut x, mut v) = (1.0_f64, 0.0_f64);
    let mut position = Vec::new();
    for e in normals(n, seed) {
        position.push(x + 0.002 * e);
        for _ in 0..fine {
            let h = dt / f64::from(fine);
            v += h * (-10.0 * x - friction * v.signum());
            x += h * v;
        }
    }
    Case::new(OSCILLATOR, &[("decay.csv", csv("t,x", &[&grid(n, dt), &position]))]).study()
}

fn inputs(study: &Study) -> (Vec<UnknownInput>, u64) {
    let theta: Vec<f64> = study.theta.iter().map(|t| t.prior_mean).collect();
    let mut runs = 0;
    let found = unknown_inputs(study, &mut InProcess::new(1), &theta, &mut runs).unwrap();
    (found, runs)
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(a, b)| f(a - ma, b - mb)).sum::<f64>();
    sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
}

#[test]
fn missing_dry_friction_is_a_force_with_the_sign_of_the_velocity() {
    let study = decay(FRICTION, 1);
    let (found, runs) = inputs(&study);
    let force = found.iter().find(|f| f.state == "v").unwrap();
    assert!(force.log_likelihood_gain > 100.0, "{}", force.log_likelihood_gain);
    let sign: Vec<f64> = force.at.iter().map(|v| v.signum()).collect();
    let r = correlation(&force.value, &sign);
    println!(
        "correlation {r:.3}, runs {runs}, gains {:?}",
        found.iter().map(|f| (&f.state, f.log_likelihood_gain)).collect::<Vec<_>>()
    );
    assert!(r < -0.9, "{r}");
    // A random walk rounds the corners of the square wave off, so its mean size is a little below the friction.
    let size = force.value.iter().map(|b| b.abs()).sum::<f64>() / force.value.len() as f64;
    assert!((0.75 * FRICTION..1.1 * FRICTION).contains(&size), "{size}");
    assert_eq!((force.record.as_str(), force.unit.as_str()), ("decay", "(m/s)/s"));
    // Per equation 2 runs, then one for the start and 3 walks of 4 particles.
    assert_eq!(runs, 2 * 15);
}

#[test]
fn a_complete_model_gains_nothing_by_an_unknown_input() {
    let study = decay(0.0, 2);
    for input in inputs(&study).0 {
        assert!(input.log_likelihood_gain < 3.0, "{} gains {}", input.state, input.log_likelihood_gain);
        let outside = input.value.iter().zip(&input.sd).filter(|(b, sd)| b.abs() > 3.0 * **sd).count();
        assert!(outside * 20 < input.value.len(), "{outside} of {}", input.value.len());
    }
}

#[test]
fn the_same_study_gives_the_same_bits() {
    let study = decay(FRICTION, 3);
    assert_eq!(inputs(&study), inputs(&study));
}

const TANK: &str = r#"
[study]
name = "tank"
time_unit = "s"
[model]
kind = "equations"
outputs = [ { name = "level", unit = "V", value = "h" } ]
inputs = [ { name = "q", unit = "V/s" } ]
[[model.states]]
name = "h"
unit = "V"
initial = "h0"
rate = "q - 0.1*h"
[[model.states]]
name = "idle"
initial = 0.0
rate = "-idle"
[[parameters]]
name = "h0"
prior = { transform = "linear", mean = 2.0, sd = 0.1 }
[[records]]
name = "fill"
file = "fill.csv"
time = "t"
inputs = { q = "q" }
channels = [ { column = "h", output = "level", noise = 0.02 } ]
train = [0.0, 30.0]
"#;

#[test]
fn a_missing_leak_is_known_to_its_interval_and_a_state_that_nobody_sees_is_left_out() {
    let (n, dt) = (401, 0.1);
    let q = |t: f64| 0.5 + 0.4 * (0.5 * t).sin();
    let leak = |h: f64| -0.2 * (h - 3.0).max(0.0);
    let (mut h, mut level, mut truth) = (2.0_f64, Vec::new(), Vec::new());
    for (i, e) in normals(n, 5).into_iter().enumerate() {
        level.push(h + 0.02 * e);
        truth.push(leak(h));
        for k in 0..100 {
            let t = dt * (i as f64 + f64::from(k) / 100.0);
            h += 0.001 * (q(t) - 0.1 * h + leak(h));
        }
    }
    let times = grid(n, dt);
    let drive: Vec<f64> = times.iter().map(|t| q(*t)).collect();
    let study = Case::new(TANK, &[("fill.csv", csv("t,h,q", &[&times, &level, &drive]))]).study();
    let (found, _) = inputs(&study);
    assert_eq!(found.iter().map(|f| f.state.as_str()).collect::<Vec<_>>(), ["h"]);
    let flow = &found[0];
    assert!(flow.time.last().unwrap() <= &30.0, "held-out values are not seen");
    let of = |t: f64| truth[((t / dt).round() as usize).min(n - 1)];
    let near = flow
        .time
        .iter()
        .zip(&flow.value)
        .zip(&flow.sd)
        .filter(|((t, b), sd)| (*b - of(**t)).abs() < 2.0 * **sd);
    // 95 % expected of a true random walk; the leak is smoother than one.
    assert!(near.count() * 10 >= flow.time.len() * 9);
}

/// Two masses on springs, one behind the other.
const CHAIN: &str = r#"
[study]
name = "chain"
[model]
kind = "equations"
outputs = [ { name = "position", unit = "m", value = "x" } ]
[[model.states]]
name = "x"
unit = "m"
initial = 1.0
rate = "v"
[[model.states]]
name = "v"
unit = "m/s"
initial = 0.0
rate = "-k*x + 4*(y - x)"
[[model.states]]
name = "y"
unit = "m"
initial = 0.5
rate = "w"
[[model.states]]
name = "w"
unit = "m/s"
initial = 0.0
rate = "4*(x - y)"
[[parameters]]
name = "k"
prior = { transform = "log", median = 10.0, factor = 1.1 }
[[records]]
name = "swing"
file = "swing.csv"
time = "t"
channels = [ { column = "x", output = "position", noise = 0.01 } ]
"#;

#[test]
fn the_runs_are_no_more_than_stated_and_equations_share_their_batches() {
    let (times, position) = (grid(60, 0.05), normals(60, 4));
    let study = Case::new(CHAIN, &[("swing.csv", csv("t,x", &[&times, &position]))]).study();
    let theta: Vec<f64> = study.theta.iter().map(|t| t.prior_mean).collect();
    let (mut fleet, mut runs) = (Mortal::new(usize::MAX), 0);
    let found = unknown_inputs(&study, &mut fleet, &theta, &mut runs).unwrap();
    assert_eq!(found.len(), 2, "the two that are felt most");
    // Four equations are tried with 2 runs each, and two followed: one for the start and 3 walks of 5 particles.
    assert_eq!(runs, 4 * 2 + 2 * (1 + 3 * 5));
    assert!(runs <= (MOST_RUNS + 2 * study.spec.states.len()) as u64, "{runs}");
    assert_eq!(fleet.answered, 2 + 2 * (1 + study.windows(0).len()));
}
