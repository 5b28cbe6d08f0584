//! Unknown inputs of linear systems, and scenarios, on recordings of a nozzle that something strikes.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod kit;

use kit::{STEP, divided, library, nozzle, quantile, recorded_angle, recording, recovered, relative_error};
use nalgebra::{DMatrix, DVector};
use starlings_estimators::scenarios::{AmplitudePrior, Scenario, identify};
use starlings_estimators::unknown_input::{LinearSystem, Samples, recover};
use starlings_estimators::{EstimatorError, Gaussian};

const SEVERITY: AmplitudePrior = AmplitudePrior { mean: 1.0, sd: 0.5 };

/// Figures of one noise level.
#[derive(Default)]
struct Level {
    divided: Vec<f64>,
    smoothed: Vec<f64>,
    /// Recordings whose scenario was named right by the correlation of torques, and by the likelihood of the angle.
    by_torque: usize,
    by_angle: usize,
    /// Recordings whose severity lies in its interval of 90 %.
    held: usize,
    severity: Vec<f64>,
    n: usize,
}

fn best(scenarios: &[Scenario], key: impl Fn(&Scenario) -> f64) -> usize {
    (0..scenarios.len()).max_by(|a, b| key(&scenarios[*a]).total_cmp(&key(&scenarios[*b]))).unwrap()
}

/// Every scenario with so many draws of noise and severity.
fn level(noise: f64, draws: u64) -> Level {
    let library = library();
    let none = DMatrix::zeros(1, library[0].len());
    let response = |torque: &Vec<f64>| nozzle().response(STEP, &none, torque).unwrap().as_slice().to_vec();
    let angles: Vec<Vec<f64>> = library.iter().map(response).collect();
    let mut level = Level::default();
    for (i, course) in library.iter().enumerate() {
        for draw in 0..draws {
            let recording = recording(course, noise, 100 * i as u64 + draw);
            let torque = recovered(&recording);
            level.divided.push(relative_error(&divided(&recording), &recording.torque));
            level.smoothed.push(relative_error(&torque.input, &recording.torque));
            let spread = torque.sd.iter().sum::<f64>() / torque.sd.len() as f64;
            let torques = identify(&torque.input, spread, &library, SEVERITY).unwrap();
            level.by_torque += usize::from(best(&torques, |s| s.correlation) == i);
            let traces = identify(&recorded_angle(&recording), recording.noise, &angles, SEVERITY).unwrap();
            level.by_angle += usize::from(best(&traces, |s| s.probability) == i);
            let [lo, hi] = traces[i].interval90();
            level.held += usize::from((lo..=hi).contains(&recording.severity));
            level.severity.push((traces[i].amplitude / recording.severity - 1.0).abs());
            level.n += 1;
        }
    }
    level
}

#[test]
fn the_torque_is_recovered_and_the_scenario_named_at_one_and_three_per_cent_noise() {
    for noise in [0.01, 0.03] {
        let mut found = level(noise, 2);
        let error = quantile(&mut found.smoothed, 0.5);
        // The reference finds 0.27 and 0.36 over 40 recordings, and 4 and 12 by second differences.
        assert!(error < if noise < 0.02 { 0.35 } else { 0.45 }, "{noise}: {error}");
        assert!(quantile(&mut found.divided, 0.5) > 2.0);
        // All of sixteen, where the reference finds all of forty.
        assert_eq!((found.by_torque, found.by_angle), (16, 16), "{noise}");
    }
}

#[test]
#[ignore = "a minute: `just diagnostics`"]
fn torques_and_scenarios_over_forty_recordings_of_every_noise_level() {
    println!(
        "noise: torque error by differences, by the smoother (90 %), scenario by torque, by angle, severity error, held of 90 %"
    );
    for noise in [0.001, 0.01, 0.03, 0.1] {
        let mut found = level(noise, 5);
        let share = |count: usize| count as f64 / found.n as f64;
        let (by_torque, by_angle, held) = (share(found.by_torque), share(found.by_angle), share(found.held));
        let [divided, smoothed, late] =
            [(&mut found.divided, 0.5), (&mut found.smoothed.clone(), 0.5), (&mut found.smoothed, 0.9)]
                .map(|(values, q)| quantile(values, q));
        let severity = quantile(&mut found.severity, 0.5);
        println!(
            "{noise}: {divided:.2} {smoothed:.3} ({late:.3}) {by_torque:.3} {by_angle:.3} {severity:.4} {held:.3}"
        );
        assert!(noise > 0.011 || smoothed < 0.35, "{smoothed}");
        assert!(noise > 0.031 || (by_torque >= 0.95 && by_angle >= 0.95), "{by_torque}, {by_angle}");
        // Forty intervals of 90 %: fewer than 31 happen once in 150 such tests.
        assert!(noise > 0.031 || held > 0.77, "{held}");
    }
}

/// dx/dt = q, seen with noise: a state that is the integral of its input.
fn integrator() -> LinearSystem {
    LinearSystem {
        rate: DMatrix::zeros(1, 1),
        known: DMatrix::from_element(1, 1, 2.0),
        unknown: DVector::from_element(1, 1.0),
        outputs: DMatrix::identity(1, 1),
    }
}

#[test]
fn a_constant_input_has_the_mean_and_sd_of_a_straight_line() {
    let (n, h, sd) = (21, 0.5, 0.1);
    // Far from a straight line: what is fitted is the line itself.
    let observed = DMatrix::from_fn(1, n, |_, k| 0.3 * k as f64 + (k as f64).sin());
    let inputs = DMatrix::zeros(1, n);
    let samples = Samples { step: h, observed: &observed, noise: &[sd], inputs: &inputs };
    let start = Gaussian::independent(&[0.0; 2], &[1e4, 1e4]);
    // So slow a walk that the input is a constant.
    let found = recover(&integrator(), &samples, &start, &[1e-9]).unwrap();
    let t = |k: usize| h * k as f64;
    let middle = t(n - 1) / 2.0;
    let square: f64 = (0..n).map(|k| (t(k) - middle).powi(2)).sum();
    let slope = (0..n).map(|k| (t(k) - middle) * observed[k]).sum::<f64>() / square;
    for k in [0, 10, 20] {
        // The prior of 1e4 and the walk move them by 1e-10 of themselves, rounding by the ratio of variances 1e10.
        assert!((found.input[k] - slope).abs() < 1e-5, "{} for {slope}", found.input[k]);
        assert!((found.sd[k] / (sd / square.sqrt()) - 1.0).abs() < 1e-4, "{}", found.sd[k]);
    }
}

#[test]
fn the_smoother_is_the_conditional_mean_of_the_joint_normal() {
    let (n, h, sd, sigma) = (6, 0.5, 0.2, 0.7);
    let mut observed = DMatrix::from_fn(1, n, |_, k| (1.3 * k as f64).cos());
    observed[3] = f64::NAN;
    let inputs = DMatrix::from_fn(1, n, |_, k| 0.2 * k as f64);
    let samples = Samples { step: h, observed: &observed, noise: &[sd], inputs: &inputs };
    let start = Gaussian::independent(&[0.1, -0.4], &[0.5, 0.8]);
    let found = recover(&integrator(), &samples, &start, &[sigma]).unwrap();
    // x_k and q_k as sums of (x_0, q_0) and of the steps' noise: z⁺ = [[1, h], [0, 1]] z + 2 ∫u + noise of covariance
    // σ² [[h³/3, h²/2], [h²/2, h]].
    let f = DMatrix::from_row_slice(2, 2, &[1.0, h, 0.0, 1.0]);
    let q = DMatrix::from_row_slice(2, 2, &[h.powi(3) / 3.0, h * h / 2.0, h * h / 2.0, h]) * (sigma * sigma);
    let mut mean = vec![start.mean.clone()];
    let mut joint = DMatrix::zeros(2 * n, 2 * n);
    joint.view_mut((0, 0), (2, 2)).copy_from(&start.covariance);
    for k in 1..n {
        let area = h * (inputs[k - 1] + inputs[k]) / 2.0;
        mean.push(&f * &mean[k - 1] + DVector::from_vec(vec![2.0 * area, 0.0]));
        let row = &f * joint.view((2 * k - 2, 0), (2, 2 * k));
        joint.view_mut((2 * k, 0), (2, 2 * k)).copy_from(&row);
        joint.view_mut((0, 2 * k), (2 * k, 2)).copy_from(&row.transpose());
        let own = &f * joint.view((2 * k - 2, 2 * k - 2), (2, 2)) * f.transpose() + &q;
        joint.view_mut((2 * k, 2 * k), (2, 2)).copy_from(&own);
    }
    let seen = [0, 1, 2, 4, 5];
    let cross = DMatrix::from_fn(2 * n, 5, |i, j| joint[(i, 2 * seen[j])]);
    let own =
        DMatrix::from_fn(5, 5, |i, j| joint[(2 * seen[i], 2 * seen[j])] + if i == j { sd * sd } else { 0.0 });
    let innovation = DVector::from_fn(5, |i, _| observed[seen[i]] - mean[seen[i]][0]);
    let root = own.cholesky().unwrap();
    let moved = &cross * root.solve(&innovation);
    let left = &joint - &cross * root.solve(&cross.transpose());
    let log_likelihood = -0.5 * innovation.dot(&root.solve(&innovation))
        - root.l().diagonal().map(f64::ln).sum()
        - 2.5 * std::f64::consts::TAU.ln();
    // Matrices of a dozen rows with numbers of about one.
    assert!((found.log_likelihood[0] - log_likelihood).abs() < 1e-10, "{}", found.log_likelihood[0]);
    for k in 0..n {
        assert!((found.input[k] - (mean[k][1] + moved[2 * k + 1])).abs() < 1e-10, "{k}");
        assert!((found.states[k] - (mean[k][0] + moved[2 * k])).abs() < 1e-10, "{k}");
        assert!((found.sd[k] - left[(2 * k + 1, 2 * k + 1)].sqrt()).abs() < 1e-10, "{k}");
    }
}

#[test]
fn a_recording_that_does_not_fit_the_system_is_refused_by_what_is_wrong() {
    let (observed, inputs) = (DMatrix::from_element(1, 4, 0.1), DMatrix::zeros(1, 4));
    let start = Gaussian::independent(&[0.0; 2], &[1.0; 2]);
    let refused = |observed: &DMatrix<f64>, inputs: &DMatrix<f64>, noise: &[f64], intensities: &[f64]| {
        let samples = Samples { step: 0.5, observed, noise, inputs };
        recover(&integrator(), &samples, &start, intensities).unwrap_err()
    };
    let short = DMatrix::zeros(1, 3);
    let expected = EstimatorError::Shape { what: "samples of the known inputs", expected: 4, got: 3 };
    assert_eq!(refused(&observed, &short, &[0.1], &[1.0]), expected);
    let noise = refused(&observed, &inputs, &[-0.1], &[1.0]);
    assert_eq!(noise, EstimatorError::NoiseNotPositive { row: 0, value: -0.1 });
    assert_eq!(refused(&observed, &inputs, &[0.1], &[1.0, 0.0]), EstimatorError::Intensity { value: 0.0 });
    assert!(matches!(refused(&observed, &inputs, &[0.1], &[]), EstimatorError::Intensity { .. }));
    let mut spoiled = observed.clone();
    spoiled[2] = f64::INFINITY;
    let expected = EstimatorError::NonFiniteObservation { row: 2, value: f64::INFINITY };
    assert_eq!(refused(&spoiled, &inputs, &[0.1], &[1.0]), expected);
    let samples = Samples { step: f64::NAN, observed: &observed, noise: &[0.1], inputs: &inputs };
    assert!(recover(&integrator(), &samples, &start, &[1.0]).is_err(), "no step");
}
