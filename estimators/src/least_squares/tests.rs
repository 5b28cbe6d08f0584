//! Small problems with known solutions.

mod of_step;

use nalgebra::DMatrix;

use super::*;

/// y = a exp(-b t), observed without noise at a = 2, b = 0.7.
fn residual(z: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(20, |i, _| {
        let t = 0.2 * i as f64;
        (2.0 * (-0.7 * t).exp() - z[0] * (-z[1] * t).exp()) / 0.01
    })
}

fn jacobian(z: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(20, 2, |i, j| {
        let t = 0.2 * i as f64;
        let e = (-z[1] * t).exp() / 0.01;
        if j == 0 { e } else { -z[0] * t * e }
    })
}

fn flat(p: usize) -> Scaled {
    let bounds = vec![[f64::NEG_INFINITY, f64::INFINITY]; p];
    let none = DVector::zeros(p);
    Scaled { mean: none.clone(), precision: none.clone(), bounds, growth: none }
}

fn drive(fit: &mut LeastSquares) -> (End, usize, usize) {
    let (mut runs, mut jacobians) = (0, 0);
    loop {
        match fit.need().clone() {
            Need::Residual(z) => {
                runs += 1;
                fit.give_residual(Some(residual(&z)));
            }
            Need::Jacobian(z) => {
                jacobians += 1;
                fit.give_jacobian(Some(jacobian(&z).into()));
            }
            Need::Nothing(end) => return (end, runs, jacobians),
        }
    }
}

#[test]
fn an_exponential_is_found_with_few_jacobians() {
    let mut fit = LeastSquares::new(DVector::from_vec(vec![1.0, 0.2]), flat(2), 1e-6, 50);
    let (end, runs, jacobians) = drive(&mut fit);
    assert_eq!(end, End::Converged);
    // The secant ends within 1e-3 noise sd of the truth, so both parameters are right to about 1e-5.
    assert!(
        (fit.best().0[0] - 2.0).abs() < 1e-4 && (fit.best().0[1] - 0.7).abs() < 1e-4,
        "{:?}",
        fit.best().0
    );
    assert!(jacobians <= 4 && runs <= 20, "{runs} runs, {jacobians} Jacobians");
}

#[test]
fn a_bound_holds_and_the_fit_ends_there() {
    let mut prior = flat(2);
    prior.bounds[1] = [0.0, 0.5];
    let mut fit = LeastSquares::new(DVector::from_vec(vec![1.0, 0.2]), prior, 1e-6, 50);
    assert_eq!(drive(&mut fit).0, End::Converged);
    assert!((fit.best().0[1] - 0.5).abs() < 1e-12, "{:?}", fit.best().0);
}

#[test]
fn a_failed_run_is_a_rejected_step() {
    let mut fit = LeastSquares::new(DVector::from_vec(vec![1.0, 0.2]), flat(2), 1e-6, 50);
    fit.give_residual(Some(residual(&DVector::from_vec(vec![1.0, 0.2]))));
    fit.give_jacobian(Some(jacobian(&DVector::from_vec(vec![1.0, 0.2])).into()));
    fit.give_residual(None);
    assert_eq!(drive(&mut fit).0, End::Converged);
}

#[test]
fn a_known_start_costs_one_run_per_step_and_no_jacobian() {
    let z = DVector::from_vec(vec![1.9, 0.65]);
    let mut fit = LeastSquares::from_known(z.clone(), residual(&z), jacobian(&z).into(), flat(2), 0.1, 20);
    let (end, runs, jacobians) = drive(&mut fit);
    assert_eq!((end, jacobians), (End::Tentative, 0));
    assert!(runs <= 6 && fit.cost() < 1.0, "{runs} runs, cost {}", fit.cost());
    fit.polish(10);
    assert_eq!(drive(&mut fit).0, End::Converged);
}

#[test]
fn how_far_a_secant_was_trusted_is_forgotten_where_a_jacobian_is_measured() {
    let z = DVector::from_vec(vec![1.0, 0.3]);
    // Both columns zero but for the first of the amplitude: next to nothing is known.
    let mut known = DMatrix::zeros(20, 2);
    known[(0, 0)] = 100.0;
    let mut fit = LeastSquares::from_known(z.clone(), residual(&z), known.into(), flat(2), 0.3, 20);
    assert_eq!(drive(&mut fit).0, End::Tentative);
    // As after many steps that brought less than they promised.
    fit.radius = 1e-6;
    fit.polish(20);
    assert_eq!(drive(&mut fit).0, End::Converged);
    // The residual vanishes at (2, 0.7).
    assert!(
        (fit.best().0[0] - 2.0).abs() < 1e-2 && (fit.best().0[1] - 0.7).abs() < 1e-2,
        "{:?}",
        fit.best().0
    );
}

#[test]
fn a_parameter_whose_influence_is_not_known_stays_until_it_is_measured() {
    // At amplitude zero the rate moves nothing, and its prior lies far from it.
    let z = DVector::from_vec(vec![0.0, 0.9]);
    let prior = || Scaled {
        mean: DVector::from_vec(vec![0.0, 5.0]),
        precision: DVector::from_vec(vec![0.0, 1.0]),
        ..flat(2)
    };
    let mut fit = LeastSquares::from_known(z.clone(), residual(&z), jacobian(&z).into(), prior(), 0.1, 20);
    let end = loop {
        match fit.need().clone() {
            Need::Residual(z) => {
                assert_eq!(z[1].to_bits(), 0.9_f64.to_bits(), "moved without a reason");
                fit.give_residual(Some(residual(&z)));
            }
            Need::Jacobian(_) => panic!("no Jacobian is asked for"),
            Need::Nothing(end) => break end,
        }
    };
    assert_eq!(end, End::Tentative);
    assert!(fit.best().0[0] > 1.0, "{:?}", fit.best().0);
    fit.polish(20);
    assert_eq!(drive(&mut fit).0, End::Converged);
    // The data hold the rate to about 1e-2, a hundredth of the prior's sd: the pull of 4.3 moves it by 4e-4 or so.
    assert!((fit.best().0[1] - 0.7).abs() < 5e-3, "{:?}", fit.best().0);
    // Where the amplitude stays zero, the rate goes to its prior mean in the end.
    let mut held = prior();
    held.bounds[0] = [0.0, 0.0];
    let mut fit = LeastSquares::new(z, held, 1e-6, 20);
    assert_eq!(drive(&mut fit).0, End::Converged);
    assert!((fit.best().0[1] - 5.0).abs() < 1e-6, "{:?}", fit.best().0);
}

#[test]
fn steps_that_overshoot_are_shortened_until_one_helps() {
    // Gauss-Newton diverges on the arctangent from here, and the secant across it overshoots too.
    let mut fit = LeastSquares::new(DVector::from_element(1, 0.5), flat(1), 1e-9, 50);
    let end = loop {
        match fit.need().clone() {
            Need::Residual(z) => fit.give_residual(Some(z.map(|z| -100.0 * (20.0 * z).atan()))),
            Need::Jacobian(z) => {
                let slope = 2000.0 / (1.0 + (20.0 * z[0]).powi(2));
                fit.give_jacobian(Some(DMatrix::from_element(1, 1, slope).into()));
            }
            Need::Nothing(end) => break end,
        }
    };
    assert_eq!(end, End::Converged, "at {}, cost {}", fit.best().0[0], fit.cost());
    // A cost of 1e-9 at a slope of 2000 per unit is 2e-8.
    assert!(fit.best().0[0].abs() < 1e-7, "{}", fit.best().0[0]);
}

#[test]
fn a_prior_pulls_as_its_precision_says() {
    // One datum at 1 with noise 1, prior 0 with sd 1: the mode is 1/2.
    let prior = Scaled { precision: DVector::from_element(1, 1.0), ..flat(1) };
    let mut fit = LeastSquares::new(DVector::zeros(1), prior, 1e-12, 20);
    loop {
        match fit.need().clone() {
            Need::Residual(z) => fit.give_residual(Some(DVector::from_element(1, 1.0 - z[0]))),
            Need::Jacobian(_) => fit.give_jacobian(Some(DMatrix::from_element(1, 1, 1.0).into())),
            Need::Nothing(_) => break,
        }
    }
    assert!((fit.best().0[0] - 0.5).abs() < 1e-9);
}

#[test]
fn residuals_far_above_the_stated_noise_do_not_keep_a_fit_from_converging() {
    // A misfit of ±0.1 that no parameter mends beside a noise stated as 1e-10, and derivatives right to five digits: where the fit ends,
    // they promise a fall of 1e-10 of a cost of 2e19.
    let misfit = |i: usize| if i.is_multiple_of(2) { 10.0 } else { -10.0 };
    let mut fit = LeastSquares::new(DVector::from_vec(vec![1.0, 0.2]), flat(2), 0.02, 50);
    let end = loop {
        match fit.need().clone() {
            Need::Residual(z) => {
                let all = residual(&z).map_with_location(|i, _, v| 1e8 * (v + misfit(i)));
                fit.give_residual(Some(all));
            }
            Need::Jacobian(z) => {
                let off = |i: usize, j: usize| 1.0 + 1e-5 * ((i + 3 * j) as f64).sin();
                let all = jacobian(&z).map_with_location(|i, j, v| 1e8 * v * off(i, j));
                fit.give_jacobian(Some(all.into()));
            }
            Need::Nothing(end) => break end,
        }
    };
    assert_eq!(end, End::Converged, "after {} trials at {:?}", 50 - fit.trials_left(), fit.best().0);
    // The alternation is nearly orthogonal to decays: it moves them by a few hundredths.
    assert!((fit.best().0[0] - 2.0).abs() < 0.1 && (fit.best().0[1] - 0.7).abs() < 0.1, "{:?}", fit.best().0);
}

#[test]
fn a_step_that_the_secant_misjudged_leaves_the_region_of_trust_as_it_was() {
    let mut fit = LeastSquares::new(DVector::from_vec(vec![1.0, 0.2]), flat(2), 1e-6, 50);
    loop {
        match fit.need().clone() {
            Need::Residual(_) if fit.cost.is_finite() && fit.measured.is_none() => break,
            Need::Residual(z) => fit.give_residual(Some(residual(&z))),
            Need::Jacobian(z) => fit.give_jacobian(Some(jacobian(&z).into())),
            Need::Nothing(end) => panic!("{end:?} before a step by the secant"),
        }
    }
    fit.radius = 0.3;
    fit.give_residual(None);
    assert!(matches!(fit.need(), Need::Jacobian(_)), "{:?}", fit.need());
    assert_eq!(fit.radius.to_bits(), 0.3_f64.to_bits());
}

/// Of two parameters nearly only the sum shows: they lie in a valley whose curvature is a millionth of that across it, and which
/// bends.
#[test]
fn a_bent_valley_is_followed_to_its_end() {
    let at = |z: &DVector<f64>, i: usize| {
        let across = 1e3 * (z[0] + z[1] - 0.02 * (z[0] - z[1]).powi(2));
        if i == 0 { across } else { (z[0] - z[1]) - 8.0 }
    };
    let slope = |z: &DVector<f64>, i: usize, j: usize| {
        let sign = if j == 0 { 1.0 } else { -1.0 };
        if i == 0 { 1e3 * (1.0 - 0.04 * sign * (z[0] - z[1])) } else { sign }
    };
    let mut fit = LeastSquares::new(DVector::from_vec(vec![-4.0, 4.0]), flat(2), 1e-6, 200);
    let end = loop {
        match fit.need().clone() {
            Need::Residual(z) => fit.give_residual(Some(DVector::from_fn(2, |i, _| -at(&z, i)))),
            Need::Jacobian(z) => {
                fit.give_jacobian(Some(DMatrix::from_fn(2, 2, |i, j| slope(&z, i, j)).into()));
            }
            Need::Nothing(end) => break end,
        }
    };
    assert_eq!(end, End::Converged, "cost {} at {:?}", fit.cost(), fit.best().0);
    // The residual vanishes at a difference of 8 and a sum of 1.28; the tolerance of the cost is 1e-6 of one.
    let [a, b] = [fit.best().0[0], fit.best().0[1]];
    assert!((a - b - 8.0).abs() < 2e-3 && (a + b - 1.28).abs() < 2e-3, "{a} {b}");
}

#[test]
fn what_is_held_stays_near_zero_or_where_it_stood_if_that_was_further() {
    let fitted = |start: [f64; 2], within: Option<f64>| {
        let mut fit = LeastSquares::new(DVector::from_row_slice(&start), flat(2), 1e-6, 100);
        if let Some(within) = within {
            fit.hold(1, within);
        }
        drive(&mut fit);
        fit.best().0.clone()
    };
    assert!((fitted([1.0, 0.5], None)[0] - 2.0).abs() < 1e-3);
    assert!((fitted([1.0, 0.5], Some(3.0))[0] - 2.0).abs() < 1e-3, "far enough");
    let held = fitted([1.0, 0.5], Some(1.5));
    assert!(held[0] <= 1.5 && held[0] > 1.49, "{held}");
    let further = fitted([1.8, 0.5], Some(1.5));
    assert!(further[0] <= 1.8 && further[0] > 1.79, "no further than it stood: {further}");
}
