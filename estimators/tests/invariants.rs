//! What must hold for every analysis, each against an exact answer.
#![allow(clippy::unwrap_used)]
mod common;

use common::{around, difference, filter, gauss, kalman, linear, mean_factor, normal, rng, uniform};
use nalgebra::{DMatrix, DVector};
use starlings_estimators::{
    Analysis, Data, Filter, Gaussian, Noise, Particles, Points, Root, Roukf, SigmaSet,
};

struct Run {
    x: DMatrix<f64>,
    theta: DMatrix<f64>,
    log_likelihood: f64,
    ensembles: Vec<DMatrix<f64>>,
    transforms: Vec<DMatrix<f64>>,
}

/// The reduced filter on the linear problem: X <- A X, then X <- X T.
fn reduced(problem: &common::Linear, roukf: &Roukf) -> Run {
    let (n, p) = problem.l0.shape();
    let sd: Vec<f64> = (0..p).map(|j| problem.l0[(n - p + j, j)]).collect();
    let mut particles =
        roukf.init(&Gaussian::independent(problem.x0.rows(n - p, p).clone_owned().as_slice(), &sd));
    let mut x = around(&problem.x0, &problem.l0, &roukf.set);
    let mut run =
        Run { x: x.clone(), theta: x.clone(), log_likelihood: 0.0, ensembles: vec![], transforms: vec![] };
    for values in &problem.observed {
        x = &problem.a * x;
        let data = Data { values, noise: &problem.noise };
        let (next, analysis) = roukf.analysis(&particles, &(&problem.h * &x), &data).unwrap();
        x *= &analysis.transform;
        particles = next;
        run.log_likelihood += analysis.log_likelihood;
        run.ensembles.push(x.clone());
        run.transforms.push(analysis.transform);
    }
    (run.x, run.theta) = (x, particles.theta);
    run
}

fn at_unit(roukf: &Roukf) -> Particles {
    let p = roukf.set.n_param();
    roukf.init(&Gaussian::independent(&vec![0.0; p], &vec![1.0; p]))
}

fn step(roukf: &Roukf, z: &DMatrix<f64>, values: &[f64], noise: &Noise) -> Analysis {
    roukf.analysis(&at_unit(roukf), z, &Data { values, noise }).unwrap().1
}

#[test]
fn a_linear_gaussian_problem_is_solved_like_the_kalman_filter_by_every_set_and_root() {
    let problem = linear(1);
    let exact = kalman(&problem);
    let (mean, covariance) = exact.analysis.last().unwrap();
    for points in common::ALL {
        for root in [Root::Symmetric, Root::Cholesky] {
            let roukf = filter(points, problem.p, root);
            let run = reduced(&problem, &roukf);
            let (m, l) = mean_factor(&run.x, &roukf.set);
            // 60 analyses of order-one numbers: 4e-14 in double precision, 1e-10 leaves room for other libraries.
            assert!((m - mean).amax() < 1e-10, "{points:?} {root:?}");
            assert!(difference(&(&l * l.transpose()), covariance) < 1e-10, "{points:?} {root:?}");
            assert!((run.log_likelihood / exact.log_likelihood - 1.0).abs() < 1e-10, "{points:?} {root:?}");
            let parameters = run.x.rows(25, 5).clone_owned();
            assert!(difference(&run.theta, &parameters) < 1e-10, "parameters move like the states");
        }
    }
}

#[test]
fn columns_of_every_transform_sum_to_one() {
    for points in common::ALL {
        let run = reduced(&linear(1), &filter(points, 5, Root::Symmetric));
        for t in &run.transforms {
            // Sums of about ten numbers of order one.
            assert!(t.row_sum().iter().all(|s| (s - 1.0).abs() < 1e-13));
        }
    }
}

#[test]
fn parameters_alone_are_estimated_like_recursive_least_squares_over_200_steps() {
    let (p, sigma) = (5, 0.3);
    let mut g = rng(2);
    let truth = normal(&mut g, p, 1);
    let mean: Vec<f64> = (0..p).map(|_| gauss(&mut g)).collect();
    let sd: Vec<f64> = (0..p).map(|_| uniform(&mut g, 0.7, 1.4)).collect();
    let prior = Gaussian::independent(&mean, &sd);
    let roukf = filter(Points::Simplex, p, Root::Symmetric);
    let mut particles = roukf.init(&prior);
    let Gaussian { mean: mut theta, mut covariance } = prior;
    let noise = Noise::Diagonal(vec![sigma]);
    for _ in 0..200 {
        let h = normal(&mut g, 1, p);
        let y = (&h * &truth)[0] + sigma * gauss(&mut g);
        let data = Data { values: &[y], noise: &noise };
        particles = roukf.analysis(&particles, &(&h * &particles.theta), &data).unwrap().0;
        let ph = &covariance * h.transpose();
        let gain = &ph / (sigma * sigma + (&h * &ph)[0]);
        theta += &gain * (y - (&h * &theta)[0]);
        covariance -= &gain * ph.transpose();
        let found = roukf.gaussian(&particles);
        // 2e-14 in double precision after 200 updates.
        assert!((found.mean - &theta).amax() < 1e-10);
        assert!(difference(&found.covariance, &covariance) < 1e-10);
    }
}

#[test]
fn worthless_observations_leave_the_simplex_where_it_is() {
    let mut g = rng(3);
    let roukf = filter(Points::Simplex, 5, Root::Symmetric);
    let z = normal(&mut g, 8, 6);
    let t = step(&roukf, &z, &[1.0; 8], &Noise::Diagonal(vec![1e9; 8])).transform;
    // S is 1e-9, its square is below rounding, the step about 1e-18.
    assert!(difference(&t, &DMatrix::identity(6, 6)) < 1e-12);
}

#[test]
fn without_observations_the_simplex_does_not_move_and_other_sets_keep_mean_and_factor() {
    let mut g = rng(4);
    for points in common::ALL {
        let roukf = filter(points, 3, Root::Symmetric);
        let r = roukf.set.n_particle();
        let a = step(&roukf, &normal(&mut g, 2, r), &[f64::NAN; 2], &Noise::Diagonal(vec![1.0; 2]));
        let x = normal(&mut g, 7, r);
        let ((m0, l0), (m1, l1)) =
            (mean_factor(&x, &roukf.set), mean_factor(&(&x * &a.transform), &roukf.set));
        // Identity and projection to a few roundings.
        assert!((m0 - m1).amax() < 1e-13 && difference(&l0, &l1) < 1e-13);
        assert!(points != Points::Simplex || a.transform == DMatrix::identity(r, r));
        assert_eq!((a.n_used, a.nis.to_bits(), a.log_likelihood.abs().to_bits()), (0, 0, 0));
    }
}

#[test]
fn permuting_the_particles_permutes_the_transform() {
    let mut g = rng(5);
    let roukf = filter(Points::Simplex, 5, Root::Symmetric);
    let order = [3, 0, 5, 1, 4, 2];
    let permuted = Roukf {
        set: SigmaSet {
            points: roukf.set.points.select_columns(&order),
            weights: roukf.set.weights.select_rows(&order),
        },
        ..roukf.clone()
    };
    let (z, values) = (normal(&mut g, 8, 6), normal(&mut g, 8, 1));
    let noise = Noise::Diagonal((0..8).map(|_| uniform(&mut g, 0.5, 2.0)).collect());
    let t = step(&roukf, &z, values.as_slice(), &noise).transform;
    let tp = step(&permuted, &z.select_columns(&order), values.as_slice(), &noise).transform;
    // Only the order of sums differs: 1e-15.
    assert!(difference(&tp, &t.select_rows(&order).select_columns(&order)) < 1e-12);
}

#[test]
fn rotating_the_points_does_not_change_the_transform_of_the_symmetric_root() {
    let mut g = rng(6);
    let mut roukf = filter(Points::Simplex, 5, Root::Symmetric);
    let mut rotated = roukf.clone();
    rotated.set.points = normal(&mut g, 5, 5).qr().q() * &rotated.set.points;
    let (z, values) = (normal(&mut g, 8, 6), normal(&mut g, 8, 1));
    let noise = Noise::Diagonal(vec![0.7; 8]);
    let turn = |a: &Roukf, b: &Roukf| {
        difference(
            &step(a, &z, values.as_slice(), &noise).transform,
            &step(b, &z, values.as_slice(), &noise).transform,
        )
    };
    // Exact in real arithmetic: 1e-15. The Cholesky root depends on the axes, which shows that this test can fail.
    assert!(turn(&roukf, &rotated) < 1e-12);
    (roukf.root, rotated.root) = (Root::Cholesky, Root::Cholesky);
    assert!(turn(&roukf, &rotated) > 1e-3);
}

#[test]
fn one_by_one_or_all_at_once_independent_observations_say_the_same() {
    let mut g = rng(7);
    let roukf = filter(Points::Simplex, 5, Root::Symmetric);
    let x = normal(&mut g, 30, 6);
    let hx = normal(&mut g, 8, 30) * &x;
    let z = hx.map(f64::sin) + hx.component_mul(&hx);
    let values = normal(&mut g, 8, 1);
    let sd: Vec<f64> = (0..8).map(|_| uniform(&mut g, 0.5, 2.0)).collect();
    let batch = step(&roukf, &z, values.as_slice(), &Noise::Diagonal(sd.clone()));
    let (mut zs, mut xs, mut log_likelihood) = (z, x.clone(), 0.0);
    for j in 0..8 {
        let row = zs.rows(j, 1).clone_owned();
        let a = step(&roukf, &row, &[values[j]], &Noise::Diagonal(vec![sd[j]]));
        zs *= &a.transform;
        xs *= &a.transform;
        log_likelihood += a.log_likelihood;
    }
    let ((m1, l1), (m2, l2)) =
        (mean_factor(&(x * batch.transform), &roukf.set), mean_factor(&xs, &roukf.set));
    // Predictions reach 1e3 noise sd, which costs three digits: 1e-12 measured.
    assert!((m1 - m2).amax() < 1e-9);
    assert!(difference(&(&l1 * l1.transpose()), &(&l2 * l2.transpose())) < 1e-9);
    assert!((batch.log_likelihood - log_likelihood).abs() < 1e-9);
}

#[test]
fn a_change_of_basis_of_the_observations_changes_nothing() {
    let mut g = rng(8);
    let roukf = filter(Points::Simplex, 5, Root::Symmetric);
    let (z, values) = (normal(&mut g, 8, 6), normal(&mut g, 8, 1));
    let sd: Vec<f64> = (0..8).map(|_| uniform(&mut g, 0.5, 2.0)).collect();
    let m = normal(&mut g, 8, 8) + DMatrix::identity(8, 8) * 3.0;
    let w = DMatrix::from_diagonal(&DVector::from_iterator(8, sd.iter().map(|s| s * s)));
    let t = step(&roukf, &z, values.as_slice(), &Noise::Diagonal(sd)).transform;
    let turned = Noise::Dense(&m * w * m.transpose());
    let tm = step(&roukf, &(&m * z), (&m * values).as_slice(), &turned).transform;
    // The condition number of M, about 10, times a few roundings.
    assert!(difference(&t, &tm) < 1e-11);
}

#[test]
fn larger_sets_have_the_gain_of_the_plain_unscented_filter() {
    let mut g = rng(9);
    for points in [Points::Star, Points::Canonical, Points::JulierUhlmann { kappa: 1.0 }] {
        let roukf = filter(points, 5, Root::Symmetric);
        let mean: Vec<f64> = (0..5).map(|_| gauss(&mut g)).collect();
        let particles = roukf.init(&Gaussian::independent(&mean, &[0.8, 1.1, 0.9, 1.3, 1.0]));
        let x = &particles.theta;
        let z = DMatrix::from_fn(3, x.ncols(), |k, i| match k {
            0 => (0.3 * x[(0, i)]).exp(),
            1 => x[(1, i)] * x[(1, i)] + x[(2, i)],
            _ => x[(3, i)].sin() * x[(4, i)],
        });
        let noise = Noise::Diagonal(vec![0.5, 1.0 / 3.0, 0.25]);
        let values = [1.0, 2.0, 0.3];
        let (after, a) = roukf.analysis(&particles, &z, &Data { values: &values, noise: &noise }).unwrap();
        let (joint_mean, joint) = common::moments(&x.clone().stack(&z), &roukf.set);
        let w = DMatrix::from_diagonal(&DVector::from_column_slice(&[0.25, 1.0 / 9.0, 1.0 / 16.0]));
        let pz = joint.view((5, 5), (3, 3)) + w;
        let gain = joint.view((0, 5), (5, 3)) * pz.clone().try_inverse().unwrap();
        let d = DVector::from_column_slice(&values) - joint_mean.rows(5, 3);
        let expected = joint_mean.rows(0, 5) + &gain * &d;
        let covariance = joint.view((0, 0), (5, 5)) - &gain * &pz * gain.transpose();
        let found = roukf.gaussian(&after);
        // Direct formulas of order-one numbers: 1e-15.
        assert!((found.mean - expected).amax() < 1e-12, "{points:?}");
        assert!(difference(&found.covariance, &covariance) < 1e-12, "{points:?}");
        let nis = d.dot(&(pz.clone().try_inverse().unwrap() * &d));
        assert!((a.nis - nis).abs() < 1e-12);
        for k in 0..3 {
            assert!((a.innovation_sd[k] - pz[(k, k)].sqrt()).abs() < 1e-12, "W_eff holds the even part");
        }
        let log_det = pz.determinant().ln();
        assert!((a.log_likelihood + 0.5 * (3.0 * std::f64::consts::TAU.ln() + log_det + nis)).abs() < 1e-12);
    }
}

trait Stack {
    fn stack(self, below: &DMatrix<f64>) -> DMatrix<f64>;
}

impl Stack for DMatrix<f64> {
    fn stack(self, below: &DMatrix<f64>) -> DMatrix<f64> {
        let n = self.nrows();
        let mut both = self.resize_vertically(n + below.nrows(), 0.0);
        both.rows_mut(n, below.nrows()).copy_from(below);
        both
    }
}

#[test]
fn the_product_of_transforms_smooths_like_rauch_tung_and_striebel() {
    let problem = linear(10);
    let exact = kalman(&problem);
    let roukf = filter(Points::Simplex, problem.p, Root::Symmetric);
    let run = reduced(&problem, &roukf);
    // Smoothed particles X_{k|K} = X_{k|k} T_{k+1} ... T_K.
    let mut later = DMatrix::identity(run.transforms[0].nrows(), run.transforms[0].ncols());
    let (mut mean, mut covariance) = exact.analysis.last().unwrap().clone();
    for k in (0..run.ensembles.len()).rev() {
        if k + 1 < run.ensembles.len() {
            let ((xm, pm), (xp, pp)) = (&exact.forecast[k + 1], &exact.analysis[k]);
            let eigen = pm.clone().symmetric_eigen();
            let limit = 1e-11 * eigen.eigenvalues.amax();
            let inverse = eigen.eigenvalues.map(|v| if v > limit { 1.0 / v } else { 0.0 });
            let inverse =
                &eigen.eigenvectors * DMatrix::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
            let gain = pp * problem.a.transpose() * inverse;
            mean = xp + &gain * (&mean - xm);
            covariance = pp + &gain * (&covariance - pm) * gain.transpose();
        }
        let (m, l) = mean_factor(&(&run.ensembles[k] * &later), &roukf.set);
        // The pseudo-inverse of a covariance of rank p limits the comparison: 1e-13 measured.
        assert!((m - &mean).amax() < 1e-9, "mean at {k}");
        assert!(difference(&(&l * l.transpose()), &covariance) < 1e-9, "covariance at {k}");
        later = &run.transforms[k] * later;
    }
}
