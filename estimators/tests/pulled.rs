//! Particles that were pulled towards the mean or dropped: nothing is lost where the model is linear.
#![allow(clippy::unwrap_used)]
mod common;

use common::{difference, filter, mean_factor, normal, rng};
use nalgebra::{DMatrix, DVector};
use starlings_estimators::{
    Analysis, Data, EstimatorError, Filter, Gaussian, Noise, Particles, Points, Root, Roukf,
};

/// A linear model of two parameters more than it has rows, or many more rows.
struct Linear {
    h: DMatrix<f64>,
    values: Vec<f64>,
    noise: Noise,
}

fn linear(m: usize) -> Linear {
    let mut g = rng(40);
    let values = normal(&mut g, m, 1);
    Linear {
        h: normal(&mut g, m, 3),
        values: values.as_slice().to_vec(),
        noise: Noise::Diagonal(vec![0.7; m]),
    }
}

impl Linear {
    fn analysis(&self, roukf: &Roukf, particles: &Particles) -> (Particles, Analysis) {
        let mut z = &self.h * &particles.theta;
        for (i, s) in particles.pull.iter().enumerate() {
            if *s <= 0.0 {
                z.column_mut(i).fill(f64::NAN);
            }
        }
        roukf.analysis(particles, &z, &Data { values: &self.values, noise: &self.noise }).unwrap()
    }
}

fn start(points: Points) -> (Roukf, Particles) {
    let roukf = filter(points, 3, Root::Symmetric);
    let particles = roukf.init(&Gaussian::independent(&[1.0, -2.0, 0.5], &[0.5, 1.0, 2.0]));
    (roukf, particles)
}

fn assert_same(a: &(Particles, Analysis), b: &(Particles, Analysis)) {
    // The regression inverts a 3 x 3 matrix of condition below 100: 1e-13 measured.
    assert!(difference(&a.0.theta, &b.0.theta) < 1e-10);
    assert!((a.1.log_likelihood - b.1.log_likelihood).abs() < 1e-10);
    assert!((a.1.nis - b.1.nis).abs() < 1e-10);
    assert!((&a.1.innovation - &b.1.innovation).amax() < 1e-10);
    assert!((&a.1.innovation_sd - &b.1.innovation_sd).amax() < 1e-10);
}

#[test]
fn a_linear_model_loses_nothing_by_pulled_particles() {
    for m in [2, 100] {
        for points in common::ALL {
            let (roukf, particles) = start(points);
            let expected = linear(m).analysis(&roukf, &particles);
            let (once, _) = roukf.pull(&particles, 1, 0.5);
            let (twice, _) = roukf.pull(&once, 0, 0.1);
            let (again, _) = roukf.pull(&twice, 1, 0.25);
            for pulled in [once, twice, again] {
                let found = linear(m).analysis(&roukf, &pulled);
                assert_same(&found, &expected);
                assert!(found.1.information_lost > 0.0 && found.1.information_lost < 1.0);
                assert!(found.0.pull.iter().all(|s| *s >= 1.0), "all points are whole again");
            }
        }
    }
}

#[test]
fn a_linear_model_loses_nothing_by_dropped_particles() {
    for m in [2, 100] {
        for (points, lost) in [(Points::Star, 6), (Points::Star, 1), (Points::Canonical, 4)] {
            let (roukf, particles) = start(points);
            let expected = linear(m).analysis(&roukf, &particles);
            let dropped = roukf.drop(&particles, lost).unwrap();
            let found = linear(m).analysis(&roukf, &dropped);
            assert_same(&found, &expected);
            assert_eq!(
                found.1.transform.row(lost).amax().to_bits(),
                0,
                "nothing of a dropped particle is used"
            );
        }
    }
}

#[test]
fn pulling_states_with_the_matrix_keeps_the_linear_relation_and_the_mean() {
    for points in common::ALL {
        let (roukf, particles) = start(points);
        let states = normal(&mut rng(41), 6, 3) * &particles.theta;
        let (pulled, m) = roukf.pull(&particles, 2, 0.3);
        assert!((roukf.mean(&pulled) - roukf.mean(&particles)).amax() < 1e-12, "a few roundings");
        assert!(
            difference(&roukf.gaussian(&pulled).covariance, &roukf.gaussian(&particles).covariance) < 1e-12
        );
        let expected = roukf.mean(&particles) + (particles.theta.column(2) - roukf.mean(&particles)) * 0.3;
        assert!((pulled.theta.column(2) - expected).amax() < 1e-13);
        let a = linear(4).analysis(&roukf, &pulled).1;
        let whole = linear(4).analysis(&roukf, &particles).1;
        let ((m1, l1), (m2, l2)) = (
            mean_factor(&(&states * m * a.transform), &roukf.set),
            mean_factor(&(states * whole.transform), &roukf.set),
        );
        assert!(
            (m1 - m2).amax() < 1e-11 && difference(&l1, &l2) < 1e-11,
            "states move as if nothing was pulled"
        );
    }
}

#[test]
fn a_dropped_particle_can_come_back_closer() {
    let (roukf, particles) = start(Points::Star);
    let dropped = roukf.drop(&particles, 1).unwrap();
    let (back, m) = roukf.pull(&dropped, 1, 0.5);
    let expected = roukf.mean(&particles) + (particles.theta.column(1) - roukf.mean(&particles)) * 0.5;
    assert!((back.theta.column(1) - expected).amax() < 1e-12, "a few roundings");
    assert!(difference(&(&dropped.theta * m), &back.theta) < 1e-12);
}

#[test]
fn a_simplex_cannot_lose_a_point_and_says_which_parameters_would_move_freely() {
    let (roukf, particles) = start(Points::Simplex);
    // The last point alone reaches far along the third parameter.
    let error = roukf.drop(&particles, 3).unwrap_err();
    assert_eq!(error, EstimatorError::NotSpanned { n_left: 3, n_param: 3, parameters: vec![2] });
    let advice = error.to_string();
    assert!(advice.contains("logit") && advice.contains("prior") && advice.contains("star"));
    let mut forced = particles;
    forced.pull[3] = 0.0;
    let data = Data { values: &[1.0], noise: &Noise::Diagonal(vec![1.0]) };
    assert!(roukf.analysis(&forced, &DMatrix::zeros(1, 4), &data).is_err());
}

#[test]
fn losing_both_points_of_a_pair_is_refused_for_the_star() {
    let (roukf, particles) = start(Points::Star);
    let one = roukf.drop(&particles, 1).unwrap();
    let error = roukf.drop(&one, 4).unwrap_err();
    assert_eq!(error, EstimatorError::NotSpanned { n_left: 5, n_param: 3, parameters: vec![1] });
}

#[test]
#[should_panic(expected = "distance in (0, 1]")]
fn a_particle_is_not_pulled_beyond_its_point() {
    let (roukf, particles) = start(Points::Star);
    let _ = roukf.pull(&particles, 0, 1.5);
}

#[test]
fn bad_input_is_named_by_row_and_particle() {
    let (roukf, particles) = start(Points::Simplex);
    let z = DMatrix::from_fn(2, 4, |k, i| (k + i) as f64);
    let ask = |z: &DMatrix<f64>, values: &[f64], noise: &Noise| {
        roukf.analysis(&particles, z, &Data { values, noise }).map(|(_, a)| a.n_used)
    };
    let good = Noise::Diagonal(vec![1.0; 2]);
    let mut holed = z.clone();
    holed[(1, 2)] = f64::INFINITY;
    let value = f64::INFINITY;
    let lost = EstimatorError::NonFinitePrediction { row: 1, particle: 2, value };
    assert_eq!(ask(&holed, &[0.0, 1.0], &good), Err(lost));
    assert_eq!(ask(&holed, &[0.0, f64::NAN], &good), Ok(1), "a missing row is not looked at");
    assert_eq!(ask(&z, &[value, 1.0], &good), Err(EstimatorError::NonFiniteObservation { row: 0, value }));
    let shape = |what, expected, got| Err(EstimatorError::Shape { what, expected, got });
    assert_eq!(ask(&z, &[0.0], &good), shape("rows of the predictions", 1, 2));
    assert_eq!(
        ask(&z.columns(0, 3).clone_owned(), &[0.0; 2], &good),
        shape("columns of the predictions", 4, 3)
    );
    assert_eq!(ask(&z, &[0.0; 2], &Noise::Diagonal(vec![1.0])), shape("noise standard deviations", 2, 1));
    let silent = Noise::Diagonal(vec![1.0, 0.0]);
    assert_eq!(ask(&z, &[0.0; 2], &silent), Err(EstimatorError::NoiseNotPositive { row: 1, value: 0.0 }));
    let singular = Noise::Dense(DMatrix::from_element(2, 2, 1.0));
    assert_eq!(ask(&z, &[0.0; 2], &singular), Err(EstimatorError::NoiseNotDefinite { n_used: 2 }));
    let narrow = Noise::Dense(DMatrix::identity(2, 1));
    assert_eq!(ask(&z, &[0.0; 2], &narrow), shape("columns of the noise covariance", 2, 1));
    let huge = DVector::from_element(2, 1e200);
    let overflow = ask(&z, huge.as_slice(), &Noise::Diagonal(vec![1e-10; 2]));
    assert_eq!(overflow, Err(EstimatorError::NotFinite { what: "the square of a whitened prediction" }));
}
