//! The miss: a throat that closes slowly is forecast to burst the case long before the alarm.

use nalgebra::{DMatrix, DVector};
use starlings_estimators::forecast::{Crossings, Level};
use starlings_estimators::inference::{Diffusion, Fit, Posterior, Prior};

use crate::kit::neutral::{self, BURST, FAULT, H, MISS};
use crate::kit::sde::{gauss, rng};
use crate::kit::{mean, median, quantile, sums};

/// Steps of the ensemble: rows 0.02 s apart up to 22 s.
const ROWS: f64 = 0.02;
const UNTIL: f64 = 22.0;

/// α, β, δ from what followed the fault, with a weak prior (half of the throat in some seven seconds).
fn infer(rows: &[[f64; 3]], d: f64) -> Posterior {
    let basis = neutral::basis(4);
    let prior = Prior::independent(&[0.0; 3], &[0.02, 0.005, 0.002]).unwrap();
    let noise = Diffusion::Known(DMatrix::from_diagonal_element(2, 2, d * d));
    let fit = Fit { prior, ..Fit::new(noise, 3) };
    fit.posterior(&sums(&basis, rows, H), &neutral::loss(&basis)).unwrap()
}

/// When members with coefficients from the posterior burst. They start as the motor did.
fn forecast(posterior: &Posterior, seed: u64, n_member: u64, d: f64) -> Crossings {
    let root = posterior.covariance().clone().cholesky().unwrap().l();
    let mut draw = rng(seed);
    // Nothing happens before the fault: members share the way there but for noise that they forget in 50 ms.
    let start = *neutral::course(seed, (0.0, [1.0; 3]), 3600, (0.0025, 1), d, |_| 1.0).last().unwrap();
    let n = ((UNTIL - FAULT) / ROWS).round() as usize;
    let member = |k: u64| {
        let z = DVector::from_fn(3, |_, _| gauss(&mut draw));
        let c = posterior.mean() + &root * z;
        let area = neutral::polynomial([c[0], c[1], c[2]]);
        let rows = neutral::course(7000 + 100 * seed + k, (FAULT, start), n, (0.0025, 8), d, area);
        rows.iter().map(|row| row[0]).collect()
    };
    let members: Vec<Vec<f64>> = (0..n_member).map(member).collect();
    let times: Vec<f64> = (0..=n).map(|k| FAULT + ROWS * k as f64).collect();
    Crossings::of(&times, &members, Level::above(BURST)).unwrap()
}

/// What is known a time after the fault, and when the same recording bursts.
fn one(seed: u64, since: f64, d: f64) -> (Crossings, f64) {
    let rows = neutral::recording(100 + seed, 17.6, d, neutral::polynomial(MISS));
    let first = (FAULT / H).round() as usize;
    let n = (since / H).round() as usize;
    let bursts = neutral::crossing(&rows, 0.0, H, BURST).unwrap();
    (forecast(&infer(&rows[first..=first + n], d), seed, 60, d), bursts)
}

/// Median of the medians, 10 and 90 % of them, mean half-width of 68 %, mean probability of a burst, coverage of 90 % intervals.
struct Row {
    median: [f64; 3],
    half: f64,
    probability: f64,
    coverage: f64,
}

fn table_row(n_seed: u64, since: f64, d: f64) -> Row {
    let all: Vec<(Crossings, f64)> = (0..n_seed).map(|seed| one(seed, since, d)).collect();
    let or_late = |t: Option<f64>| t.unwrap_or(UNTIL);
    let medians: Vec<f64> = all.iter().map(|(c, _)| or_late(c.median())).collect();
    let half = |c: &Crossings| 0.5 * (or_late(c.quantile(0.84)) - or_late(c.quantile(0.16)));
    let holds = |(c, t): &(Crossings, f64)| {
        f64::from(u8::from(or_late(c.quantile(0.05)) <= *t && *t <= or_late(c.quantile(0.95))))
    };
    Row {
        median: [0.5, 0.1, 0.9].map(|p| quantile(medians.clone(), p)),
        half: mean(all.iter().map(|(c, _)| half(c))),
        probability: mean(all.iter().map(|(c, _)| c.probability_by(UNTIL))),
        coverage: mean(all.iter().map(holds)),
    }
}

#[test]
fn the_burst_is_forecast_two_seconds_after_a_fault_that_is_hardly_felt() {
    let quiet = neutral::recording(0, 17.6, 0.0, neutral::polynomial(MISS));
    let bursts = neutral::crossing(&quiet, 0.0, H, BURST).unwrap();
    // Reference: 17.09, rounded to 0.01.
    assert!((bursts - 17.09).abs() < 0.015, "{bursts}");
    let felt = quiet[(11.1 / H) as usize][0] / quiet[(9.0 / H) as usize][0] - 1.0;
    assert!((0.008..0.018).contains(&felt), "{felt}");
    let row = table_row(20, 2.1, 0.001);
    println!("at 2.1 s: median {:.2?}, half-width {:.2}, P {:.2}", row.median, row.half, row.probability);
    assert!((row.median[0] - 17.09).abs() < 0.5 && row.probability > 0.9);
}

#[test]
fn the_coefficients_are_found_within_their_posterior() {
    let truth = DVector::from_column_slice(&MISS);
    let distance = |seed: u64| {
        let rows = neutral::recording(500 + seed, 13.0, 0.001, neutral::polynomial(MISS));
        let posterior = infer(&rows[1800..], 0.001);
        let off = posterior.mean() - &truth;
        (off.transpose() * posterior.precision() * &off)[(0, 0)]
    };
    // χ² of three degrees of freedom: mean 3, median 2.37; 40 draws have a median within 1.4 to 3.6.
    let middle = median((0..40).map(distance));
    assert!((1.4..3.6).contains(&middle), "{middle}");
}

#[test]
#[ignore = "half a minute in release: just inference"]
fn the_table_of_the_miss() {
    for d in [0.005, 0.001, 0.0003] {
        for since in [1.0, 2.1, 3.0, 4.0] {
            let row = table_row(20, since, d);
            println!(
                "d {d} at {since} s: median {:.2} ({:.2} .. {:.2}), half-width {:.2}, P {:.2}, coverage {:.2}",
                row.median[0], row.median[1], row.median[2], row.half, row.probability, row.coverage
            );
        }
    }
    for d in [0.005, 0.001, 0.0003] {
        let row = table_row(200, 4.0, d);
        println!("d {d} at 4 s, 200 seeds: half-width {:.3}, coverage {:.3}", row.half, row.coverage);
        // 200 draws have an sd of 2.1 %; order statistics of 60 members take some per cent off a 90 % interval.
        assert!((0.82..0.96).contains(&row.coverage), "{}", row.coverage);
    }
}
