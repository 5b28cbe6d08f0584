//! What must hold whatever the units, the coordinates, the order of terms and the cuts of the recording.

use std::sync::Arc;

use nalgebra::{DVector, Matrix3, Vector3};
use proptest::prelude::*;
use starlings_estimators::inference::{Basis, Diffusion, Fit, Polynomial, Posterior, Prior, Rule, Structure};

use crate::kit::{lorenz, sums};

const H: f64 = 0.005;

fn quadratic() -> Arc<Basis> {
    let all = Polynomial::new(&lorenz::NAMES, 3, &[0, 1, 2], 2, true);
    Arc::new(Basis::new(3, 0).with(Rule::MidPoint, all).unwrap())
}

fn infer(rows: &[[f64; 3]], h: f64) -> Posterior {
    let basis = quadratic();
    let structure = Structure::same(&basis, &lorenz::NAMES).unwrap();
    Fit::new(Diffusion::Full, 30).posterior(&sums(&basis, rows, h), &structure).unwrap()
}

/// The drift of a posterior at a point.
fn drift(posterior: &Posterior, x: &Vector3<f64>) -> DVector<f64> {
    let mut phi = vec![0.0; 10];
    quadratic().values(0.0, x.as_slice(), &mut phi);
    posterior.drift() * DVector::from_vec(phi)
}

/// Slopes against differences of values at some points, and blocks against single samples.
fn assert_consistent(basis: &Arc<Basis>, samples: &[Vec<f64>]) {
    let (b, l) = (basis.n_function(), basis.n_state());
    let (mut slopes, mut above, mut below) = (vec![0.0; b * l], vec![0.0; b], vec![0.0; b]);
    for (n, x) in samples.iter().enumerate() {
        let time = 0.1 * n as f64;
        basis.slopes(time, x, &mut slopes);
        for state in 0..l {
            let step = 1e-5 * x[state].abs().max(0.1);
            let moved = |by: f64| {
                let mut x = x.clone();
                x[state] += by;
                x
            };
            basis.values(time, &moved(step), &mut above);
            basis.values(time, &moved(-step), &mut below);
            for f in 0..b {
                let difference = (above[f] - below[f]) / (2.0 * step);
                let slope = slopes[f * l + state];
                // The third derivative times the square of the step, and rounding over the step.
                assert!(
                    (slope - difference).abs() < 1e-7 * (1.0 + slope.abs() + above[f].abs()),
                    "{f} {state}"
                );
            }
        }
    }
}

#[test]
fn slopes_are_those_of_the_values() {
    let point = |n: usize, k: usize| 1.0 + 0.31 * (n as f64 * 1.7 + k as f64).sin();
    let samples: Vec<Vec<f64>> = (0..20).map(|n| (0..4).map(|k| point(n, k)).collect()).collect();
    let names = ["x", "y", "u", "w"];
    let cubic = |constant| Polynomial::new(&names, 2, &[0, 1, 3], 3, constant);
    let with = |constant| Basis::new(2, 2).with(Rule::MidPoint, cubic(constant)).unwrap();
    let (all, fewer) = (Arc::new(with(true)), Arc::new(with(false)));
    assert_eq!((all.n_function(), fewer.n_function()), (20, 19));
    assert_eq!(all.names()[..6], ["1", "x", "y", "w", "x^2", "x*y"]);
    assert_eq!(all.index("x*y*w"), Some(14));
    assert_consistent(&all, &samples);
    assert_consistent(&fewer, &samples);
    let three = |n: &Vec<f64>| n[..3].to_vec();
    let samples: Vec<Vec<f64>> = samples.iter().map(three).collect();
    assert_consistent(&crate::kit::motor::basis(), &samples);
    assert_consistent(&lorenz::basis(), &samples);
    // Leaks are taken at the left point and have no slopes; levels here are above all openings.
    let flows: Vec<Vec<f64>> = samples.iter().map(|x| x.iter().map(|v| v + 1.0).collect()).collect();
    let basis = crate::kit::tanks::flows();
    assert_consistent(&basis, &flows);
}

/// Blocks go another way than single samples in a polynomial.
#[test]
fn sums_of_blocks_are_those_of_single_samples() {
    let rows: Vec<[f64; 3]> = lorenz::strong(1, 300, H, 5.0);
    let basis = quadratic();
    let sums = sums(&basis, &rows, H);
    let (mut phi, mut v) = (nalgebra::DMatrix::zeros(10, 10), nalgebra::DMatrix::zeros(3, 10));
    for pair in rows.windows(2) {
        let mid: [f64; 3] = std::array::from_fn(|i| 0.5 * (pair[0][i] + pair[1][i]));
        let (mut values, mut slopes) = (vec![0.0; 10], vec![0.0; 30]);
        basis.values(0.0, &mid, &mut values);
        basis.slopes(0.0, &mid, &mut slopes);
        let values = DVector::from_vec(values);
        phi += &values * values.transpose();
        v += nalgebra::DMatrix::from_vec(3, 10, slopes);
    }
    // Rounding of 300 terms.
    assert!((sums.phi() - &phi).amax() < 1e-12 * phi.amax() && (sums.v() - &v).amax() < 1e-11 * v.amax());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn an_affine_change_of_variables_changes_the_drift_as_a_vector_and_the_noise_as_a_tensor(
        entries in proptest::collection::vec(-1.0_f64..1.0, 9),
        shift in proptest::collection::vec(-20.0_f64..20.0, 3),
        seed in 0_u64..1000,
    ) {
        let a = Matrix3::from_row_slice(&entries) + Matrix3::identity() * 3.0;
        let b = Vector3::from_column_slice(&shift);
        let rows = lorenz::strong(seed, 1000, H, 10.0);
        let moved: Vec<[f64; 3]> = rows.iter().map(|x| (a * Vector3::from(*x) + b).into()).collect();
        let (plain, moved) = (infer(&rows, H), infer(&moved, H));
        for x in rows.iter().step_by(199).map(|x| Vector3::from(*x)) {
            let expected = a * drift(&plain, &x).fixed_rows::<3>(0);
            let found = drift(&moved, &(a * x + b));
            // The moved regression has a condition of 10^4 times that of the first; speeds are some hundred.
            prop_assert!((found - expected).amax() < 1e-5, "{x}");
        }
        let expected = a * plain.diffusion.fixed_view::<3, 3>(0, 0) * a.transpose();
        prop_assert!((expected - &moved.diffusion).amax() < 1e-7 * moved.diffusion.amax());
    }

    #[test]
    fn other_units_of_states_and_time_scale_all_that_is_found(
        length in 1e-3_f64..1e3,
        time in 1e-3_f64..1e3,
        seed in 0_u64..1000,
    ) {
        let rows = lorenz::strong(seed, 600, H, 10.0);
        let scaled: Vec<[f64; 3]> = rows.iter().map(|x| x.map(|v| v * length)).collect();
        let (plain, scaled) = (infer(&rows, H), infer(&scaled, H * time));
        let degree = |p: usize| match p % 10 { 0 => 0, 1..=3 => 1, _ => 2 };
        for p in 0..30 {
            let unit = length.powi(1 - degree(p)) / time;
            let (a, b) = (plain.estimates[p].value.unwrap(), scaled.estimates[p].value.unwrap());
            // A condition of 10^6 times the rounding of the sums.
            prop_assert!((a.mean * unit - b.mean).abs() < 1e-6 * a.sd * unit);
            prop_assert!((a.sd * unit / b.sd - 1.0).abs() < 1e-6);
        }
        let expected = &plain.diffusion * (length * length / time);
        prop_assert!((expected - &scaled.diffusion).amax() < 1e-8 * scaled.diffusion.amax());
    }

    #[test]
    fn the_order_of_terms_does_not_matter(order in Just((0..27).collect::<Vec<usize>>()).prop_shuffle(), seed in 0_u64..1000) {
        let basis = lorenz::basis();
        let sums = sums(&basis, &lorenz::strong(seed, 600, H, 10.0), H);
        let ordered = Structure::same(&basis, &lorenz::NAMES).unwrap();
        let term = |p: &usize| {
            let (equation, function) = (lorenz::NAMES[p / 9], basis.names()[p % 9].as_str());
            (format!("{equation}:{function}"), equation, function)
        };
        let shuffled = order.iter().map(term).fold(Structure::new(&basis, &lorenz::NAMES).unwrap(), |s, (name, e, f)| {
            s.with(&name, &[(e, f, 1.0)]).unwrap()
        });
        let fit = Fit::new(Diffusion::Full, 27);
        let (a, b) = (fit.posterior(&sums, &ordered).unwrap(), fit.posterior(&sums, &shuffled).unwrap());
        for estimate in &a.estimates {
            let (x, y) = (estimate.value.unwrap(), b.value(&estimate.name).unwrap());
            prop_assert!((x.mean - y.mean).abs() < 1e-8 * x.sd && (x.sd / y.sd - 1.0).abs() < 1e-8);
        }
    }

    /// With a given D the posterior of one block is the prior of the next (eqs. 1.23 to 1.26).
    #[test]
    fn blocks_one_after_the_other_give_the_posterior_of_all(cut in 50_usize..550, seed in 0_u64..1000) {
        let basis = lorenz::basis();
        let rows = lorenz::strong(seed, 600, H, 10.0);
        let structure = lorenz::seven(&basis);
        let noise = Diffusion::Known(nalgebra::DMatrix::identity(3, 3) * 100.0);
        let prior = Prior::independent(&lorenz::SEVEN.map(|c| 1.1 * c), &[30.0; 7]).unwrap();
        let fit = Fit { prior, ..Fit::new(noise, 7) };
        let whole = fit.posterior(&sums(&basis, &rows, H), &structure).unwrap();
        let first = fit.posterior(&sums(&basis, &rows[..=cut], H), &structure).unwrap();
        let then = Fit { prior: first.as_prior(), ..fit };
        let both = then.posterior(&sums(&basis, &rows[cut..], H), &structure).unwrap();
        for (a, b) in whole.estimates.iter().zip(&both.estimates) {
            let (a, b) = (a.value.unwrap(), b.value.unwrap());
            prop_assert!((a.mean - b.mean).abs() < 1e-8 * a.sd && (a.sd / b.sd - 1.0).abs() < 1e-9);
        }
    }
}
