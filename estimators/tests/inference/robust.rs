//! Intervals under noise that is not constant.

use std::sync::Arc;

use nalgebra::DMatrix;
use starlings_estimators::inference::{Basis, Diffusion, Fit, Function, Posterior, Rule, Structure};

use crate::kit::noise::{H, asked, line, pairs_of, path, polynomial};
use crate::kit::sums;

/// Numbers of 90 % intervals of 100 that hold the truth, by coefficient: of constant noise, and of any.
fn held(degree: u32, constant: bool, n: usize, truth: &[f64], size: impl Fn(f64) -> f64) -> Vec<[i32; 2]> {
    let basis = polynomial(degree, constant);
    let structure = Structure::same(&basis, &["x"]).unwrap();
    let drift = |x: f64| {
        let powers = (i32::from(!constant)..).zip(truth);
        powers.map(|(power, c)| c * x.powi(power)).sum::<f64>()
    };
    let mut held = vec![[0; 2]; truth.len()];
    for seed in 0..100 {
        let rows = path(500 + seed, n, |_, x| drift(x), |_, x| size(x));
        let found = asked(&basis, &structure, &rows, H);
        assert_eq!(found.told.len(), 1, "seed {seed}");
        for (k, (held, truth)) in held.iter_mut().zip(truth).enumerate() {
            for (held, of) in held.iter_mut().zip([&found.constant, &found.robust]) {
                let [lo, hi] = of.interval(k, 0.9).unwrap();
                *held += i32::from(lo <= *truth && *truth <= hi);
            }
        }
    }
    println!("degree {degree}: of 100 hold {truth:?}, constant and any: {held:?}");
    held
}

/// Three of a hundred are the sd of each.
#[test]
fn intervals_hold_where_the_noise_varies_and_those_of_constant_noise_do_not() {
    for [before, after] in held(1, false, 5000, &[-1.0], |x| 0.3 + 0.7 * x.abs()) {
        assert!(before < 75 && after >= 82, "{before} and {after}");
    }
    for [before, after] in held(1, true, 5000, &[1.0, -1.0], |x| 0.5 * x) {
        assert!(before < 82 && after >= 82, "{before} and {after}");
    }
    let cubic = held(3, true, 10_000, &[0.0, 1.0, 0.0, -1.0], |x| 0.2 + 0.6 * x.abs());
    assert!(cubic.iter().all(|[_, after]| *after >= 77), "{cubic:?}");
    assert!(cubic[1][0] < 10 && cubic[3][0] < 10, "x and x³ are off without: {cubic:?}");
}

#[test]
fn a_sample_of_a_long_recording_gives_the_intervals_that_all_of_it_does() {
    let (basis, structure) = (polynomial(3, true), |basis: &Basis| Structure::same(basis, &["x"]).unwrap());
    let structure = structure(&basis);
    let rows = path(11, 150_000, |_, x| x - x.powi(3), |_, x| 0.2 + 0.6 * x.abs());
    let found = asked(&basis, &structure, &rows, H);
    let mut whole: Option<DMatrix<f64>> = None;
    for part in rows.windows(25_001).step_by(25_000) {
        let robust = asked(&basis, &structure, part, H).robust;
        whole = Some(robust.precision() + whole.unwrap_or_else(|| DMatrix::zeros(4, 4)));
    }
    let whole = whole.unwrap().try_inverse().unwrap();
    for (k, truth) in [0.0, 1.0, 0.0, -1.0].into_iter().enumerate() {
        let of = found.robust.estimates[k].value.unwrap();
        let ratio = of.sd / whole[(k, k)].sqrt();
        // What moves is known from a ninth of the steps.
        assert!((0.75..1.5).contains(&ratio), "{k}: {ratio}");
        assert!((of.mean - truth).abs() < 3.5 * of.sd, "{k}: {of:?}");
    }
}

#[test]
fn intervals_are_the_same_however_the_recording_was_cut_into_blocks() {
    let (basis, structure) = line();
    // The first tenth, in short blocks, is three times as noisy as the rest, in long ones.
    let rows = path(13, 100_000, |_, x| -x, |t, _| if t < 200.0 { 1.5 } else { 0.5 });
    let fit = Fit::new(Diffusion::Diagonal, structure.n_coefficient());
    let constant = fit.posterior(&sums(&basis, &rows, H), &structure).unwrap();
    let of = |n_step: &dyn Fn(usize) -> usize| {
        let pairs = pairs_of(&rows, H, n_step);
        let robust = fit.robust(&constant, &pairs, (&basis, &structure), H).unwrap();
        [0, 1].map(|k| robust.estimates[k].value.unwrap().sd)
    };
    let (even, uneven) = (of(&|_| 256), of(&|from| if from < 10_000 { 100 } else { 30_000 }));
    for (even, uneven) in even.into_iter().zip(uneven) {
        // 1536 of the 6536 pairs of the second stand for nine tenths of the steps: a fortieth, and more where few of them weigh.
        assert!((uneven / even - 1.0).abs() < 0.1, "{even} {uneven}");
    }
}

#[test]
fn constant_noise_keeps_its_intervals() {
    let found = asked(&line().0, &line().1, &path(5, 20_000, |_, x| -x, |_, _| 0.5), H);
    for (constant, robust) in found.constant.estimates.iter().zip(&found.robust.estimates) {
        let [constant, robust] = [constant, robust].map(|of| of.value.unwrap());
        assert!((robust.sd / constant.sd - 1.0).abs() < 0.04, "{constant:?} {robust:?}");
        assert!((robust.mean - constant.mean).abs() < 1e-9, "a line has one slope: {constant:?} {robust:?}");
    }
}

#[test]
fn functions_at_the_left_point_are_not_moved() {
    let square = || Function::new("x^2", |_, x| x[0] * x[0], |_, x, slopes| slopes[0] = 2.0 * x[0]);
    let of = |rule| Arc::new(Basis::new(1, 0).with(rule, square()).unwrap());
    let rows = path(9, 20_000, |_, x| 1.0 - x * x, |_, x| 0.4 * x.abs());
    let one = |basis: &Arc<Basis>| {
        let structure = Structure::same(basis, &["x^2"]).unwrap();
        asked(basis, &structure, &rows, H)
    };
    let (left, mid) = (one(&of(Rule::LeftPoint)), one(&of(Rule::MidPoint)));
    let mean = |posterior: &Posterior| posterior.mean()[0];
    assert!((mean(&left.robust) - mean(&left.constant)).abs() < 1e-12);
    let (off, sd) = (mean(&mid.constant) - mean(&mid.robust), mid.robust.estimates[0].value.unwrap().sd);
    assert!(off.abs() > 0.5 * sd, "the mid-point's own is off: {off} ± {sd}");
}
