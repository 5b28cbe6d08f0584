//! Estimators of S, the middle of the sandwich, compared on two linear models: the second table of docs/intervals.md.
//!
//! `just intervals` prints it. What is used here is the last column. Next file to read: [`super`].

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{DataPoint, Influence, Residuals, scores, working};

/// Samples in a beat of the Windkessel's inflow, times the number of samples over the length of the record in beats.
const BEATS: f64 = 10.0;
/// Draws of the errors.
const DRAWS: u64 = 200;

/// Slopes of a Windkessel's pressure over ten beats (Zc, R, C, pressure at the start) or of a shaken mass (k, c, start), each by
/// differences of its closed form or of small steps, in noise sd per prior sd.
fn design(windkessel: bool, n: usize) -> DMatrix<f64> {
    let (base, sd): (Vec<f64>, Vec<f64>) = if windkessel {
        (vec![0.03_f64.ln(), 0.0, 1.5_f64.ln(), 75.0], vec![0.7, 0.7, 0.7, 30.0])
    } else {
        (vec![25.0_f64.ln(), 0.0, 0.08], vec![0.4, 0.7, 0.05])
    };
    let columns: Vec<DVector<f64>> = (0..base.len())
        .map(|j| {
            let side = |sign: f64| {
                let mut theta = base.clone();
                theta[j] += sign * 1e-4 * sd[j];
                course(windkessel, &theta, n)
            };
            (side(1.0) - side(-1.0)) / (2e-4 * if windkessel { 2.0 } else { 0.0022 })
        })
        .collect();
    DMatrix::from_columns(&columns)
}

fn course(windkessel: bool, theta: &[f64], n: usize) -> DVector<f64> {
    let inflow = |t: f64| {
        if t.rem_euclid(0.8) < 0.28 { 400.0 * (PI * t.rem_euclid(0.8) / 0.28).sin().powi(2) } else { 0.0 }
    };
    let force = |t: f64| (3.0 * t).sin() + 0.7 * (5.3 * t + 1.0).sin();
    let e: Vec<f64> = theta.iter().map(|v| v.exp()).collect();
    let mut x = if windkessel { [theta[3], 0.0] } else { [theta[2], 0.0] };
    let steps = 20;
    let h = 8.0 / (n * steps) as f64;
    let rate = |x: [f64; 2], t: f64| {
        if windkessel {
            [(inflow(t) - x[0] / e[1]) / e[2], 0.0]
        } else {
            [x[1], force(t) - e[1] * x[1] - e[0] * x[0]]
        }
    };
    DVector::from_fn(n, |k, _| {
        let start = 8.0 * k as f64 / n as f64;
        let seen = x[0] + if windkessel { e[0] * inflow(start) } else { 0.0 };
        for i in 0..steps {
            let t = start + h * i as f64;
            let first = rate(x, t);
            let second = rate([x[0] + 0.5 * h * first[0], x[1] + 0.5 * h * first[1]], t + 0.5 * h);
            x = [x[0] + h * second[0], x[1] + h * second[1]];
        }
        seen
    })
}

#[derive(Clone, Copy)]
enum Errors {
    White,
    Correlated(f64),
    Smooth,
    Beat,
}

impl Errors {
    fn draw(self, n: usize, seed: u64) -> DVector<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let waves = |turns: &[f64], sizes: &[f64], normal: &mut dyn FnMut() -> f64| {
            let whole: f64 = sizes.iter().map(|s| s * s).sum::<f64>().sqrt();
            let sides: Vec<[f64; 2]> =
                sizes.iter().map(|s| [2.0 * s / whole * normal(), 2.0 * s / whole * normal()]).collect();
            let at = |t: f64| {
                turns
                    .iter()
                    .zip(&sides)
                    .map(|(w, [a, b])| a * (TAU * w * t).cos() + b * (TAU * w * t).sin())
                    .sum()
            };
            (0..n).map(|k| at(k as f64 / n as f64)).collect::<Vec<f64>>()
        };
        let slow = match self {
            Self::White => vec![0.0; n],
            Self::Correlated(rho) => {
                let mut x = normal();
                let mut next = || {
                    let now = x;
                    x = rho * x + (1.0 - rho * rho).sqrt() * normal();
                    2.0 * now
                };
                (0..n).map(|_| next()).collect()
            }
            Self::Smooth => {
                let turns: Vec<f64> = (0..80).map(|k| 0.5 * f64::from(k)).collect();
                let sizes: Vec<f64> =
                    turns.iter().map(|w| (-0.25 * (TAU * w * 0.05).powi(2)).exp()).collect();
                waves(&turns, &sizes, &mut normal)
            }
            Self::Beat => waves(&[BEATS, 2.0 * BEATS, 3.0 * BEATS, 4.0 * BEATS], &[1.0; 4], &mut normal),
        };
        DVector::from_iterator(n, slow.into_iter().map(|slow| slow + normal()))
    }
}

fn covariance(s: &[f64], lag: usize) -> f64 {
    s[lag..].iter().zip(s).map(|(a, b)| a * b).sum()
}

fn correlation(s: &[f64]) -> f64 {
    (covariance(s, 1) / covariance(s, 0).max(f64::MIN_POSITIVE)).clamp(-0.97, 0.97)
}

/// Newey & West (1987), lag by Andrews (1991, eqs. 6.2 and 6.4).
fn bartlett(s: &[f64]) -> f64 {
    let (n, rho) = (s.len(), correlation(s));
    let alpha = 4.0 * rho * rho / ((1.0 - rho) * (1.0 + rho)).powi(2);
    let lag = ((1.1447 * (alpha * n as f64).cbrt()).ceil() as usize).min(n - 1);
    covariance(s, 0)
        + (1..=lag).map(|k| 2.0 * (1.0 - k as f64 / (lag + 1) as f64) * covariance(s, k)).sum::<f64>()
}

/// Quadratic spectral kernel after prewhitening (Andrews & Monahan 1992).
fn prewhitened(s: &[f64]) -> f64 {
    let first = correlation(s);
    let s: Vec<f64> = s.windows(2).map(|w| w[1] - first * w[0]).collect();
    let (n, rho) = (s.len(), correlation(&s));
    let width = (1.3221 * (4.0 * rho * rho / (1.0 - rho).powi(4) * n as f64).powf(0.2)).max(1e-3);
    let weight = |k: usize| {
        let x = k as f64 / width;
        let z = 1.2 * PI * x;
        25.0 / (12.0 * (PI * x).powi(2)) * (z.sin() / z - z.cos())
    };
    let sum = covariance(&s, 0) + (1..n).map(|k| 2.0 * weight(k) * covariance(&s, k)).sum::<f64>();
    sum / (1.0 - first).powi(2)
}

/// Shares of the truth held by each middle, all parameters together.
fn shares(windkessel: bool, n: usize, errors: Errors) -> [f64; 6] {
    let jacobian = design(windkessel, n);
    let p = jacobian.ncols();
    let influence = Influence::new(&jacobian).expect("finite");
    let places: Vec<DataPoint> =
        (0..n).map(|k| DataPoint { record: 0, time: k as f64, channel: 0 }).collect();
    let mut held = [0_u32; 6];
    for seed in 0..DRAWS {
        let e = errors.draw(n, seed);
        let off = influence.rows.tr_mul(&e);
        let values = &e - &jacobian * &off;
        let fit = Residuals { jacobian: &jacobian, values: &values, places: &places };
        let records = fit.records(&influence);
        let averaged = working::working(&records).expect("small").variance;
        let used = fit.inflation().expect("finite").expect("enough");
        let lost = n as f64 / (n as f64 - influence.basis.norm_squared());
        for j in 0..p {
            let s = records[0].scores(j);
            let prior = influence.of_prior[j];
            let middle = [
                bartlett(&s) * lost,
                prewhitened(&s) * lost,
                scores::variance(std::slice::from_ref(&s)) * lost,
                averaged[j],
            ];
            let stated = influence.variance[j];
            let all = [
                stated,
                middle[0] + prior,
                middle[1] + prior,
                middle[2] + prior,
                middle[3] + prior,
                stated * used[j] * used[j],
            ];
            for (held, variance) in held.iter_mut().zip(all) {
                *held += u32::from(off[j].abs() < 1.96 * variance.max(0.0).sqrt());
            }
        }
    }
    held.map(|held| f64::from(held) / (DRAWS * p as u64) as f64)
}

#[test]
#[ignore = "a minute; `just intervals`"]
fn the_table_of_alternatives() {
    println!(
        "| model | samples | errors | stated noise | Newey–West | prewhitened | cosines | likelihood | used |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let errors = [
        ("white", Errors::White),
        ("AR(1) 0.5", Errors::Correlated(0.5)),
        ("AR(1) 0.9", Errors::Correlated(0.9)),
        ("AR(1) 0.98", Errors::Correlated(0.98)),
        ("smooth", Errors::Smooth),
        ("every beat", Errors::Beat),
    ];
    for (windkessel, n) in [(true, 120), (true, 460), (false, 120), (false, 460)] {
        for (name, errors) in errors {
            if !windkessel && matches!(errors, Errors::Beat) {
                continue;
            }
            let found = shares(windkessel, n, errors);
            let cells: Vec<String> = found.iter().map(|share| format!("{share:.2}")).collect();
            let model = if windkessel { "Windkessel" } else { "oscillator" };
            println!("| {model} | {n} | {name} | {} |", cells.join(" | "));
            match errors {
                Errors::White => assert!((0.92..=0.975).contains(&found[5]), "{model} {n} {name}: {found:?}"),
                Errors::Beat => {}
                _ => assert!(found[5] >= 0.88, "{model} {n} {name}: {found:?}"),
            }
        }
    }
}
