//! The error of the sampling step, and what extrapolation leaves of it.

use nalgebra::DVector;
use starlings_estimators::inference::{
    Decimation, Diffusion, Extrapolated, Fit, InferenceError, Posterior, Strength, Structure, extrapolate,
};

use crate::kit::lorenz;

const N: usize = 160_000;
const H: f64 = 0.0025;

/// Posteriors of the Lorenz system at h, 2h, 4h, 8h and 16h.
fn levels(noise: f64) -> Vec<Posterior> {
    let basis = lorenz::basis();
    let structure = Structure::same(&basis, &lorenz::NAMES).unwrap();
    let mut decimation = Decimation::new(&basis, H, 5).unwrap();
    let rows = lorenz::fine(9, N, (H, 4), &(lorenz::diffusion() * noise));
    for (n, row) in rows.iter().enumerate() {
        decimation.push(n as f64 * H, row).unwrap();
    }
    let sums = decimation.sums().unwrap();
    assert_eq!(sums[1].n_step(), N as u64 - 1, "both phases");
    sums.iter().map(|s| Fit::new(Diffusion::Full, 27).posterior(s, &structure).unwrap()).collect()
}

fn means(found: &Extrapolated) -> DVector<f64> {
    DVector::from_iterator(27, found.estimates.iter().map(|e| e.value.unwrap().mean))
}

/// Root mean square difference in posterior sd.
fn error(a: &DVector<f64>, b: &DVector<f64>, posterior: &Posterior) -> f64 {
    let sd = posterior.covariance().diagonal().map(f64::sqrt);
    ((a - b).component_div(&sd).norm_squared() / 27.0).sqrt()
}

/// The same path at finer steps is the truth here, so that chance does not count.
fn check(noise: f64, from: usize, strength: Strength) {
    let levels = levels(noise);
    let truth = means(&extrapolate(&levels[..2], Some(strength)).unwrap());
    let coarse = &levels[from..];
    let found = extrapolate(coarse, None).unwrap();
    let (plain, left) =
        (error(coarse[0].mean(), &truth, &coarse[0]), error(&means(&found), &truth, &coarse[0]));
    println!("noise {noise}: ratio {:.2?}, {plain:.2} sd, {left:.2} extrapolated", found.ratio);
    assert_eq!(found.used, strength, "{:?}", found.ratio);
    assert!(left < 0.4 * plain, "{plain} {left}");
    assert_eq!(extrapolate(&coarse[..2], Some(strength)).unwrap().estimates, found.estimates);
    let refused = extrapolate(&coarse[..2], None).unwrap_err();
    assert!(matches!(refused, InferenceError::Shape { expected: 3, got: 2, .. }));
}

#[test]
fn extrapolation_takes_away_the_error_of_the_step_under_weak_noise() {
    check(1.0, 2, Strength::Weak);
}

#[test]
fn extrapolation_takes_away_the_error_of_the_step_under_strong_noise() {
    check(1600.0 / 0.2867, 1, Strength::Strong);
}
