//! What is refused, and in which words; never a NaN.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use starlings_estimators::inference::{
    Basis, Detector, Diffusion, Fit, Following, Function, InferenceError, Memory, Polynomial, Prior,
    Regression, Rule, Stream, Structure, Sums, Window, compare, noise_checks, reduce,
};

use crate::kit::sde::{gauss, rng};
use crate::kit::{lorenz, sums};

fn said(result: Result<impl std::fmt::Debug, InferenceError>) -> String {
    result.unwrap_err().to_string()
}

fn walk(n: usize) -> Vec<[f64; 2]> {
    let mut rng = rng(1);
    let mut x = [0.3, -0.2];
    (0..=n)
        .map(|_| {
            x = [0.9 * x[0] + 0.1 * gauss(&mut rng), 0.8 * x[1] + 0.1 * gauss(&mut rng)];
            x
        })
        .collect()
}

fn plane(functions: impl starlings_estimators::inference::Functions + 'static) -> Arc<Basis> {
    Arc::new(Basis::new(2, 0).with(Rule::MidPoint, functions).unwrap())
}

fn quadratic() -> Polynomial {
    Polynomial::new(&["x", "y"], 2, &[0, 1], 2, true)
}

fn same(basis: &Basis) -> Structure {
    Structure::same(basis, &["x", "y"]).unwrap()
}

fn infer(basis: &Arc<Basis>, sums: &Sums, diffusion: Diffusion) -> Result<(), InferenceError> {
    let structure = same(basis);
    Fit::new(diffusion, structure.n_coefficient()).posterior(sums, &structure).map(|_| ())
}

#[test]
fn rows_that_are_not_a_uniform_recording_are_refused() {
    let mut stream = Stream::new(lorenz::basis(), 0.1).unwrap();
    stream.push(0.0, &[1.0; 3]).unwrap();
    assert_eq!(said(stream.push(0.1, &[1.0; 2])), "values of a row: expected 3, got 2");
    assert_eq!(said(stream.push(0.1, &[1.0, f64::NAN, 1.0])), "channel 1 is NaN at row 1");
    assert_eq!(said(stream.push(f64::INFINITY, &[1.0; 3])), "time is inf at row 1");
    assert_eq!(said(stream.push(0.0, &[1.0; 3])), "time 0 of row 1 is not later than 0 of the row before");
    assert_eq!(
        said(stream.push(0.3, &[1.0; 3])),
        "time jumps from 0 to 0.3 at row 1, over more than one step of 0.1: break the recording there"
    );
    assert_eq!(
        said(stream.push(0.103, &[1.0; 3])),
        "the step to row 1 is 0.103 where the recording's is 0.1: resample it to equal steps"
    );
    // Each step within a hundredth, all of them too long.
    let slow = (1..10).map(|n| stream.push(0.1008 * f64::from(n), &[1.0; 3])).find(Result::is_err);
    assert!(matches!(slow, Some(Err(InferenceError::NonUniform { row: 2, .. }))), "{slow:?}");
    assert_eq!(stream.n_row(), 2, "what was refused was not taken");
    assert_eq!(
        said(Stream::new(lorenz::basis(), 0.0)),
        "the sampling step is 0: it must be positive and finite"
    );
}

#[test]
fn a_function_without_a_finite_value_is_named_with_its_row() {
    let basis = plane(Function::of_inputs("log(x)", |_, x| x[0].ln()));
    let mut stream = Stream::new(basis, 0.1).unwrap();
    for (n, row) in [[1.0, 0.0], [2.0, 0.0], [-3.0, 0.0], [4.0, 0.0]].iter().enumerate() {
        stream.push(0.1 * n as f64, row).unwrap();
    }
    assert_eq!(said(stream.take()), "log(x) is NaN at row 1");
}

#[test]
fn too_few_steps_are_told_with_the_equation() {
    let basis = plane(quadratic());
    let few = sums(&basis, &walk(6), 0.1);
    assert_eq!(
        said(infer(&basis, &few, Diffusion::Full)),
        "6 steps do not determine the 6 unknowns of x and their noise"
    );
    // The share of the noise in the coefficients then adds more to the residuals than it explains.
    let refused = infer(&basis, &sums(&basis, &walk(9), 0.1), Diffusion::Full).unwrap_err();
    assert!(matches!(refused, InferenceError::NotSettled { .. }), "{refused}");
    infer(&basis, &sums(&basis, &walk(100), 0.1), Diffusion::Full).unwrap();
    let none = Sums::new(&basis, 0.1);
    assert!(matches!(infer(&basis, &none, Diffusion::Full), Err(InferenceError::TooFew { n_step: 0, .. })));
    let given = Diffusion::Known(DMatrix::identity(2, 2));
    assert_eq!(infer(&basis, &none, given), Err(InferenceError::NothingObserved));
}

#[test]
fn terms_that_cannot_be_told_apart_are_named() {
    let doubled = Function::new("2x", |_, x| 2.0 * x[0], |_, _, slopes| slopes[0] = 2.0);
    let basis = Basis::new(2, 0).with(Rule::MidPoint, quadratic()).unwrap();
    let basis = Arc::new(basis.with(Rule::MidPoint, doubled).unwrap());
    let refused = infer(&basis, &sums(&basis, &walk(500), 0.1), Diffusion::Diagonal).unwrap_err();
    let InferenceError::Collinear { mut columns } = refused else { panic!("{refused}") };
    columns.sort();
    assert!(columns == ["x:2x", "x:x"] || columns == ["y:2x", "y:x"], "{columns:?}");
}

#[test]
fn an_equation_without_noise_or_with_that_of_another_is_named() {
    let basis = plane(quadratic());
    let exact: Vec<[f64; 2]> = walk(300).iter().enumerate().map(|(n, x)| [x[0], 0.02 * n as f64]).collect();
    assert_eq!(
        said(infer(&basis, &sums(&basis, &exact, 0.1), Diffusion::Diagonal)),
        "the noise of y has no positive definite covariance: an equation without noise of its own is a known input"
    );
    let mut rng = rng(3);
    let (mut x, mut y) = (0.0, 0.5);
    let shared: Vec<[f64; 2]> = (0..300)
        .map(|_| {
            let kick = 0.1 * gauss(&mut rng);
            (x, y) = (0.9 * x + kick, 0.7 * y + 0.2 + 2.0 * kick);
            [x, y]
        })
        .collect();
    let linear = plane(Polynomial::new(&["x", "y"], 2, &[0, 1], 1, true));
    // At the left point the map above is exactly linear, so both residuals are the same kick.
    let left = Arc::new(
        Basis::new(2, 0).with(Rule::LeftPoint, Polynomial::new(&["x", "y"], 2, &[0, 1], 1, true)).unwrap(),
    );
    let refused = infer(&left, &sums(&left, &shared, 0.1), Diffusion::Full).unwrap_err();
    assert_eq!(refused, InferenceError::DiffusionNotDefinite { equations: vec!["x".into(), "y".into()] });
    infer(&linear, &sums(&linear, &walk(300), 0.1), Diffusion::Full).unwrap();
}

#[test]
fn names_shapes_priors_and_noise_that_do_not_fit_are_refused() {
    let basis = plane(quadratic());
    let repeated =
        Basis::new(2, 0).with(Rule::MidPoint, quadratic()).unwrap().with(Rule::MidPoint, quadratic());
    assert_eq!(said(repeated), "the name 1 is there twice");
    assert_eq!(said(same(&basis).with("x:x", &[("x", "x", 1.0)])), "the name x:x is there twice");
    assert_eq!(said(same(&basis).with("more", &[("x", "z", 1.0)])), "there is no function z");
    assert_eq!(said(same(&basis).known("z", "x", 1.0)), "there is no equation z");
    assert_eq!(said(Structure::same(&basis, &["x"])), "equations: expected 2, got 1");
    assert!(matches!(Prior::independent(&[0.0], &[-1.0]), Err(InferenceError::NotPositive { .. })));
    let crooked = DMatrix::from_row_slice(2, 2, &[1.0, 0.5, 0.0, 1.0]);
    assert!(matches!(
        Prior::with_precision(nalgebra::DVector::zeros(2), crooked.clone()),
        Err(InferenceError::NotDefinite { .. })
    ));
    let walked = sums(&basis, &walk(100), 0.1);
    assert_eq!(
        infer(&basis, &walked, Diffusion::Known(crooked)),
        Err(InferenceError::NotDefinite { what: "the diffusion" })
    );
    let refused = Fit::new(Diffusion::Full, 3).posterior(&walked, &same(&basis)).unwrap_err();
    assert_eq!(refused, InferenceError::Shape { what: "coefficients of the prior", expected: 12, got: 3 });
}

#[test]
fn windows_detectors_regressions_and_reduced_models_that_do_not_fit_are_refused() {
    let basis = plane(quadratic());
    let mut window = Window::new(Memory::Sliding(3));
    window.push(sums(&basis, &walk(20), 0.1)).unwrap();
    let coarse = sums(&basis, &walk(20), 0.2);
    assert_eq!(window.push(coarse), Err(InferenceError::Incompatible { what: "their step" }));
    assert_eq!(window.n_block(), 1, "what was refused was not taken");
    let following = Following {
        block: 1,
        recent: 1,
        reference: Memory::Growing,
        least: 10,
        longer: false,
        rate: 0.0,
        watched: vec![],
    };
    let fit = Fit::new(Diffusion::Full, 12);
    let refused = Detector::new(Arc::clone(&basis), 0.1, same(&basis), fit.clone(), following);
    assert_eq!(said(refused), "the rate of false alarms is 0: it must be positive and finite");
    let mut regression = Regression::new(Arc::clone(&basis));
    assert_eq!(said(regression.push(0.0, &[1.0], &[])), "outputs and states of a sample: expected 2, got 1");
    let posterior = fit.posterior(&sums(&basis, &walk(500), 0.1), &same(&basis)).unwrap();
    let start = DVector::from_element(13, 1.0);
    let refused = reduce(&posterior, &start, |_| DVector::zeros(12));
    assert!(matches!(refused, Err(InferenceError::TooFew { n_step: 12, n_unknown: 13, .. })));
    let start = DVector::from_element(2, 1.0);
    assert!(matches!(reduce(&posterior, &start, |_| DVector::zeros(3)), Err(InferenceError::Shape { .. })));
    let lost = reduce(&posterior, &start, |_| DVector::from_element(12, f64::NAN));
    assert_eq!(said(lost), "the reduced model at its start is not finite");
    let idle = reduce(&posterior, &start, |theta| DVector::from_element(12, theta[0]));
    assert!(
        matches!(idle, Err(InferenceError::Collinear { .. } | InferenceError::Overflow { .. })),
        "{idle:?}"
    );
}

/// Rows of zeros, constants, huge, tiny and equal values.
fn nasty() -> impl Strategy<Value = Vec<[f64; 2]>> {
    let value = prop_oneof![
        4 => -1.0_f64..1.0,
        1 => Just(0.0),
        1 => Just(1.0),
        1 => Just(1e-200),
        1 => Just(1e150),
        1 => Just(-3e80),
    ];
    proptest::collection::vec([value.clone(), value], 2..40)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn every_figure_is_finite_or_refused(rows in nasty(), degree in 0_u32..3, form in 0_usize..3) {
        let basis = plane(Polynomial::new(&["x", "y"], 2, &[0, 1], degree, true));
        let mut stream = Stream::new(Arc::clone(&basis), 0.1).unwrap();
        let times = crate::kit::times(rows.len(), 0.1);
        prop_assume!(stream.extend(&times, rows.as_flattened()).is_ok());
        let Ok(sums) = stream.take() else { return Ok(()) };
        let structure = same(&basis);
        let form = [Diffusion::Full, Diffusion::Diagonal, Diffusion::Isotropic][form].clone();
        for lag_corrected in [false, true] {
            let fit = Fit { lag_corrected, ..Fit::new(form.clone(), structure.n_coefficient()) };
            let Ok(posterior) = fit.posterior(&sums, &structure) else { continue };
            let values = posterior.estimates.iter().filter_map(|e| e.value).flat_map(|v| [v.mean, v.sd]);
            prop_assert!(values.chain(posterior.diffusion.iter().copied()).all(f64::is_finite));
            prop_assert!(posterior.diffusion_sd().iter().all(|sd| *sd > 0.0 || sd.is_finite()));
            for check in noise_checks(&sums, &structure, &posterior).into_iter().flatten() {
                prop_assert!(check.ratio.is_finite() && check.sd.is_finite());
            }
            if let Ok(change) = compare(&posterior, &sums, &structure, &[]) {
                prop_assert!(change.statistic.is_finite() && (0.0..=1.0).contains(&change.probability));
            }
        }
    }
}
