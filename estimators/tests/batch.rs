//! The batch fit against closed forms, reference standard deviations and strongly nonlinear problems.
#![allow(clippy::unwrap_used)]
mod common;

use common::batch::{Model, compartments, fit};
use common::rcr::{MM_HG, pressure, prior, truth};
use common::{difference, gauss, normal, rng, uniform};
use nalgebra::{DMatrix, DVector};
use starlings_estimators::{
    BatchState, BatchStep, Data, Filter, Gaussian, Noise, Points, Root, Roukf, SigmaSet,
};

/// Minimum of the cost by a slow and safe search: coordinate steps that shrink when none improves.
fn minimum(model: &Model<'_>, prior: &Gaussian, data: &Data<'_>, start: &DVector<f64>) -> DVector<f64> {
    let Noise::Diagonal(sd) = data.noise else { panic!("independent noise") };
    let prior_sd = prior.sd();
    let cost = |theta: &DVector<f64>| {
        let y = model(theta.as_slice());
        let misfit: f64 = (0..sd.len()).map(|k| ((y[k] - data.values[k]) / sd[k]).powi(2)).sum();
        misfit + (theta - &prior.mean).component_div(&prior_sd).norm_squared()
    };
    let (mut best, p) = (start.clone(), start.len());
    let mut least = cost(&best);
    let mut axes = DMatrix::from_diagonal(&(&prior_sd * 0.1));
    for round in 0..4000 {
        let mut moved = false;
        let before = best.clone();
        for j in 0..p {
            for sign in [1.0, -1.0] {
                let tried = &best + axes.column(j) * sign;
                let c = cost(&tried);
                if c < least {
                    (best, least, moved) = (tried, c, true);
                    break;
                }
            }
        }
        // Keep going the way the round went, which follows curved valleys.
        let ahead = &best + (&best - before);
        let c = cost(&ahead);
        if c < least {
            (best, least) = (ahead, c);
        }
        if !moved {
            axes *= 0.5;
            let turn = normal(&mut rng(round), p, p).qr().q();
            axes = axes.clone() * turn;
            if axes.amax() < 1e-10 {
                break;
            }
        }
    }
    best
}

fn assert_at_minimum(
    name: &str,
    model: &Model<'_>,
    prior: &Gaussian,
    data: &Data<'_>,
    end: &(BatchState, BatchStep),
) {
    let (state, step) = end;
    assert!(step.converged, "{name}: {} iterations, step {}", state.iteration, step.step);
    let exact = minimum(model, prior, data, &step.posterior.mean);
    let off = (&step.posterior.mean - &exact).component_div(&step.posterior.sd()).amax();
    // The promise of the tolerance: 0.02 posterior sd.
    assert!(off < 0.02, "{name}: {off} sd from the minimum after {} iterations", state.iteration);
}

#[test]
fn a_linear_problem_is_solved_in_closed_form_by_every_set() {
    let mut g = rng(60);
    let (m, p) = (40, 4);
    let h = normal(&mut g, m, p);
    let root = normal(&mut g, p, p);
    let prior = Gaussian {
        mean: normal(&mut g, p, 1).column(0).clone_owned(),
        covariance: &root * root.transpose() + DMatrix::identity(p, p),
    };
    let noisy = normal(&mut g, m, m);
    let w = (&noisy * noisy.transpose()) / m as f64 + DMatrix::identity(m, m);
    let values: Vec<f64> = (0..m).map(|k| if k % 7 == 3 { f64::NAN } else { gauss(&mut g) }).collect();
    let rows: Vec<usize> = (0..m).filter(|&k| !values[k].is_nan()).collect();
    let (hs, ws) = (h.select_rows(&rows), w.select_rows(&rows).select_columns(&rows));
    let y = DVector::from_iterator(rows.len(), rows.iter().map(|&k| values[k]));
    let information =
        prior.covariance.clone().try_inverse().unwrap() + hs.tr_mul(&ws.clone().try_inverse().unwrap()) * &hs;
    let covariance = information.try_inverse().unwrap();
    let spread = &hs * &prior.covariance * hs.transpose() + &ws;
    let d = &y - &hs * &prior.mean;
    let solved = spread.clone().cholesky().unwrap();
    let mean = &prior.mean + &prior.covariance * hs.transpose() * solved.solve(&d);
    let log_det = 2.0 * solved.l().diagonal().map(f64::ln).sum();
    let evidence =
        -0.5 * (rows.len() as f64 * std::f64::consts::TAU.ln() + log_det + d.dot(&solved.solve(&d)));
    let noise = Noise::Dense(w);
    let model = |theta: &[f64]| (&h * DVector::from_column_slice(theta)).as_slice().to_vec();
    for points in common::ALL {
        let (state, step) = fit(points, &model, &prior, &Data { values: &values, noise: &noise });
        // Differences over a hundredth of a posterior sd lose two to three digits.
        assert!(step.converged && state.iteration <= 3, "{points:?}: {} iterations", state.iteration);
        assert!((&step.posterior.mean - &mean).amax() < 1e-10, "{points:?}");
        assert!(difference(&step.posterior.covariance, &covariance) < 1e-10, "{points:?}");
        assert!((step.evidence - evidence).abs() < 1e-9, "{points:?}");
        assert_eq!(step.n_used, rows.len());
    }
}

#[test]
fn the_windkessel_has_the_reference_standard_deviations() {
    let values = pressure(&truth());
    let noise = Noise::Diagonal(vec![2.0 * MM_HG; values.len()]);
    let (state, step) =
        fit(Points::Simplex, &pressure, &prior(0.7), &Data { values: &values, noise: &noise });
    assert!(step.converged && state.iteration <= 12, "{} iterations", state.iteration);
    for (sd, expected) in step.posterior.sd().iter().zip([0.005_836_28, 0.001_044_43, 0.008_004_8]) {
        // The reference is the information at the truth; the estimate is 0.01 sd away, pulled by the prior.
        assert!((sd / expected - 1.0).abs() < 1e-3, "{sd} {expected}");
    }
    let off = &step.posterior.mean - DVector::from_column_slice(&truth());
    assert!(off.component_div(&step.posterior.sd()).amax() < 0.05, "noise-free data: only the prior pulls");
}

#[test]
fn two_compartments_are_fitted_from_wide_priors() {
    let mean: Vec<f64> = [4.0f64, 1.5, 2.0, 0.15].iter().map(|v| v.ln()).collect();
    for factor in [2.0f64, 3.0] {
        let prior = Gaussian::independent(&mean, &[factor.ln(); 4]);
        for seed in 0..12 {
            let mut g = rng(70 + seed);
            let truth: Vec<f64> = mean.iter().map(|m| m + factor.ln() * uniform(&mut g, -1.7, 1.7)).collect();
            let clean = compartments(&truth);
            let sd = 0.02 * clean[0];
            let values: Vec<f64> = clean.iter().map(|v| v + sd * gauss(&mut g)).collect();
            let noise = Noise::Diagonal(vec![sd; 30]);
            let data = Data { values: &values, noise: &noise };
            let end = fit(Points::Simplex, &compartments, &prior, &data);
            assert_at_minimum(&format!("factor {factor} seed {seed}"), &compartments, &prior, &data, &end);
            assert!(end.1.misfit < 70.0, "seed {seed}: misfit {} of 30 values", end.1.misfit);
        }
    }
}

#[test]
fn rosenbrocks_valley_is_followed_to_its_end() {
    let model = |theta: &[f64]| vec![10.0 * (theta[1] - theta[0] * theta[0]), 1.0 - theta[0]];
    let noise = Noise::Diagonal(vec![0.1; 2]);
    let data = Data { values: &[0.0, 0.0], noise: &noise };
    for points in [Points::Simplex, Points::Star] {
        let prior = Gaussian::independent(&[-1.2, 1.0], &[3.0, 3.0]);
        let end = fit(points, &model, &prior, &data);
        assert_at_minimum(&format!("{points:?}"), &model, &prior, &data, &end);
    }
}

#[test]
fn a_model_that_cannot_follow_the_data_still_ends_at_the_minimum() {
    // Oscillation against a decaying exponential: residuals of ten noise sd, where the slope matters most.
    let model = |theta: &[f64]| {
        (0..60)
            .map(|k| theta[0].exp() * (-theta[1].exp() * 0.1 * f64::from(k)).exp() + theta[2])
            .collect::<Vec<f64>>()
    };
    let values: Vec<f64> =
        (0..60).map(|k| f64::from(k) * 0.1).map(|t| 3.0 * (-t / 2.0).exp() + (3.0 * t).sin()).collect();
    let noise = Noise::Diagonal(vec![0.1; 60]);
    let data = Data { values: &values, noise: &noise };
    for points in [Points::Simplex, Points::Canonical] {
        let prior = Gaussian::independent(&[0.0, 0.0, 0.0], &[1.0, 1.0, 1.0]);
        let end = fit(points, &model, &prior, &data);
        assert_at_minimum(&format!("{points:?}"), &model, &prior, &data, &end);
        assert!(end.1.misfit / 60.0 > 10.0, "the misfit is large: {}", end.1.misfit);
    }
}

/// Eight observations of two parameters through orthogonal columns, so that the posterior is two known Gaussians: the first is
/// known `ratio` times better than its prior, the second sqrt(2) times.
fn informed_by(ratio: f64) -> (DMatrix<f64>, Gaussian, Vec<f64>, DVector<f64>, DVector<f64>) {
    let (m, noise) = (8.0_f64, 1.0);
    let sd = DVector::from_vec(vec![ratio.recip(), 0.5_f64.sqrt()]);
    // 1 / sd^2 = 1 + m h^2 with prior and noise of one.
    let h = sd.map(|sd| ((sd.powi(-2) - 1.0) / m).sqrt());
    let columns = DMatrix::from_fn(8, 2, |k, j| h[j] * if j == 0 || k % 2 == 0 { 1.0 } else { -1.0 });
    let prior = Gaussian::independent(&[0.0, 0.0], &[1.0, 1.0]);
    let scatter = [0.3, -0.8, 1.1, 0.4, -0.6, -1.2, 0.7, 0.1];
    let truth = DVector::from_vec(vec![0.7, -0.4]);
    let values: Vec<f64> = (0..8).map(|k| (columns.row(k) * &truth)[0] + noise * scatter[k]).collect();
    let mean = columns.tr_mul(&DVector::from_vec(values.clone())).component_mul(&sd.map(|sd| sd * sd));
    (columns, prior, values, mean, sd)
}

#[test]
fn a_posterior_ten_thousand_million_times_sharper_than_its_prior_is_the_closed_form_and_the_filters() {
    for ratio in [1e3, 1e5, 1e7, 3e9, 1e10] {
        let (columns, prior, values, mean, sd) = informed_by(ratio);
        let noise = Noise::Diagonal(vec![1.0; 8]);
        let data = Data { values: &values, noise: &noise };
        let model = |theta: &[f64]| (&columns * DVector::from_column_slice(theta)).as_slice().to_vec();
        let (_, step) = fit(Points::Simplex, &model, &prior, &data);
        assert!(step.converged, "ratio {ratio:e}: step {}", step.step);
        let set = SigmaSet::new(Points::Simplex, 2).unwrap();
        let roukf = Roukf { set, root: Root::Symmetric };
        let particles = roukf.init(&prior);
        let (after, _) = roukf.analysis(&particles, &(&columns * &particles.theta), &data).unwrap();
        let filtered = roukf.gaussian(&after);
        // A double holds a value of one to 2e-16, which is 2e-6 sd at the largest ratio; a hundred such roundings.
        let rounding = 1e-10 + 2e-14 * ratio;
        for (what, found) in [("batch", &step.posterior), ("filter", &filtered)] {
            for j in 0..2 {
                let off = (found.mean[j] - mean[j]).abs() / sd[j];
                let share = found.sd()[j] / sd[j];
                assert!(
                    off < 1e-8 + rounding,
                    "{what}, ratio {ratio:e}, parameter {j}: mean off by {off} sd"
                );
                assert!(
                    (share - 1.0).abs() < 1e-8 + rounding,
                    "{what}, ratio {ratio:e}, parameter {j}: sd {share} of the closed form"
                );
            }
        }
    }
}
