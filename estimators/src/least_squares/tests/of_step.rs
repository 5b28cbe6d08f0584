//! The step: quantities that grow exponentially, and bounds.

use super::*;

/// A quantity exp(z₀) and an amplitude z₁ of which nearly only the sum shows; they end at 0.2 and 0.8.
fn shared(z: &DVector<f64>) -> DVector<f64> {
    DVector::from_vec(vec![-1e4 * (z[0].exp() + z[1] - 1.0), -10.0 * (z[1] - 0.8)])
}

fn runs_of_shared(growth: f64) -> (End, usize, DVector<f64>) {
    let scaled = Scaled { growth: DVector::from_vec(vec![growth, 0.0]), ..flat(2) };
    let mut fit = LeastSquares::new(DVector::from_vec(vec![0.0, 0.0]), scaled, 1e-6, 200);
    let mut runs = 0;
    loop {
        match fit.need().clone() {
            Need::Residual(z) => {
                runs += 1;
                fit.give_residual(Some(shared(&z)));
            }
            Need::Jacobian(z) => {
                runs += 2;
                let slopes = [1e4 * z[0].exp(), 1e4, 0.0, 10.0];
                fit.give_jacobian(Some(DMatrix::from_row_slice(2, 2, &slopes).into()));
            }
            Need::Nothing(end) => return (end, runs, fit.best().0.clone()),
        }
    }
}

#[test]
fn a_valley_between_what_is_proportional_is_straight_along_the_quantity_and_not_along_its_logarithm() {
    let (end, runs, z) = runs_of_shared(1.0);
    assert_eq!(end, End::Converged);
    // The tolerance of 1e-6 in the cost is 1e-4 in the amplitude, whose slope is 10.
    assert!((z[1] - 0.8).abs() < 2e-4 && (z[0].exp() - 0.2).abs() < 2e-4, "{z}");
    let (_, of_logarithm, _) = runs_of_shared(0.0);
    assert!(3 * runs < of_logarithm, "{runs} against {of_logarithm} runs");
}

#[test]
fn a_prior_far_from_what_the_data_want_of_a_growing_quantity_is_met_on_the_way() {
    // The data say c = 0 ± 0.1, the prior says that z is 0 ± 1: the cost exp(2z)/0.01 + z² is least where 100 exp(2z) = -z.
    let scaled =
        Scaled { growth: DVector::from_element(1, 1.0), precision: DVector::from_element(1, 1.0), ..flat(1) };
    let mut fit = LeastSquares::new(DVector::zeros(1), scaled, 1e-9, 100);
    let end = loop {
        match fit.need().clone() {
            Need::Residual(z) => fit.give_residual(Some(z.map(|z| -10.0 * z.exp()))),
            Need::Jacobian(z) => {
                fit.give_jacobian(Some(DMatrix::from_element(1, 1, 10.0 * z[0].exp()).into()));
            }
            Need::Nothing(end) => break end,
        }
    };
    let z = fit.best().0[0];
    assert_eq!(end, End::Converged, "at {z}");
    // The curvature of the cost is above 2 and the tolerance 1e-9.
    assert!((100.0 * (2.0 * z).exp() + z).abs() < 1e-3, "{z}");
}

#[test]
fn a_fit_begins_within_the_bounds() {
    let bounded = Scaled { bounds: vec![[0.0, 1.0], [f64::NEG_INFINITY, f64::INFINITY]], ..flat(2) };
    let fit = LeastSquares::new(DVector::from_vec(vec![3.0, -7.0]), bounded, 1e-6, 10);
    assert_eq!(fit.need(), &Need::Residual(DVector::from_vec(vec![1.0, -7.0])));
}

#[test]
fn a_quantity_that_goes_as_far_down_as_a_step_may_is_not_held_to_have_arrived() {
    // One residual of 20 c, c = exp(z), beside ten thousand of 100: in units of their mean square the tolerance is 200, and a step to a third
    // of c promises less from c = 1/3 on.
    let scaled = Scaled { growth: DVector::from_element(1, 1.0), ..flat(1) };
    let of = |z: f64| DVector::from_fn(10_001, |i, _| if i == 0 { -20.0 * z.exp() } else { 100.0 });
    let mut fit = LeastSquares::new(DVector::zeros(1), scaled, 0.02, 100);
    let end = loop {
        match fit.need().clone() {
            Need::Residual(z) => fit.give_residual(Some(of(z[0]))),
            Need::Jacobian(z) => {
                let slope = |i: usize, _| if i == 0 { 20.0 * z[0].exp() } else { 0.0 };
                fit.give_jacobian(Some(DMatrix::from_fn(10_001, 1, slope).into()));
            }
            Need::Nothing(end) => break end,
        }
    };
    assert_eq!(end, End::Converged);
    // It stops where a step promises no more than 1e-8 of the cost, which is 1.
    assert!(20.0 * fit.best().0[0].exp() < 1.1, "{}", fit.best().0);
}

#[test]
fn a_step_that_one_bound_cuts_off_still_leads_downhill() {
    // Two columns that are nearly one, whose free minimum lies at (-5, 5.2): cut off at zero, the step to it would lead uphill.
    let rows = DMatrix::from_row_slice(2, 2, &[100.0, 100.0, 1.0, -1.0]);
    let wanted = &rows * DVector::from_vec(vec![-5.0, 5.2]);
    let mut bounded = flat(2);
    bounded.bounds[0] = [0.0, f64::INFINITY];
    let mut fit = LeastSquares::new(DVector::from_vec(vec![0.1, 0.3]), bounded, 1e-9, 50);
    let end = loop {
        match fit.need().clone() {
            Need::Residual(z) => fit.give_residual(Some(&wanted - &rows * z)),
            Need::Jacobian(_) => fit.give_jacobian(Some(rows.clone().into())),
            Need::Nothing(end) => break end,
        }
    };
    assert_eq!(end, End::Converged);
    // Along the bound: (100 · 20 + (-1)(-10.2)) / (100² + 1).
    let best = 2010.2 / 10_001.0;
    assert!(fit.best().0[0].abs() < 1e-12 && (fit.best().0[1] - best).abs() < 1e-6, "{}", fit.best().0);
}

#[test]
fn what_stops_at_an_end_and_what_makes_up_for_it_are_shortened_alike() {
    // y = e^(0.4 z0) t + 0.31 z1 (t + 0.1 sin t) + 0.01 z2 (t + 0.01 sin 3t), nearly one function: e^(0.4 z0) ends at a tenth and 0.31 z1 at
    // 0.9. A step leaves a third of the first, for which the last could make up with -23 units, of which it may go three.
    let functions = |i: usize| {
        let t = 0.3 * i as f64;
        [t, t + 0.1 * t.sin(), t + 0.01 * (3.0 * t).sin()].map(|y| y / 0.001)
    };
    let residual = |z: &DVector<f64>| {
        let left = [0.1 - (0.4 * z[0]).exp(), 0.9 - 0.31 * z[1], -0.01 * z[2]];
        DVector::from_fn(30, |i, _| left.iter().zip(functions(i)).map(|(share, y)| share * y).sum())
    };
    let jacobian = |z: &DVector<f64>| {
        let slopes = [0.4 * (0.4 * z[0]).exp(), 0.31, 0.01];
        DMatrix::from_fn(30, 3, |i, j| slopes[j] * functions(i)[j])
    };
    let prior = Scaled { growth: DVector::from_vec(vec![0.4, 0.0, 0.0]), ..flat(3) };
    let mut fit = LeastSquares::new(DVector::zeros(3), prior, 1e-6, 120);
    let end = loop {
        match fit.need().clone() {
            Need::Residual(z) => fit.give_residual(Some(residual(&z))),
            Need::Jacobian(z) => fit.give_jacobian(Some(jacobian(&z).into())),
            Need::Nothing(end) => break end,
        }
    };
    let z = fit.best().0;
    assert_eq!(end, End::Converged, "{z:?}");
    // The residuals vanish there, to a cost of 1e-6 in which the last two functions differ by thousands of sd.
    assert!(fit.cost() < 1e-3 && (0.31 * z[1] - 0.9).abs() < 1e-2, "{z:?} {}", fit.cost());
}
