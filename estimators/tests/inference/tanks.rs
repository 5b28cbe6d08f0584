//! Table 1.3: three tanks whose terms come and go with the levels; couplings are shared by two equations.

use nalgebra::{DMatrix, DVector};
use starlings_estimators::inference::{Diffusion, Fit, InferenceError, Posterior, Prior, Stream};

use crate::kit::tanks::{self, COEFFICIENTS, TRUTH};
use crate::kit::{dense, mean, sd, sums, times};

const H: f64 = 0.002;

fn infer(seed: u64) -> Posterior {
    let basis = tanks::basis();
    let sums = sums(&basis, &tanks::recording(seed), H);
    Fit::new(Diffusion::Diagonal, 9).posterior(&sums, &tanks::joint(&basis)).unwrap()
}

#[test]
fn couplings_and_leaks_of_three_tanks_are_found() {
    let posteriors: Vec<Posterior> = (0..100).map(infer).collect();
    let column = |k: usize| posteriors.iter().map(|p| p.mean()[k]).collect::<Vec<f64>>();
    for (k, name) in COEFFICIENTS.iter().enumerate() {
        println!("{name} {:.4} ({:.4}), {}", mean(column(k)), sd(&column(k)), TRUTH[k]);
    }
    let off = |k: usize| (mean(column(k)) - TRUTH[k]).abs();
    assert!((3..6).all(|k| off(k) < 0.01), "c12, c13, c23");
    assert!(off(8) < 0.002, "L23");
    // L12 and L13 are almost collinear: a tenth of a second lies between their openings.
    assert!([6, 7].into_iter().all(|k| (0.15..0.26).contains(&sd(&column(k)))));
    let d11 = mean(posteriors.iter().map(|p| p.diffusion[(0, 0)]));
    assert!((d11 / 9e-4 - 1.0).abs() < 0.02, "{d11}");
}

#[test]
fn one_equation_alone_knows_a_coupling_far_worse_than_both() {
    let basis = tanks::basis();
    let sums = sums(&basis, &tanks::recording(1), H);
    let both = Fit::new(Diffusion::Diagonal, 9).posterior(&sums, &tanks::joint(&basis)).unwrap();
    let alone = tanks::joint(&basis).without(&["c12", "c13"]);
    let alone = alone.with("c12 of h1", &[("h1", "flow12", -1.0)]).unwrap();
    let alone = alone.with("c12 of h2", &[("h2", "flow12", 1.0)]).unwrap();
    let alone = alone.with("c13 of h1", &[("h1", "flow13", -1.0)]).unwrap();
    let alone = alone.with("c13 of h3", &[("h3", "flow13", 1.0)]).unwrap();
    let alone = Fit::new(Diffusion::Diagonal, 11).posterior(&sums, &alone).unwrap();
    let gain = alone.value("c12 of h1").unwrap().sd / both.value("c12").unwrap().sd;
    assert!((40.0..160.0).contains(&gain), "{gain}: about 80");
}

/// Shared coefficients, a known inflow and independent noise, against an implementation that sees every row.
#[test]
fn sums_and_rows_give_the_same_joint_posterior() {
    let basis = tanks::basis();
    let structure = tanks::joint(&basis).without(&["L12", "L13", "L23"]);
    let rows = tanks::recording(3);
    let fit = Fit::new(Diffusion::Diagonal, 6);
    let posterior = fit.posterior(&sums(&basis, &rows, H), &structure).unwrap();
    let terms = |t: f64, x: &[f64]| {
        let up = |z: f64| z.max(0.0);
        let open = |z: f64| f64::from(u8::from(z > 0.0));
        let sine = (std::f64::consts::TAU * t).sin();
        let q12 = up(x[0] - tanks::H12) - up(x[1] - tanks::H12);
        let q13 = up(x[0] - tanks::H13) - up(x[2] - tanks::H13);
        let q32 = up(x[2] - tanks::H23) - up(x[1] - tanks::H23);
        let f = DMatrix::from_row_slice(
            3,
            6,
            &[
                sine, 0.0, 0.0, -q12, -q13, 0.0, 0.0, -sine, 0.0, q12, 0.0, q32, 0.0, 0.0, sine, 0.0, q13,
                -q32,
            ],
        );
        let flow = |a: usize, b: usize, level: f64| -open(x[a] - level) - open(x[b] - level);
        let v = [0.0, 0.0, 0.0, flow(0, 1, tanks::H12), flow(0, 2, tanks::H13), flow(2, 1, tanks::H23)];
        (f, DVector::from_row_slice(&v))
    };
    let inflow = |t: f64| DVector::from_row_slice(&[tanks::inflow(t), 0.0, 0.0]);
    let rows: Vec<Vec<f64>> = rows.iter().map(|x| x.to_vec()).collect();
    let dense = dense::solve(&rows, H, &terms, &inflow, &posterior.diffusion);
    // Rounding of sums of six thousand products.
    assert!((&dense.c - posterior.mean()).amax() < 1e-10, "{}", (&dense.c - posterior.mean()).amax());
    assert!((&dense.precision - posterior.precision()).amax() < 1e-11 * dense.precision.amax());
    for l in 0..3 {
        let ratio = dense.d[(l, l)] / posterior.diffusion[(l, l)];
        // Six coefficients of six thousand steps were taken off.
        assert!((0.999..1.0).contains(&ratio), "{ratio}");
    }
}

/// Before the level reaches an opening nothing is known of what flows through it.
#[test]
fn a_term_without_information_is_not_observed_and_returns_when_it_has_some() {
    let basis = tanks::basis();
    let structure = tanks::joint(&basis);
    let rows = tanks::recording(2);
    let times = times(rows.len(), H);
    let mut stream = Stream::new(basis, H).unwrap();
    stream.extend(&times[..500], rows[..500].as_flattened()).unwrap();
    let fit = Fit::new(Diffusion::Diagonal, 9);
    let early = fit.posterior(stream.sums().unwrap(), &structure).unwrap();
    let observed = |p: &Posterior| p.estimates.iter().map(|e| e.observed).collect::<Vec<bool>>();
    assert_eq!(observed(&early), [true, true, true, false, false, false, false, false, false]);
    assert!(early.estimates[3..].iter().all(|e| e.value.is_none()));
    assert_eq!(early.may_be_zero(3, 0.9), None);
    let prior = Prior::independent(&[0.0, 0.0, 0.0, 1.5, 1.5, 1.5, 0.1, 0.1, 0.1], &[1.0; 9]).unwrap();
    let held = Fit { prior, ..fit.clone() }.posterior(stream.sums().unwrap(), &structure).unwrap();
    let c12 = &held.estimates[3];
    assert!(!c12.observed, "a prior is no observation");
    let value = c12.value.unwrap();
    assert!((value.mean - 1.5).abs() < 1e-12 && (value.sd - 1.0).abs() < 1e-12, "the prior, {value:?}");
    stream.extend(&times[500..], rows[500..].as_flattened()).unwrap();
    let late = fit.posterior(stream.sums().unwrap(), &structure).unwrap();
    assert!(observed(&late).iter().all(|o| *o));
}

/// The least information is an inverse variance: what is known worse than to 0.2 counts as not observed.
#[test]
fn a_term_below_the_least_information_is_not_observed() {
    let basis = tanks::basis();
    let (structure, rows) = (tanks::joint(&basis), tanks::recording(2));
    let opens = rows.iter().position(|x| x[0] > tanks::H12).unwrap();
    let seen = |until: usize, least_information: f64| {
        let sums = sums(&basis, &rows[..opens + until], H);
        let fit = Fit { least_information, ..Fit::new(Diffusion::Diagonal, 9) };
        fit.posterior(&sums, &structure).unwrap().estimates[3].observed
    };
    assert!(seen(5, 0.0) && !seen(5, 25.0) && seen(200, 25.0));
}

#[test]
fn nothing_observed_is_an_error_that_says_so() {
    let basis = tanks::basis();
    let rows = tanks::recording(2);
    let sums = sums(&basis, &rows[..300], H);
    let flows = starlings_estimators::inference::Structure::new(&basis, &tanks::NAMES)
        .and_then(|s| s.with("c12", &[("h1", "flow12", -1.0), ("h2", "flow12", 1.0)]))
        .unwrap();
    let refused = Fit::new(Diffusion::Diagonal, 1).posterior(&sums, &flows);
    assert_eq!(refused, Err(InferenceError::NothingObserved));
}
