//! `starlings infer` under noise that is not what it is held to be: shared by equations, with a memory, behind jumps of the drift, with other
//! errors of the measurement than are given.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;

use std::fmt::Write as _;

use infer_kit::{by_rates, folder, infer, noise, said};
use serde_json::Value;

/// By how many of its standard deviations each coefficient is off.
fn off(found: &Value, truth: &[(&str, f64)]) -> Vec<f64> {
    let all = found["coefficients"].as_array().unwrap();
    let of = |(name, value): &(&str, f64)| {
        let one = all.iter().find(|c| c["name"] == *name).unwrap();
        (one["estimate"].as_f64().unwrap() - value) / one["sd"].as_f64().unwrap()
    };
    truth.iter().map(of).collect()
}

/// Every so many of the fine steps of a path, as a file; `step` moves it.
fn path<const L: usize>(h: f64, every: usize, n: usize, mut step: impl FnMut(&mut [f64; L])) -> String {
    let names = ["x", "y"];
    let (mut at, mut text) = ([0.0; L], format!("time,{}\n", names[..L].join(",")));
    for k in 0..=n * every {
        if k % every == 0 {
            let cells: Vec<String> = at.iter().map(|v| format!("{v:?}")).collect();
            writeln!(text, "{:.6},{}", k as f64 * h, cells.join(",")).unwrap();
        }
        step(&mut at);
    }
    text
}

#[test]
fn noise_that_equations_share_leaves_no_bias_where_it_is_held_to_be_independent() {
    let states = [("x", "-a*x + b*y"), ("y", "-b*x - a*y")];
    let of = |shared: f64, form: &str| {
        let (mut noise, h) = (noise(3), 0.004_f64);
        let data = path::<2>(h, 5, 20_000, |at| {
            let [x, y] = *at;
            let [one, two] = [noise(), noise()].map(|n| 0.5 * h.sqrt() * n);
            at[0] += h * (2.0 * y - x) + one;
            at[1] += h * (-2.0 * x - y) + shared * one + (1.0 - shared * shared).sqrt() * two;
        });
        let functions = format!("functions = [\"x\", \"y\"]\ndiffusion = \"{form}\"");
        infer(folder(&by_rates(&states, &functions), &data).path(), "out", "2")
    };
    let truth = [("x:x", -1.0), ("x:y", 2.0), ("y:x", -2.0), ("y:y", -1.0)];
    for form in ["diagonal", "isotropic"] {
        let found = of(0.8, form);
        let far = off(&found, &truth);
        assert!(far.iter().all(|far| far.abs() < 4.0), "{form}: {far:?}");
        let told = said(&found, "x and y share theirs (correlation 0.8");
        assert!(told.len() == 1 && told[0].contains("use diffusion = \"full\""), "{found}");
        assert_eq!(said(&of(0.0, form), "share theirs"), Vec::<&str>::new(), "{form}");
    }
    assert_eq!(said(&of(0.8, "full"), "share theirs"), Vec::<&str>::new());
}

#[test]
fn terms_that_jump_with_a_state_are_taken_where_no_slope_is_needed() {
    let (mut noise, h) = (noise(5), 0.002_f64);
    let data = path::<1>(h, 5, 20_000, |at| {
        at[0] += h * (-0.5 * at[0] - 0.4 * at[0].signum()) + 0.5 * h.sqrt() * noise();
    });
    let study = by_rates(&[("x", "-c*x - mu*sign(x)")], "parameters = [\"c\", \"mu\"]");
    let found = infer(folder(&study, &data).path(), "out", "2");
    let far = off(&found, &[("c", 0.5), ("mu", 0.4)]);
    assert!(far.iter().all(|far| far.abs() < 3.0), "{far:?}: {found}");
}

#[test]
fn a_memory_of_the_noise_is_told_and_not_taken_for_a_coarse_step() {
    let of = |memory: f64| {
        let (mut noise, h, mut force) = (noise(7), 0.004_f64, 0.0_f64);
        let data = path::<1>(h, 5, 10_000, |at| {
            let keeps = if memory > 0.0 { (-h / memory).exp() } else { 0.0 };
            let white = 0.5 / h.sqrt() * noise();
            force = keeps * force + (1.0 - keeps) * white;
            at[0] += h * (force - at[0]);
        });
        infer(folder(&by_rates(&[("x", "-a*x")], "parameters = [\"a\"]"), &data).path(), "out", "2")
    };
    let found = of(0.1);
    let told = said(&found, "neighbouring residuals are alike in x (correlation 0.");
    assert!(told.len() == 1 && told[0].contains("a memory of about 0.1"), "{found}");
    for feigned in ["coarse for this dynamics", "the noise is not constant", "not the same throughout"] {
        assert_eq!(said(&found, feigned), Vec::<&str>::new());
    }
    assert_eq!(found["noise_checks"][0]["verdict"], "Alike");
    assert_eq!(said(&of(0.0), "alike"), Vec::<&str>::new());
}

#[test]
fn errors_of_the_measurement_that_are_given_are_held_against_the_rows() {
    let (mut noise, h) = (noise(9), 0.005_f64);
    let clean = path::<1>(h, 4, 4_000, |at| at[0] += -h * at[0] + 0.5 * h.sqrt() * noise());
    let mut measured = "time,x\n".to_owned();
    for row in clean.lines().skip(1) {
        let (time, x) = row.split_once(',').unwrap();
        writeln!(measured, "{time},{:?}", x.parse::<f64>().unwrap() + 0.1 * noise()).unwrap();
    }
    let of = |given: f64| {
        let asked = format!("parameters = [\"a\"]\nmeasurement_noise = {given}");
        infer(folder(&by_rates(&[("x", "-a*x")], &asked), &measured).path(), "out", "1")
    };
    assert_eq!(said(&of(0.1), "is not what neighbouring rows show"), Vec::<&str>::new());
    for wrong in [0.05, 0.2] {
        let found = of(wrong);
        let told = said(&found, &format!("measurement_noise = {wrong} is not what neighbouring rows show"));
        assert!(told.len() == 1 && (told[0].contains("(0.1)") || told[0].contains("(0.09")), "{told:?}");
    }
}
