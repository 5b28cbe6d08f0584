//! Noise that is not constant: it is told, and no other fault is told as that.

use std::sync::Arc;

use starlings_estimators::inference::{
    Basis, Diffusion, Fit, Polynomial, Rule, Structure, With, lag_spread, noise_checks, varying,
};

use crate::kit::noise::{H, RATE, asked, line, pairs, path, polynomial};
use crate::kit::sde::{gauss, record, rng};
use crate::kit::{lorenz, motor, sd, sums, tanks};

#[test]
fn constant_noise_is_told_to_vary_as_rarely_as_stated() {
    let (basis, structure) = line();
    for n in [150, 2000] {
        let chance = |seed: u64| {
            let rows = path(seed, n, |_, x| -x, |_, _| 0.5);
            let found = asked(&basis, &structure, &rows, H);
            let all = varying(&pairs(&rows, H), &basis, found.constant.drift(), H, 2.0).unwrap();
            all.first().map_or(1.0, |of| of.by_chance)
        };
        let chances: Vec<f64> = (0..1000).map(chance).collect();
        let below = |p: f64| chances.iter().filter(|chance| **chance < p).count();
        println!("{n} steps: {} of 1000 at a tenth, {} at a thousandth", below(0.1), below(RATE));
        // One in ten less what Bonferroni gives away; sd of 9.
        assert!((55..130).contains(&below(0.1)), "{}", below(0.1));
        assert!(below(RATE) <= 4);
    }
}

#[test]
fn noise_that_varies_is_told_with_where_and_by_how_much_whatever_the_units() {
    let (basis, structure) = line();
    let told = |rows: &[[f64; 1]]| asked(&basis, &structure, rows, H).told;
    let rows = path(1, 5000, |_, x| -x, |_, x| 0.3 + 0.7 * x.abs());
    let found = told(&rows);
    let [from, to] = found[0].at;
    assert_eq!((found[0].equation, found[0].with), (0, With::Channel(0)));
    assert!(from.abs() < 0.1 && to.abs() > 0.4, "{found:?}");
    // Sizes at the middle of a tenth of the rows.
    let truth = (0.3 + 0.7 * to.abs()) / 0.3;
    assert!((found[0].ratio / truth - 1.0).abs() < 0.3, "{found:?}");
    let large: Vec<[f64; 1]> = rows.iter().map(|[x]| [1e6 * x + 1e8]).collect();
    let other = told(&large);
    assert!((other[0].ratio / found[0].ratio - 1.0).abs() < 1e-3, "{other:?}");
    // From row to row one part in thirty more, which no interval minds.
    let harmless = path(2, 200_000, |_, x| -x, |_, x| 0.5 * (1.0 + 0.02 * x.tanh()));
    assert_eq!(told(&harmless), []);
    let course = told(&path(3, 5000, |_, x| -x, |t, _| 0.3 + 0.005 * t));
    assert_eq!(course[0].with, With::Course);
    assert!(course[0].at[0] < 0.2 && course[0].at[1] > 0.8, "{course:?}");
    assert_eq!(told(&rows[..100]), [], "too few steps to say");
}

#[test]
fn where_there_is_no_noise_or_an_input_is_rarely_on_both_ends_are_told() {
    let basis =
        Arc::new(Basis::new(1, 1).with(Rule::MidPoint, Polynomial::new(&["x"], 1, &[0], 1, false)).unwrap());
    let structure = Structure::same(&basis, &["x"]).unwrap();
    let told = |size: [f64; 2], on: &dyn Fn(usize) -> bool| {
        let rows = path(4, 10_000, |_, x| -x, |t, _| size[usize::from(on((t / H) as usize))]);
        let on = |k| if on(k) { 1.0 } else { 0.0 };
        let rows: Vec<[f64; 2]> = rows.iter().enumerate().map(|(k, [x])| [*x, on(k)]).collect();
        asked(&basis, &structure, &rows, H).told.remove(0)
    };
    let rare = told([0.4, 1.2], &|k| k % 500 < 20);
    assert_eq!((rare.with, rare.at), (With::Channel(1), [0.0, 1.0]), "{rare:?}");
    assert!((2.2..3.5).contains(&rare.ratio), "{rare:?}");
    // A machine that is switched off.
    let on = path(5, 5000, |_, x| -x, |_, _| 0.5);
    let rows: Vec<[f64; 1]> = on.into_iter().chain(vec![[0.0]; 5000]).collect();
    let (basis, structure) = line();
    let off = asked(&basis, &structure, &rows, H).told;
    assert!(off[0].ratio.is_infinite(), "{off:?}");
}

#[test]
fn the_state_that_the_noise_of_another_depends_on_is_named() {
    let mut draw = rng(7);
    let rows = record(20_000, (H, 5), [0.0, 1.0], |_, h, [x, z]| {
        let mut noise = || h.sqrt() * gauss(&mut draw);
        [x - h * (x - 0.5 * z) + 0.4 * (0.5 * z).exp() * noise(), z - h * z + 0.5 * noise()]
    });
    let linear = Polynomial::new(&["x", "z"], 2, &[0, 1], 1, false);
    let basis = Arc::new(Basis::new(2, 0).with(Rule::MidPoint, linear).unwrap());
    let found = asked(&basis, &Structure::same(&basis, &["x", "z"]).unwrap(), &rows, H).told;
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].equation, found[0].with), (0, With::Channel(1)));
    assert!(found[0].at[0] < found[0].at[1], "{found:?}");
}

#[test]
fn other_faults_of_a_recording_are_not_told_as_noise_that_varies() {
    let (basis, structure) = line();
    let told = |rows: &[[f64; 1]]| asked(&basis, &structure, rows, H).told;
    for seed in 0..5 {
        let well = path(seed, 20_000, |_, x| 2.0 * (x - x.powi(3)), |_, _| 0.6);
        assert_eq!(told(&well), [], "a drift that lacks its cubic term");
        let moved = |t: f64, x: f64| if t < 200.0 { -x } else { -4.0 * (x - 2.0) };
        assert_eq!(told(&path(seed, 20_000, moved, |_, _| 0.6)), [], "coefficients that change");
        let mut draw = rng(900 + seed);
        let measured: Vec<[f64; 1]> = well.iter().map(|[x]| [x + 0.05 * gauss(&mut draw)]).collect();
        assert_eq!(told(&measured), [], "errors of the measurement");
        for h in [0.002, 0.02] {
            let basis = lorenz::basis();
            let rows = lorenz::weak(seed, 20_000, h, &lorenz::diffusion());
            let structure = Structure::same(&basis, &lorenz::NAMES).unwrap();
            assert_eq!(asked(&basis, &structure, &rows, h).told, [], "Lorenz in steps of {h}");
        }
        let basis = tanks::basis();
        assert_eq!(asked(&basis, &tanks::joint(&basis), &tanks::recording(seed), 0.002).told, [], "tanks");
        let basis = motor::basis();
        let rows = motor::recording(seed, 500, 1.0, |t| if t < 0.25 { 1.0 } else { 0.7 });
        assert_eq!(asked(&basis, &motor::throat(&basis), &rows, 0.001).told, [], "motor");
    }
}

#[test]
fn residuals_at_lag_one_are_told_to_be_known_less_well_under_noise_that_varies() {
    let basis = polynomial(1, false);
    let structure = Structure::same(&basis, &["x"]).unwrap();
    let fit = Fit::new(Diffusion::Diagonal, 1);
    // Ratios over their sampling error, as it is for constant noise and as it is for any.
    let ratios = |size: &dyn Fn(f64) -> f64| {
        let one = |seed: u64| {
            let rows = path(700 + seed, 2000, |_, x| -x, |_, x| size(x));
            let sums = sums(&basis, &rows, H);
            let posterior = fit.posterior(&sums, &structure).unwrap();
            let check = noise_checks(&sums, &structure, &posterior).unwrap().remove(0);
            let spread = lag_spread(&pairs(&rows, H), &basis, posterior.drift(), H).unwrap()[0];
            let wider = check.clone().widened(spread);
            [check.ratio / check.sd, wider.ratio / wider.sd]
        };
        let all: Vec<[f64; 2]> = (0..200).map(one).collect();
        [0, 1].map(|k| sd(&all.iter().map(|of| of[k]).collect::<Vec<_>>()))
    };
    let (constant, varying) = (ratios(&|_| 0.5), ratios(&|x| 0.3 + 0.7 * x.abs()));
    println!("sd of ratios over their error: {constant:.2?} and {varying:.2?}");
    // Five of a hundred are the sd of each.
    assert!(constant.iter().all(|of| (0.85..1.15).contains(of)), "{constant:?}");
    assert!(varying[0] > 1.3 && (0.85..1.2).contains(&varying[1]), "{varying:?}");
}
