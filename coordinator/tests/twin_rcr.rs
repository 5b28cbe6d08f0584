//! Ten beats of an RCR Windkessel against its truth: root mean square errors over several draws of the noise.
#![allow(clippy::unwrap_used)]
mod study_kit;

use study_kit::rcr::{TRUTH, files, study};
use study_kit::run_once;

/// Root mean square relative errors of Zc, R, C in percent, and the largest NIS.
fn errors(noise: f64, estimator: &str, seeds: std::ops::Range<u64>) -> ([f64; 3], f64) {
    let mut square = [0.0; 3];
    let mut nis = 0.0_f64;
    let n = seeds.end - seeds.start;
    std::thread::scope(|scope| {
        let runs: Vec<_> = seeds
            .map(|seed| scope.spawn(move || run_once(&study(noise, estimator), &files(noise, seed)).summary))
            .collect();
        for run in runs {
            let summary = run.join().unwrap();
            for (j, truth) in TRUTH.iter().enumerate() {
                square[j] += (summary.parameters[j].estimate / truth - 1.0).powi(2) / n as f64;
            }
            nis = nis.max(summary.fit.nis_per_observation);
        }
    });
    (square.map(|s| 100.0 * s.sqrt()), nis)
}

fn assert_within(found: [f64; 3], bounds: [f64; 3]) {
    assert!(found.iter().zip(bounds).all(|(f, b)| *f <= b), "{found:?} % against {bounds:?} %");
}

#[test]
fn two_passes_recover_the_parameters_from_pressures_with_2_mmhg_of_noise() {
    let (found, nis) = errors(2.0, "passes = 2", 0..4);
    // The posterior sd is 0.58, 0.10 and 0.80 %.
    assert_within(found, [1.5, 0.2, 2.0]);
    assert!(nis < 1.2, "{nis}");
}

#[test]
fn one_pass_of_resampled_star_points_recovers_them_from_nearly_noise_free_pressures() {
    let (found, _) = errors(0.01, "points = \"star\"\nresample = \"svd\"\npasses = 1", 0..4);
    // Twice the figures of ten draws of a plain unscented filter: 0.0037, 0.0004, 0.0047 %.
    assert_within(found, [0.008, 0.0008, 0.01]);
}
