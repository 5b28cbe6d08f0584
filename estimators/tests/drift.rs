//! Forgetting and random walks: the covariance of the parameters grows exactly as asked, sensitivities stay.
#![allow(clippy::unwrap_used)]
mod common;

use common::{difference, filter, mean_factor, normal, rng};
use nalgebra::DMatrix;
use starlings_estimators::{
    Analysis, Data, Drift, EstimatorError, Filter, Gaussian, Noise, Points, Root, Roukf,
};

const SD: [f64; 3] = [0.5, 1.0, 2.0];

/// One analysis with and without drift of particles with 7 states that depend on the parameters.
struct Pair {
    roukf: Roukf,
    theta: DMatrix<f64>,
    states: DMatrix<f64>,
    still: Analysis,
    moved: Analysis,
}

fn pair(points: Points, drift: [Drift; 3], values: &[f64]) -> Pair {
    let mut g = rng(30);
    let roukf = filter(points, 3, Root::Symmetric);
    let particles = roukf.init(&Gaussian::independent(&[1.0, 2.0, 3.0], &SD));
    let states = normal(&mut g, 7, 3) * &particles.theta;
    let z = (normal(&mut g, 2, 7) * &states).map(|v| v + 0.1 * v * v);
    let noise = Noise::Diagonal(vec![1.0, 2.0]);
    let data = Data { values, noise: &noise };
    let (after, still) = roukf.analysis(&particles, &z, &data).unwrap();
    let mut moved = still.clone();
    if let Some(drifted) = roukf.drift(&after, &drift, still.n_used > 0).unwrap() {
        moved.transform *= &drifted;
        let theta = &after.theta * drifted;
        assert!(difference(&theta, &(&particles.theta * &moved.transform)) < 1e-13, "T holds the drift");
    }
    Pair { roukf, theta: particles.theta, states, still, moved }
}

impl Pair {
    /// Mean and factor of parameters and states after an analysis.
    fn after(&self, x: &DMatrix<f64>, a: &Analysis) -> (nalgebra::DVector<f64>, DMatrix<f64>) {
        mean_factor(&(x * &a.transform), &self.roukf.set)
    }

    fn sensitivity(&self, a: &Analysis) -> DMatrix<f64> {
        self.after(&self.states, a).1 * self.after(&self.theta, a).1.try_inverse().unwrap()
    }
}

const DRIFTS: [[Drift; 3]; 3] = [
    [Drift::Walk(0.3), Drift::None, Drift::Walk(0.1)],
    [Drift::Forgetting(0.9), Drift::Forgetting(0.98), Drift::None],
    [Drift::Walk(0.2), Drift::Forgetting(0.95), Drift::None],
];

#[test]
fn drift_adds_exactly_its_variance_and_keeps_means_and_sensitivities() {
    for points in common::ALL {
        for drift in DRIFTS {
            let pair = pair(points, drift, &[3.0, -4.0]);
            let ((m0, l0), (m1, l1)) =
                (pair.after(&pair.theta, &pair.still), pair.after(&pair.theta, &pair.moved));
            let mut expected = &l0 * l0.transpose();
            for (j, d) in drift.into_iter().enumerate() {
                match d {
                    Drift::None => {}
                    Drift::Walk(sd) => expected[(j, j)] += sd * sd,
                    Drift::Forgetting(lambda) => {
                        expected.row_mut(j).scale_mut(1.0 / lambda.sqrt());
                        expected.column_mut(j).scale_mut(1.0 / lambda.sqrt());
                    }
                }
            }
            // One 3 x 3 inverse of order-one numbers.
            assert!((m0 - m1).amax() < 1e-12, "{points:?} {drift:?}");
            assert!(difference(&(&l1 * l1.transpose()), &expected) < 1e-12, "{points:?} {drift:?}");
            let (before, after) = (pair.sensitivity(&pair.still), pair.sensitivity(&pair.moved));
            assert!(difference(&before, &after) < 1e-11, "{points:?} {drift:?}");
            assert!(pair.moved.transform.row_sum().iter().all(|s| (s - 1.0).abs() < 1e-13));
        }
    }
}

#[test]
fn equal_forgetting_moves_every_particle_away_from_the_mean_by_the_same_factor() {
    let pair = pair(Points::Simplex, [Drift::Forgetting(0.9); 3], &[3.0, -4.0]);
    let (mean, _) = pair.after(&pair.states, &pair.still);
    let (still, moved) = (&pair.states * &pair.still.transform, &pair.states * &pair.moved.transform);
    for (a, b) in still.column_iter().zip(moved.column_iter()) {
        assert!(((a - &mean) / 0.9f64.sqrt() - (b - &mean)).amax() < 1e-12, "a few roundings");
    }
}

#[test]
fn without_data_a_walk_goes_on_and_nothing_is_forgotten() {
    let gap = [f64::NAN, f64::NAN];
    let walking = pair(Points::Simplex, [Drift::Walk(0.3); 3], &gap);
    let (_, l) = walking.after(&walking.theta, &walking.moved);
    for (j, sd) in SD.into_iter().enumerate() {
        assert!((l.row(j).norm_squared() - sd * sd - 0.09).abs() < 1e-12, "a few roundings");
    }
    let forgetting = pair(Points::Simplex, [Drift::Forgetting(0.9); 3], &gap);
    assert_eq!(forgetting.moved.transform, DMatrix::identity(4, 4));
}

#[test]
fn a_drift_out_of_range_or_of_the_wrong_number_or_without_spread_is_refused() {
    let refuse = |drift: Vec<Drift>, sd: [f64; 3]| {
        let roukf = filter(Points::Simplex, 3, Root::Symmetric);
        let particles = roukf.init(&Gaussian::independent(&[0.0; 3], &sd));
        roukf.drift(&particles, &drift, true).unwrap_err()
    };
    let wrong = |d| refuse(vec![Drift::None, d, Drift::None], SD);
    assert_eq!(wrong(Drift::Forgetting(0.0)), EstimatorError::DriftOutOfRange { parameter: 1, value: 0.0 });
    assert_eq!(wrong(Drift::Forgetting(1.5)), EstimatorError::DriftOutOfRange { parameter: 1, value: 1.5 });
    assert_eq!(wrong(Drift::Walk(-1.0)), EstimatorError::DriftOutOfRange { parameter: 1, value: -1.0 });
    let short = refuse(vec![Drift::None], SD);
    assert_eq!(short, EstimatorError::Shape { what: "drifts", expected: 3, got: 1 });
    let flat = refuse(vec![Drift::Walk(0.1); 3], [1.0, 0.0, 1.0]);
    assert_eq!(flat, EstimatorError::NoSpread { parameter: 1 });
}
