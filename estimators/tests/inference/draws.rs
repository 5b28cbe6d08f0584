//! Draws from a posterior: the intervals of its tables, and what cannot be drawn from.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use starlings_estimators::Gaussian;
use starlings_estimators::inference::{Diffusion, Drawn, Draws, InferenceError};
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

const DRAWS: usize = 20_000;

fn shares(form: &Diffusion) -> [f64; 4] {
    let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 1.2, 1.2, 1.0]);
    let gaussian = Gaussian { mean: DVector::from_vec(vec![3.0, -1.0]), covariance };
    let diffusion = match form {
        Diffusion::Full => DMatrix::from_row_slice(2, 2, &[2.0, 0.8, 0.8, 0.5]),
        _ => DMatrix::from_diagonal(&DVector::from_vec(vec![2.0, 2.0])),
    };
    let degrees = 6.0;
    let draws = Draws::new(gaussian, &diffusion, Some(degrees), form.clone()).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut inside = [0.0; 4];
    for _ in 0..DRAWS {
        let Drawn { coefficients, noise } = draws.draw(&mut rng);
        let d = &noise * noise.transpose();
        let t = StudentsT::new(0.0, 1.0, degrees).unwrap().inverse_cdf(0.95);
        let sizes = [(coefficients[0] - 3.0) / 2.0, coefficients[1] + 1.0];
        let ratios = [0, 1].map(|l| degrees * diffusion[(l, l)] / d[(l, l)]);
        let [lo, hi] = [0.05, 0.95].map(|p| ChiSquared::new(degrees).unwrap().inverse_cdf(p));
        let held = [
            sizes[0].abs() <= t,
            sizes[1].abs() <= t,
            (lo..=hi).contains(&ratios[0]),
            (lo..=hi).contains(&ratios[1]),
        ];
        for (sum, held) in inside.iter_mut().zip(held) {
            *sum += f64::from(u8::from(held)) / DRAWS as f64;
        }
    }
    inside
}

#[test]
fn draws_have_the_intervals_of_students_and_of_the_inverse_wishart_distribution() {
    // Of 20 000 draws a share of 0.9 has an sd of 0.002. Gaussian draws of the coefficients would hold 0.95 at six degrees.
    for form in [Diffusion::Full, Diffusion::Diagonal, Diffusion::Isotropic] {
        let found = shares(&form);
        assert!(found.iter().all(|share| (share - 0.9).abs() < 0.009), "{form:?}: {found:?}");
    }
}

#[test]
fn what_cannot_be_drawn_from_is_refused() {
    let gaussian = || Gaussian::independent(&[1.0], &[1.0]);
    let singular = DMatrix::from_element(2, 2, 1.0);
    let refused = Draws::new(gaussian(), &singular, Some(5.0), Diffusion::Full);
    assert_eq!(refused.err(), Some(InferenceError::NotDefinite { what: "the diffusion" }));
    let identity = DMatrix::identity(2, 2);
    assert!(Draws::new(gaussian(), &identity, Some(0.0), Diffusion::Full).is_err());
    let known = Draws::new(gaussian(), &identity, None, Diffusion::Known(identity.clone())).unwrap();
    let drawn = known.draw(&mut ChaCha8Rng::seed_from_u64(1));
    assert_eq!(drawn.noise, identity);
}
