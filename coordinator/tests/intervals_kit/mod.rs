//! Twins whose errors are known: two models in closed form or by small steps, and errors of several kinds.
#![allow(missing_docs, unreachable_pub, clippy::unwrap_used)]

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::study_kit::{csv, run_once};

/// Size of the correlated part of the errors, in sd of the stated noise.
const SIZE: f64 = 2.0;
/// Length of the records, in s.
const SPAN: f64 = 8.0;
/// Sampling interval of the inputs, in s.
const FINE: f64 = 0.002;

/// The errors of a recording, beside white noise of the stated sd.
#[derive(Debug, Clone, PartialEq)]
pub enum Errors {
    /// None.
    White,
    /// An autoregression of first order, its correlation at one sample, of twice the stated sd.
    Correlated(f64),
    /// A smooth Gaussian course of twice the stated sd whose correlation falls within a twentieth of the record, as a missing
    /// effect leaves it.
    Smooth,
}

/// A model and the number of its samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum System {
    /// Ten beats of a three-element Windkessel; Zc, R, C and the pressure at the start.
    Windkessel { n: usize },
    /// A mass on a damped spring, shaken; k, c.
    Oscillator { n: usize },
}

/// Over all intervals of all parameters and twins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shares {
    /// Share that holds the truth at the stated noise.
    pub stated: f64,
    /// Share that holds the truth given the residuals.
    pub given: f64,
    /// Median ratio of their lengths, in transformed units.
    pub wider: f64,
}

impl Errors {
    pub fn name(&self) -> String {
        match self {
            Self::White => "white".to_owned(),
            Self::Correlated(rho) => format!("AR(1) {rho}"),
            Self::Smooth => "smooth".to_owned(),
        }
    }

    /// n errors, in units of the stated noise.
    fn draw(&self, n: usize, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let slow: Vec<f64> = match self {
            Self::White => vec![0.0; n],
            Self::Correlated(rho) => {
                let mut x = normal();
                let mut next = || {
                    let now = x;
                    x = rho * now + (1.0 - rho * rho).sqrt() * normal();
                    SIZE * now
                };
                (0..n).map(|_| next()).collect()
            }
            Self::Smooth => smooth(n, &mut normal),
        };
        slow.into_iter().map(|slow| slow + normal()).collect()
    }
}

/// Waves of twice the record's length and shorter, damped as the square-exponential covariance has them.
fn smooth(n: usize, normal: &mut dyn FnMut() -> f64) -> Vec<f64> {
    let waves: Vec<(f64, f64, f64)> = (0..80)
        .map(|k| {
            let turns = 0.5 * f64::from(k);
            let size = (-0.25 * (TAU * turns * 0.05).powi(2)).exp();
            (TAU * turns, size * normal(), size * normal())
        })
        .collect();
    let power: f64 = (0..80).map(|k| (-0.5 * (TAU * 0.5 * f64::from(k) * 0.05).powi(2)).exp()).sum();
    let at = |t: f64| waves.iter().map(|(w, a, b)| a * (w * t).cos() + b * (w * t).sin()).sum::<f64>();
    (0..n).map(|i| SIZE * at(i as f64 / n as f64) / power.sqrt()).collect()
}

/// Twins of this system with these errors, each with a seed of its own.
pub fn coverage(system: System, estimator: &str, observer: &str, errors: &Errors, twins: u64) -> Shares {
    let study = system.study(estimator, observer);
    let (truth, clean) = (system.truth(), system.clean());
    let one = |seed: u64| {
        let drawn = errors.draw(system.n(), 7_000 + seed);
        let noisy: Vec<f64> = clean.iter().zip(drawn).map(|(y, e)| y + system.noise() * e).collect();
        let summary = run_once(&study, &system.files(&noisy)).summary;
        let of = |(p, truth): (&starlings_coordinator::study::posterior::Estimate, &f64)| {
            let holds = |[lo, hi]: [f64; 2]| lo <= *truth && *truth <= hi;
            let given = p.interval95_given_residuals.unwrap();
            (holds(p.interval95), holds(given), p.sd_given_residuals.unwrap() / p.sd)
        };
        summary.parameters.iter().zip(&truth).map(of).collect::<Vec<_>>()
    };
    let halves = [0, 1].map(|half| (0..twins).filter(move |seed| seed % 2 == half));
    let all: Vec<(bool, bool, f64)> = std::thread::scope(|scope| {
        let runs = halves.map(|seeds| scope.spawn(|| seeds.flat_map(one).collect::<Vec<_>>()));
        runs.into_iter().flat_map(|run| run.join().unwrap()).collect()
    });
    let share = |held: usize| held as f64 / all.len() as f64;
    let mut wider: Vec<f64> = all.iter().map(|(_, _, wider)| *wider).collect();
    wider.sort_by(f64::total_cmp);
    Shares {
        stated: share(all.iter().filter(|(stated, _, _)| *stated).count()),
        given: share(all.iter().filter(|(_, given, _)| *given).count()),
        wider: wider[wider.len() / 2],
    }
}

impl System {
    pub fn name(self) -> &'static str {
        match self {
            Self::Windkessel { .. } => "windkessel-3",
            Self::Oscillator { .. } => "driven-oscillator",
        }
    }

    pub fn n(self) -> usize {
        match self {
            Self::Windkessel { n } | Self::Oscillator { n } => n,
        }
    }

    /// Stated sd of the noise, in the unit of the output.
    fn noise(self) -> f64 {
        match self {
            Self::Windkessel { .. } => 2.0,
            Self::Oscillator { .. } => 0.005,
        }
    }

    fn truth(self) -> Vec<f64> {
        match self {
            Self::Windkessel { .. } => vec![0.03, 1.1, 1.3, 80.0],
            Self::Oscillator { .. } => vec![25.0, 1.0],
        }
    }

    fn input(self, t: f64) -> f64 {
        match self {
            Self::Windkessel { .. } => {
                let phase = t.rem_euclid(0.8) / 0.3;
                if phase < 1.0 { 400.0 * (0.5 * TAU * phase).sin() } else { 0.0 }
            }
            Self::Oscillator { .. } => (3.0 * t).sin() + 0.7 * (5.3 * t + 1.0).sin(),
        }
    }

    /// Samples of the fine grid between two observations.
    fn every(self) -> usize {
        (SPAN / FINE) as usize / self.n()
    }

    /// The n observations without errors.
    fn clean(self) -> Vec<f64> {
        let truth = self.truth();
        let mut state = match self {
            Self::Windkessel { .. } => [truth[3], 0.0],
            Self::Oscillator { .. } => [0.1, 0.0],
        };
        let mut observed = Vec::new();
        for step in 0..self.n() * self.every() {
            let t = FINE * step as f64;
            let (now, next) = (self.input(t), self.input(t + FINE));
            if step % self.every() == 0 {
                let direct = if matches!(self, Self::Windkessel { .. }) { truth[0] * now } else { 0.0 };
                observed.push(state[0] + direct);
            }
            state = runge_kutta(state, |x, part| self.rate(&truth, x, now + part * (next - now)));
        }
        observed
    }

    fn rate(self, truth: &[f64], x: [f64; 2], u: f64) -> [f64; 2] {
        match self {
            Self::Windkessel { .. } => [(u - x[0] / truth[1]) / truth[2], 0.0],
            Self::Oscillator { .. } => [x[1], u - truth[1] * x[1] - truth[0] * x[0]],
        }
    }

    fn files(self, observed: &[f64]) -> [(&'static str, String); 2] {
        let fine: Vec<f64> = (0..=(SPAN / FINE) as usize).map(|k| FINE * k as f64).collect();
        let input: Vec<f64> = fine.iter().map(|t| self.input(*t)).collect();
        let times: Vec<f64> = (0..self.n()).map(|k| FINE * (k * self.every()) as f64).collect();
        [("input.csv", csv("time,u", &[&fine, &input])), ("output.csv", csv("time,y", &[&times, observed]))]
    }

    fn study(self, estimator: &str, observer: &str) -> String {
        let observer = if observer.is_empty() { String::new() } else { format!("[observer]\n{observer}\n") };
        let (model, input, output) = match self {
            Self::Windkessel { .. } => (WINDKESSEL, "flow", "pressure"),
            Self::Oscillator { .. } => (OSCILLATOR, "force", "position"),
        };
        format!(
            r#"
[study]
name = "intervals"
{model}
{observer}
[[records]]
name = "twin"
file = "output.csv"
inputs = {{ {input} = "input.csv:u" }}
channels = [ {{ column = "y", output = "{output}", noise = {:?} }} ]
[estimator]
{estimator}
"#,
            self.noise()
        )
    }
}

/// One step of the classical method; `part` runs from 0 to 1 over the step.
fn runge_kutta(x: [f64; 2], rate: impl Fn([f64; 2], f64) -> [f64; 2]) -> [f64; 2] {
    let along = |k: [f64; 2], h: f64| [x[0] + h * k[0], x[1] + h * k[1]];
    let k1 = rate(x, 0.0);
    let k2 = rate(along(k1, 0.5 * FINE), 0.5);
    let k3 = rate(along(k2, 0.5 * FINE), 0.5);
    let k4 = rate(along(k3, FINE), 1.0);
    std::array::from_fn(|i| x[i] + FINE / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

const WINDKESSEL: &str = r#"
[model]
kind = "windkessel-3"
[[parameters]]
name = "Zc"
prior = { transform = "log", median = 0.05, sd = 0.7 }
[[parameters]]
name = "R"
prior = { transform = "log", median = 1.5, sd = 0.7 }
[[parameters]]
name = "C"
prior = { transform = "log", median = 1.0, sd = 0.7 }
[[parameters]]
name = "initial:p"
prior = { transform = "linear", median = 70.0, sd = 30.0 }
"#;

const OSCILLATOR: &str = r#"
[model]
kind = "driven-oscillator"
constants = { m = 1.0, "initial:x" = 0.1 }
[[parameters]]
name = "k"
prior = { transform = "log", median = 30.0, factor = 1.5 }
[[parameters]]
name = "c"
prior = { transform = "log", median = 1.5, factor = 2.0 }
"#;
