//! Native models against exact solutions, through the simulator.

mod common;

use common::{largest_difference, run, setup};
use starlings_models::{BuildSetup, Setup, Signal, Window};

/// Observation times 0, 0.1, …, with every value missing.
fn window(n: usize, n_obs: usize, inputs: Vec<Signal>) -> Window {
    let times: Vec<f64> = (0..n).map(|i| 0.1 * i as f64).collect();
    Window::free(0.0, times, n_obs, inputs)
}

/// A ramp from `start` with `slope`, sampled at its ends and twice in between.
fn ramp(start: f64, slope: f64) -> Signal {
    let times = vec![0.0, 0.333, 1.05, 10.0];
    let values = times.iter().map(|t| start + slope * t).collect();
    Signal { times, values }
}

/// Solution of C dp/dt = q₀ + s t − p/R from p₀.
fn stored(r: f64, c: f64, [q0, s]: [f64; 2], p0: f64, t: f64) -> f64 {
    let tau = r * c;
    let steady = |t: f64| r * (q0 + s * (t - tau));
    (p0 - steady(0.0)) * (-t / tau).exp() + steady(t)
}

fn with_initial(kind: &str, values: &[(&str, f64)]) -> Setup {
    let (mut setup, _) = setup(kind);
    setup.model.constants = values.iter().map(|(name, v)| ((*name).to_owned(), *v)).collect();
    setup
}

#[test]
fn the_two_element_windkessel_follows_the_ramp_solution() {
    let setup = with_initial("windkessel-2", &[("initial:p", 95.0)]);
    let window = window(30, 1, vec![ramp(20.0, 35.0)]);
    let got = run(&*setup.build().unwrap(), &window, &[1.1, 1.4]).outputs;
    let want: Vec<f64> = window.times.iter().map(|&t| stored(1.1, 1.4, [20.0, 35.0], 95.0, t)).collect();
    // Thirty exact steps of values near 100, each with a few roundings.
    assert!(largest_difference(&got, &want) < 1e-11, "{:e}", largest_difference(&got, &want));
}

#[test]
fn the_three_element_windkessel_adds_the_impedance_times_the_flow() {
    let setup = with_initial("windkessel-3", &[("initial:p", 95.0)]);
    let window = window(30, 1, vec![ramp(20.0, 35.0)]);
    let got = run(&*setup.build().unwrap(), &window, &[1.1, 1.4, 0.07]).outputs;
    let pressure = |t: f64| stored(1.1, 1.4, [20.0, 35.0], 95.0, t) + 0.07 * (20.0 + 35.0 * t);
    let want: Vec<f64> = window.times.iter().map(|&t| pressure(t)).collect();
    assert!(largest_difference(&got, &want) < 1e-11, "{:e}", largest_difference(&got, &want));
}

#[test]
fn the_four_element_windkessel_follows_its_two_ramp_solutions() {
    let setup = with_initial("windkessel-4", &[("initial:p", 95.0), ("initial:iL", 5.0)]);
    let window = window(30, 1, vec![ramp(20.0, 35.0)]);
    let (r, c, zc, l) = (1.1, 1.4, 0.07, 0.02);
    let got = run(&*setup.build().unwrap(), &window, &[r, c, zc, l]).outputs;
    let pressure = |t: f64| {
        // iL relaxes to q with the time L/Zc: the same equation with R = 1 and C = L/Zc.
        let branch = stored(1.0, l / zc, [20.0, 35.0], 5.0, t);
        stored(r, c, [20.0, 35.0], 95.0, t) + zc * (20.0 + 35.0 * t - branch)
    };
    let want: Vec<f64> = window.times.iter().map(|&t| pressure(t)).collect();
    assert!(largest_difference(&got, &want) < 1e-11, "{:e}", largest_difference(&got, &want));
}

#[test]
fn an_immense_inertance_makes_four_elements_three() {
    let (three, _) = setup("windkessel-3");
    let (four, _) = setup("windkessel-4");
    let window = window(30, 1, vec![ramp(20.0, 35.0)]);
    let three = run(&*three.build().unwrap(), &window, &[1.1, 1.4, 0.07]).outputs;
    let four = run(&*four.build().unwrap(), &window, &[1.1, 1.4, 0.07, 1e12]).outputs;
    // The branch flow stays below 1e-10 and is multiplied by 0.07.
    assert!(largest_difference(&three, &four) < 1e-11);
}

/// Position of the free oscillator with m = 1 from (x₀, v₀), by its characteristic roots.
fn free_position(c: f64, k: f64, [x0, v0]: [f64; 2], t: f64) -> f64 {
    let (sigma, square) = (0.5 * c, k - 0.25 * c * c);
    let envelope = (-sigma * t).exp();
    let lead = v0 + sigma * x0;
    if square > 1e-12 {
        let w = square.sqrt();
        envelope * (x0 * (w * t).cos() + lead / w * (w * t).sin())
    } else if square < -1e-12 {
        let w = (-square).sqrt();
        envelope * (x0 * (w * t).cosh() + lead / w * (w * t).sinh())
    } else {
        envelope * (x0 + lead * t)
    }
}

#[test]
fn the_oscillator_follows_its_roots_below_at_and_above_critical_damping() {
    let setup = with_initial("oscillator", &[("initial:x", 0.7), ("initial:v", -1.3)]);
    let window = window(40, 2, vec![]);
    for c in [0.0, 0.5, 4.0, 4.0 + 1e-9, 9.0] {
        let got = run(&*setup.build().unwrap(), &window, &[1.0, c, 4.0]).outputs;
        let position: Vec<f64> = got.iter().copied().step_by(2).collect();
        let want: Vec<f64> = window.times.iter().map(|&t| free_position(c, 4.0, [0.7, -1.3], t)).collect();
        // Forty exact steps of values near one; 1e-9 more damping than critical moves the reference by as much.
        assert!(largest_difference(&position, &want) < 1e-8, "c = {c}");
        if c < 4.0 {
            assert!(largest_difference(&position, &want) < 1e-13, "c = {c}");
        }
    }
}

#[test]
fn the_undamped_oscillator_keeps_its_energy_over_ten_thousand_steps() {
    let setup = with_initial("oscillator", &[("initial:x", 1.0), ("initial:v", 0.0)]);
    let window = window(10_000, 2, vec![]);
    let state = run(&*setup.build().unwrap(), &window, &[2.0, 0.0, 50.0]).state;
    let energy = state[1] * state[1] + 25.0 * state[0] * state[0];
    // Each step rounds the state by about 1e-16; ten thousand of them at worst add up to 1e-12.
    assert!((energy / 25.0 - 1.0).abs() < 1e-11, "{energy}");
}

#[test]
fn a_heavy_damper_creeps_without_overflow() {
    let setup = with_initial("oscillator", &[("initial:x", 1.0), ("initial:v", 0.0)]);
    let window = window(2, 2, vec![]);
    let state = run(&*setup.build().unwrap(), &window, &[1e-3, 1e6, 1.0]).state;
    // The slow root is −k/c (1 + m k/c²): x = exp(−0.1·1e-6), to rounding.
    assert!((state[0] - (-1e-7_f64).exp()).abs() < 1e-15, "{}", state[0]);
}

#[test]
fn a_driven_oscillator_under_its_own_inverse_force_moves_as_prescribed() {
    // x = 1 + t/2 needs F = c/2 + k (1 + t/2).
    let setup = with_initial("driven-oscillator", &[("initial:x", 1.0), ("initial:v", 0.5)]);
    let (c, k) = (0.8, 3.0);
    let window = window(20, 2, vec![ramp(0.5 * c + k, 0.5 * k)]);
    let got = run(&*setup.build().unwrap(), &window, &[1.7, c, k]).outputs;
    let want: Vec<f64> = window.times.iter().flat_map(|&t| [1.0 + 0.5 * t, 0.5]).collect();
    assert!(largest_difference(&got, &want) < 1e-13, "{:e}", largest_difference(&got, &want));
}
