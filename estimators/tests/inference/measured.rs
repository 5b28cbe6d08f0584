//! Recordings with measurement noise: it is noticed, and the noise of the process is found in spite of it.

use starlings_estimators::inference::{
    Diffusion, Fit, NoiseCheck, Posterior, Rule, Structure, Sums, Verdict, noise_checks,
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
