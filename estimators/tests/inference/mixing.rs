//! Table 1.5: 14 unknowns of two oscillators from 26 coefficients of their mixtures.

use starlings_estimators::inference::{
    Diffusion, Fit, InferenceError, Posterior, Reduced, Structure, reduce,
};

use crate::kit::fhn::{self, TRUTH};
use crate::kit::{median, sums};

const STEPS: usize = 45_000;

fn infer(seed: u64) -> Posterior {
    let basis = fhn::basis();
    let structure = Structure::same(&basis, &["y1", "y2"]).unwrap();
    let sums = sums(&basis, &fhn::recording(seed, STEPS), fhn::H);
    Fit::new(Diffusion::Full, 26).posterior(&sums, &structure).unwrap()
}

/// The best of four starts, with the faster memory first.
fn unmixed(posterior: &Posterior) -> Reduced {
    let starts = [0.3, 1.0, -0.7, 3.0].into_iter().filter_map(|mix| fhn::start(posterior.drift(), mix));
    let fits = starts.filter_map(|start| reduce(posterior, &start, fhn::coefficients).ok());
    let best = fits.min_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared)).unwrap();
    if best.mean[10] >= best.mean[11] { best } else { Reduced { mean: fhn::swapped(&best.mean), ..best } }
}

#[test]
fn oscillators_behind_a_mixing_matrix_are_found() {
    let found: Vec<Reduced> = (0..20).map(|seed| unmixed(&infer(seed))).collect();
    let error = |k: usize| median(found.iter().map(|r| (r.mean[k] / TRUTH[k] - 1.0).abs()));
    let chi = median(found.iter().map(|r| r.chi_squared));
    let errors: Vec<f64> = (0..14).map(error).collect();
    println!("{errors:.4?}, chi squared {chi:.1}");
    assert!(errors[..4].iter().all(|e| *e < 0.016), "X");
    assert!(errors[6..8].iter().all(|e| *e < 0.026), "alpha");
    assert!(errors[8..10].iter().all(|e| *e < 0.014), "b");
    assert_eq!(found[0].degrees, 12);
    assert!((8.0..18.0).contains(&chi), "{chi} for 12 degrees of freedom");
}

#[test]
fn a_reduced_model_that_is_wrong_is_told_by_chi_squared() {
    let posterior = infer(1);
    let right = unmixed(&posterior);
    // Without the memory the 26 coefficients of the same recording are far from what 12 unknowns can give.
    let forget = |theta: &nalgebra::DVector<f64>| {
        let mut theta = theta.clone();
        theta[10] = theta[11];
        fhn::coefficients(&theta)
    };
    let start = right.mean.clone();
    let wrong = match reduce(&posterior, &start, forget) {
        // The unknown that is no longer used.
        Err(InferenceError::Collinear { .. } | InferenceError::Overflow { .. }) => {
            let fewer = |theta: &nalgebra::DVector<f64>| {
                let mut full = theta.clone().insert_row(10, 0.0);
                full[10] = full[11];
                fhn::coefficients(&full)
            };
            reduce(&posterior, &start.remove_row(10), fewer).unwrap()
        }
        other => panic!("an unknown without influence was accepted: {other:?}"),
    };
    assert!(right.probability > 1e-3, "{}", right.probability);
    assert!(wrong.probability < 1e-6 && wrong.degrees == 13, "{wrong:?}");
}
