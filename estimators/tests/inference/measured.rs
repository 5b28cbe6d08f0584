//! Recordings with measurement noise: it is noticed, and the noise of the process is found in spite of it.

use nalgebra::DMatrix;
use starlings_estimators::inference::{
    Diffusion, Fit, InferenceError, Iteration, Measured, NoiseCheck, Noisy, NoisyPosterior, Posterior, Rule,
    Structure, Sums, Verdict, noise_checks,
};

use crate::kit::sde::{gauss, rng};
use crate::kit::{lorenz, sums};

const H: f64 = 0.005;

fn measured(seed: u64, n: usize, sd: f64) -> Vec<[f64; 3]> {
    let mut rng = rng(seed + 77);
    let rows = lorenz::weak(seed, n, H, &lorenz::diffusion());
    rows.iter().map(|x| x.map(|v| v + sd * gauss(&mut rng))).collect()
}

fn infer(sums: &Sums, lag_corrected: bool) -> (Posterior, Vec<NoiseCheck>) {
    let basis = lorenz::basis();
    let structure = Structure::same(&basis, &lorenz::NAMES).unwrap();
    let fit = Fit { lag_corrected, ..Fit::new(Diffusion::Full, 27) };
    let posterior = fit.posterior(sums, &structure).unwrap();
    let checks = noise_checks(sums, &structure, &posterior).unwrap();
    (posterior, checks)
}

#[test]
fn measurement_noise_is_noticed_and_its_size_found() {
    let (_, checks) = infer(&sums(&lorenz::basis(), &measured(1, 20_000, 0.1), H), true);
    for check in &checks {
        assert_eq!(check.verdict, Verdict::Matters, "{check:?}");
        assert!((check.measured / 0.01 - 1.0).abs() < 0.1, "{check:?}");
    }
    let (_, checks) = infer(&sums(&lorenz::basis(), &measured(1, 20_000, 0.0), H), false);
    assert!(checks.iter().all(|c| c.verdict == Verdict::Absent && c.ratio.abs() < 4.0 * c.sd), "{checks:?}");
}

/// The fit of two or three terms to thirty steps makes residuals anticorrelated by itself.
#[test]
fn few_steps_without_measurement_noise_are_not_called_noisy() {
    let basis = lorenz::basis_at(Rule::LeftPoint);
    let structure = lorenz::seven(&basis);
    let check = |seed| {
        let sums = sums(&basis, &lorenz::strong(seed, 30, H, 5.0), H);
        let posterior = Fit::new(Diffusion::Diagonal, 7).posterior(&sums, &structure).unwrap();
        noise_checks(&sums, &structure, &posterior).unwrap()
    };
    let checks: Vec<NoiseCheck> = (0..300).flat_map(check).collect();
    let wrong = checks.iter().filter(|c| c.verdict == Verdict::Matters).count();
    let ratio = crate::kit::mean(checks.iter().map(|c| c.ratio));
    println!("mean ratio {ratio:.4}, {wrong} of {} called noisy", checks.len());
    // White residuals have a ratio of 0, and 0.05 above that is exceeded by less than five in a hundred.
    assert!(wrong as f64 <= 0.05 * checks.len() as f64);
    // Two or three terms in thirty steps alone would make 0.08; that terms follow past noise leaves a rest of order 1/N.
    assert!(ratio.abs() < 0.04, "{ratio}");
}

#[test]
fn lagged_residuals_give_the_noise_of_the_process_and_unbiased_coefficients() {
    let sums = sums(&lorenz::basis(), &measured(2, 90_000, 0.1), H);
    let ((naive, _), (corrected, _)) = (infer(&sums, false), infer(&sums, true));
    let (truth, c) = (lorenz::diffusion(), |p: &Posterior, l, b| p.drift()[(l, b)]);
    println!("D11 {:.3} {:.3}", naive.diffusion[(0, 0)], corrected.diffusion[(0, 0)]);
    println!("a22 {:.3} {:.3}", c(&naive, 1, 1), c(&corrected, 1, 1));
    assert!(naive.diffusion[(0, 0)] > 10.0 * truth[(0, 0)], "2 M/h is fourteen times D");
    assert!((corrected.diffusion[(0, 0)] / truth[(0, 0)] - 1.0).abs() < 0.25);
    assert!(
        (c(&naive, 1, 1) + 1.0).abs() > 0.5,
        "the prefactor takes the noise of measurement for that of the process"
    );
    // Errors in the functions, of order M, remain.
    assert!((c(&corrected, 1, 1) + 1.0).abs() < 0.2 && (c(&corrected, 0, 0) + 10.0).abs() < 0.4);
}

fn smoothed(sd: f64, n: usize, known: &Measured, most: usize) -> NoisyPosterior {
    let (basis, rows) = (lorenz::basis(), measured(2, n, sd));
    let structure = Structure::same(&basis, &lorenz::NAMES).unwrap();
    let times = crate::kit::times(rows.len(), H);
    let noisy = Noisy { basis: &basis, step: H, times: &times, rows: rows.as_flattened() };
    let iteration = Iteration { most, tolerance: 0.5 };
    let found = noisy.infer(&Fit::new(Diffusion::Full, 27), &structure, known, iteration).unwrap();
    let c = found.posterior.drift();
    let a = [c[(0, 0)], c[(1, 1)], found.posterior.diffusion[(0, 0)], found.measured[(0, 0)]];
    println!("noise {sd}: a11, a22, D11, M {a:.4?}, {} rounds", found.log_likelihood.len());
    // Rounding of sums of ten thousand terms.
    assert!(found.log_likelihood.windows(2).all(|pair| pair[1] > pair[0] - 1e-3), "no round is worse");
    found
}

fn known(sd: f64) -> Measured {
    Measured::Known(DMatrix::identity(3, 3) * (sd * sd))
}

#[test]
fn smoothing_finds_drift_and_noise_under_measurement_noise() {
    let found = smoothed(0.3, 10_000, &known(0.3), 12);
    let (c, d) = (found.posterior.drift(), found.posterior.diffusion[(0, 0)]);
    // Lagged residuals give -9.2, -0.5 and 0.38 at this noise, where 2 M/h is 36. Errors here are of chance, four posterior sd.
    assert!((c[(0, 0)] + 10.0).abs() < 0.3 && (c[(1, 1)] + 1.0).abs() < 0.2, "{c}");
    assert!((d / 0.2867 - 1.0).abs() < 0.35, "D after twelve rounds from 0.4, {d}");
}

#[test]
fn smoothing_finds_the_measurement_noise_too() {
    let found = smoothed(0.1, 10_000, &Measured::Unknown, 12);
    let (c, d) = (found.posterior.drift(), found.posterior.diffusion[(0, 0)]);
    assert!((c[(0, 0)] + 10.0).abs() < 0.3 && (c[(1, 1)] + 1.0).abs() < 0.2, "{c}");
    assert!((d / 0.2867 - 1.0).abs() < 0.25, "{d}");
    assert!(found.measured.diagonal().iter().all(|m| (m / 0.01 - 1.0).abs() < 0.1), "{}", found.measured);
}

#[test]
fn measurement_noise_that_is_not_there_or_not_a_covariance_is_refused() {
    let (basis, rows) = (lorenz::basis(), measured(5, 5000, 0.0));
    let structure = Structure::same(&basis, &lorenz::NAMES).unwrap();
    let times = crate::kit::times(rows.len(), H);
    let noisy = Noisy { basis: &basis, step: H, times: &times, rows: rows.as_flattened() };
    let fit = Fit::new(Diffusion::Full, 27);
    let infer = |m| noisy.infer(&fit, &structure, &m, Iteration { most: 2, tolerance: 1.0 });
    let refused = infer(Measured::Known(DMatrix::zeros(3, 3))).unwrap_err();
    assert_eq!(refused, InferenceError::NotDefinite { what: "the measurement noise" });
    let outcome = infer(Measured::Unknown);
    assert!(
        matches!(outcome, Err(InferenceError::NotPositive { .. })),
        "no noise is seen in one of the states"
    );
}

#[test]
fn smoothing_begins_where_the_recording_itself_has_no_fit() {
    let (basis, rows) = (lorenz::basis(), measured(2, 10_000, 2.0));
    let structure = Structure::same(&basis, &lorenz::NAMES).unwrap();
    let sums = sums(&basis, &rows, H);
    for lag_corrected in [false, true] {
        let refused = Fit { lag_corrected, ..Fit::new(Diffusion::Full, 27) }.posterior(&sums, &structure);
        assert!(matches!(refused, Err(InferenceError::NotSettled { .. })), "{refused:?}");
    }
    let found = smoothed(2.0, 10_000, &known(2.0), 20);
    let (c, d) = (found.posterior.drift(), found.posterior.diffusion[(0, 0)]);
    // Of a quarter of the movement, errors leave a11 right within a tenth; the noise is one with them still, at 1 of 1600 = 2 M/h.
    assert!((c[(0, 0)] + 10.0).abs() < 1.0, "{c}");
    assert!(d < 5.0, "{d}");
}
