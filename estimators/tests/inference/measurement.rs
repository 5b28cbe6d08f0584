//! The measurement model, and the evidence for terms.

use std::sync::Arc;

use nalgebra::DMatrix;
use starlings_estimators::inference::{
    Basis, Diffusion, Fit, Function, InferenceError, Polynomial, Prior, Regression, Rule, Structure,
};

use crate::kit::sde::{gauss, rng};
use crate::kit::{lorenz, sums};

/// Two gauges of one pressure: a common gain, an offset each, correlated noise.
#[test]
fn gains_offsets_and_noise_of_gauges_are_found() {
    let basis = Basis::new(2, 1)
        .with(Rule::MidPoint, Function::of_inputs("1", |_, _| 1.0))
        .and_then(|b| b.with(Rule::MidPoint, Function::of_inputs("p", |_, x| x[2])));
    let basis = Arc::new(basis.unwrap());
    let structure = Structure::new(&basis, &["first", "second"])
        .and_then(|s| s.with("gain", &[("first", "p", 1.0), ("second", "p", 1.0)]))
        .and_then(|s| s.with("offset 1", &[("first", "1", 1.0)]))
        .and_then(|s| s.with("offset 2", &[("second", "1", 1.0)]))
        .unwrap();
    let truth = [1.3, 0.2, -0.1];
    let (mut rng, n) = (rng(8), 4000);
    let mut regression = Regression::new(basis);
    for k in 0..n {
        let p = (0.01 * f64::from(k)).sin();
        let (a, b) = (gauss(&mut rng), gauss(&mut rng));
        let y = [1.3 * p + 0.2 + 0.1 * a, 1.3 * p - 0.1 + 0.06 * a + 0.08 * b];
        regression.push(0.0, &y, &[p]).unwrap();
    }
    let fit = Regression::fit(Diffusion::Full, 3);
    let posterior = fit.posterior(regression.sums(), &structure).unwrap();
    for (estimate, truth) in posterior.estimates.iter().zip(truth) {
        let value = estimate.value.unwrap();
        assert!((value.mean - truth).abs() < 4.0 * value.sd, "{estimate:?}");
    }
    let noise = DMatrix::from_row_slice(2, 2, &[0.01, 0.006, 0.006, 0.01]);
    assert!(
        (&posterior.diffusion - noise)
            .abs()
            .sup(&DMatrix::zeros(2, 2))
            .iter()
            .zip(&posterior.diffusion_sd())
            .all(|(e, sd)| *e < 4.0 * sd)
    );
    let refused = regression.push(0.0, &[1.0, f64::NAN], &[0.0]).unwrap_err();
    assert!(matches!(&refused, InferenceError::NonFinite { what, .. } if what == "output 1"), "{refused}");
}

/// The evidence of one Gaussian step is a Gaussian density: x₁ = x₀ + h c + √(hD) ξ with c of mean m and variance s².
#[test]
fn the_evidence_of_one_step_is_a_density_in_closed_form() {
    let constant = Polynomial::new(&["x"], 1, &[0], 0, true);
    let basis = Arc::new(Basis::new(1, 0).with(Rule::MidPoint, constant).unwrap());
    let (h, d, m, s) = (0.1, 0.5, 0.7, 2.0);
    let sums = sums(&basis, &[[1.0], [1.4]], h);
    let structure = Structure::same(&basis, &["x"]).unwrap();
    let prior = Prior::independent(&[m], &[s]).unwrap();
    let known = Diffusion::Known(DMatrix::from_element(1, 1, d));
    let fit = Fit { prior, ..Fit::new(known, 1) };
    let variance = h * d + h * h * s * s;
    let away: f64 = 0.4 - h * m;
    let expected = -0.5 * ((std::f64::consts::TAU * variance).ln() + away * away / variance);
    let found = fit.log_evidence(&sums, &structure).unwrap().unwrap();
    assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    let flat = Fit { prior: Prior::flat(1), ..fit };
    assert_eq!(flat.log_evidence(&sums, &structure).unwrap(), None);
}

#[test]
fn the_evidence_prefers_the_terms_that_are_there() {
    let (basis, h) = (lorenz::basis(), 0.005);
    let noise = lorenz::diffusion();
    let sums = sums(&basis, &lorenz::weak(3, 20_000, h, &noise), h);
    let evidence = |structure: &Structure| {
        let p = structure.n_coefficient();
        let prior = Prior::independent(&vec![0.0; p], &vec![30.0; p]).unwrap();
        let fit = Fit { prior, ..Fit::new(Diffusion::Known(noise.clone()), p) };
        fit.log_evidence(&sums, structure).unwrap().unwrap()
    };
    let all = evidence(&Structure::same(&basis, &lorenz::NAMES).unwrap());
    let right = evidence(&lorenz::seven(&basis));
    let short = evidence(&lorenz::seven(&basis).without(&["x2:x2"]));
    // Twenty terms that are not there cost some nats each; the linear term of x2 is many sd from zero.
    assert!(right > all + 60.0 && right > short + 20.0, "{right} {all} {short}");
}
