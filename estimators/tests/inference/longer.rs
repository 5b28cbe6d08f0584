//! Changes that no single block shows: found by longer stretches, each against what came before it.

use std::sync::Arc;

use starlings_estimators::inference::{
    Basis, Detector, Diffusion, Fit, Following, Function, InferenceError, Memory, Report, Rule, Stream,
    Structure,
};

use crate::kit::sde::{gauss, heun, record, rng};
use crate::kit::{median, quantile};

const H: f64 = 0.01;

/// A decay of rate 1 in steps of [`H`] under noise of D = 1, which becomes twice as fast at row `change`.
fn decay(seed: u64, n: usize, change: usize) -> Vec<[f64; 1]> {
    let mut draw = rng(seed);
    let mut x = 0.0;
    let step = |k| {
        let now = [x];
        let rate = if k < change { 1.0 } else { 2.0 };
        x += -H * rate * x + H.sqrt() * gauss(&mut draw);
        now
    };
    (0..=n).map(step).collect()
}

fn basis() -> Arc<Basis> {
    let x = Function::new("x", |_, x| x[0], |_, _, slopes| slopes[0] = 1.0);
    Arc::new(Basis::new(1, 0).with(Rule::LeftPoint, x).unwrap())
}

/// The settings that a study has by default, with this rate.
fn by_default(rate: f64) -> Following {
    Following {
        block: 100,
        recent: 1,
        reference: Memory::Growing,
        least: 1000,
        longer: true,
        rate,
        watched: vec![],
    }
}

fn detector(recent: usize, reference: Memory, rate: f64) -> Detector {
    let structure = Structure::same(&basis(), &["x"]).unwrap();
    let following =
        Following { block: 100, recent, reference, least: 5000, longer: true, rate, watched: vec![] };
    Detector::new(basis(), H, structure, Fit::new(Diffusion::Full, 1), following).unwrap()
}

/// Every report on a recording, of which alarms are accepted.
fn follow<const N: usize>(mut detector: Detector, rows: &[[f64; N]]) -> Vec<Report> {
    let mut reports = vec![];
    for (n, row) in rows.iter().enumerate() {
        if let Some(report) = detector.push(n as f64 * H, row).unwrap() {
            if report.alarm {
                detector.accept(&report).unwrap();
            }
            reports.push(report);
        }
    }
    reports
}

/// A unit of time tells the change by a quarter of a unit of χ², and the threshold is thirty.
#[test]
fn a_change_that_no_block_shows_is_an_alarm_once_and_located() {
    for (recent, reference) in [(1, Memory::Growing), (3, Memory::Growing), (1, Memory::Sliding(300))] {
        let (mut delays, mut misses) = (vec![], vec![]);
        for seed in 0..20 {
            let rows = decay(700 + seed, 100_000, 50_000);
            let reports = follow(detector(recent, reference, 1e-6), &rows);
            let alarms: Vec<&Report> = reports.iter().filter(|report| report.alarm).collect();
            assert_eq!(alarms.len(), 1, "{seed}: {alarms:?}");
            delays.push(alarms[0].time - 500.0);
            misses.push((alarms[0].since - 500.0).abs());
        }
        let (delay, miss) = (median(delays.clone()), median(misses.clone()));
        println!("{recent}, {reference:?}: {delay} after it, {miss} beside it");
        assert!(
            delays.iter().all(|delay| *delay > 0.0) && quantile(delays.clone(), 1.0) < 350.0,
            "{recent}: {delays:?}"
        );
        assert!(miss <= 16.0 && quantile(misses.clone(), 1.0) <= 64.0, "{recent}: {misses:?}");
    }
}

/// Within a block of a time unit the state hardly forgets where it was: a slope beside a constant is then no martingale's, whose score is a
/// Gaussian, and was an alarm three times as often as stated.
#[test]
fn a_constant_and_a_slope_in_blocks_as_short_as_the_memory_are_no_alarms() {
    let line = Function::new("1", |_, _| 1.0, |_, _, _| {});
    let x = Function::new("x", |_, x| x[0], |_, _, slopes| slopes[0] = 1.0);
    let basis = Basis::new(1, 0).with(Rule::MidPoint, line).unwrap().with(Rule::MidPoint, x).unwrap();
    let structure = Structure::same(&basis, &["x"]).unwrap();
    let following = by_default(0.01);
    let basis = Arc::new(basis);
    let (mut alarms, mut tests) = (0, 0);
    for seed in 0..20 {
        let fit = Fit::new(Diffusion::Full, 2);
        let detector =
            Detector::new(Arc::clone(&basis), H, structure.clone(), fit, following.clone()).unwrap();
        let reports = follow(detector, &decay(900 + seed, 10_000, usize::MAX));
        alarms += reports.iter().filter(|report| report.alarm).count();
        tests += reports.len();
    }
    println!("{alarms} alarms of {tests} blocks at one in a hundred");
    assert!(tests > 1500 && alarms * 100 <= tests, "{alarms} of {tests}");
}

/// The oscillator of van der Pol, x'' = 1.5 (1 − x²) x' − k x under noise of 0.3 in both equations, whose k is 2 and after 10 000 rows 2.6.
fn oscillator(seed: u64, n: usize) -> Vec<[f64; 2]> {
    let mut draw = rng(seed);
    let drift = |t: f64, [x, v]: &[f64; 2]| {
        let k = if t < 100.0 { 2.0 } else { 2.6 };
        [*v, 1.5 * (1.0 - x * x) * v - k * x]
    };
    let root = [[0.3, 0.0], [0.0, 0.3]];
    record(n, (H, 4), [1.0, 0.0], |t, h, x| heun(&mut draw, (t, h), x, &root, &drift))
}

/// With the settings that a study has by default.
fn watching() -> Detector {
    let damping = Function::new(
        "damping",
        |_, x| (1.0 - x[0] * x[0]) * x[1],
        |_, x, slopes| {
            slopes[0] = -2.0 * x[0] * x[1];
            slopes[1] = 1.0 - x[0] * x[0];
        },
    );
    let coordinate =
        |name: &str, at: usize| Function::new(name, move |_, x| x[at], move |_, _, slopes| slopes[at] = 1.0);
    let basis = Basis::new(2, 0).with(Rule::MidPoint, damping).unwrap();
    let basis = basis.with(Rule::MidPoint, coordinate("x", 0)).unwrap();
    let basis = Arc::new(basis.with(Rule::MidPoint, coordinate("v", 1)).unwrap());
    let structure = Structure::same(&basis, &["x", "v"]).unwrap();
    let following = by_default(1e-6);
    Detector::new(basis, H, structure, Fit::new(Diffusion::Full, 6), following).unwrap()
}

#[test]
fn an_oscillator_that_stiffens_by_a_third_is_an_alarm_once_and_located() {
    let (mut delays, mut misses) = (vec![], vec![]);
    for seed in 0..20 {
        let reports = follow(watching(), &oscillator(seed, 20_000));
        let alarms: Vec<&Report> = reports.iter().filter(|report| report.alarm).collect();
        assert_eq!(alarms.len(), 1, "{seed}: {alarms:?}");
        delays.push(alarms[0].time - 100.0);
        misses.push((alarms[0].since - 100.0).abs());
    }
    println!("{delays:?} after it, {misses:?} beside it");
    assert!(delays.iter().all(|delay| (0.0..=15.0).contains(delay)), "{delays:?}");
    assert!(quantile(misses.clone(), 1.0) <= 4.0, "{misses:?}");
}

/// One block in a hundred may have a false alarm, whatever the number of its tests.
#[test]
fn false_alarms_of_all_lengths_together_are_as_rare_as_stated() {
    let (mut blocks, mut alarms) = (0, 0);
    for seed in 0..60 {
        let reports = follow(detector(1, Memory::Growing, 0.01), &decay(seed, 30_000, usize::MAX));
        blocks += reports.len();
        alarms += reports.iter().filter(|report| report.alarm).count();
    }
    let rate = f64::from(u32::try_from(alarms).unwrap()) / blocks as f64;
    println!("{alarms} of {blocks}: {rate:.4}");
    // Tests of one time share their rows, so there are fewer; sd of about 0.001.
    assert!((0.003..0.012).contains(&rate), "{rate}");
}

/// To the last bit after any block, and not with a state that has no longer stretches.
#[test]
fn longer_stretches_go_on_from_a_state() {
    let rows = decay(3, 80_000, 40_000);
    let fresh = || detector(1, Memory::Growing, 1e-6);
    let whole = follow(fresh(), &rows);
    assert!(whole.iter().any(|report| report.alarm));
    let mut reports = vec![];
    let mut running = fresh();
    for (n, row) in rows.iter().enumerate() {
        if let Some(report) = running.push(n as f64 * H, row).unwrap() {
            if report.alarm {
                running.accept(&report).unwrap();
            }
            reports.push(report);
        }
        if n % 7_700 == 0 {
            let text = serde_json::to_string(&running.state().unwrap()).unwrap();
            running = fresh().resume(serde_json::from_str(&text).unwrap()).unwrap();
        }
    }
    assert!(reports == whole, "other reports after a restart");
    let mut state = serde_json::to_value(running.state().unwrap()).unwrap();
    state["history"] = serde_json::Value::Null;
    assert!(fresh().resume(serde_json::from_value(state).unwrap()).is_err());
}

/// The step at fault, not the first one of those that are summed together.
#[test]
fn an_overflow_of_squares_or_slopes_names_its_step() {
    let square = Function::new("s", |_, _| 1.0, |_, x, slopes| slopes[0] = x[0] * x[0]);
    let steep = Arc::new(Basis::new(1, 0).with(Rule::MidPoint, square).unwrap());
    for (basis, value) in [(basis(), 1e160), (steep, 1e155)] {
        let mut stream = Stream::new(basis, 1e10).unwrap();
        for n in 0..200_u64 {
            stream.push(n as f64 * 1e10, &[if n == 98 { value } else { 0.5 }]).unwrap();
        }
        let refused = stream.sums().unwrap_err();
        assert!(matches!(refused, InferenceError::NonFinite { row: 97 | 98, .. }), "{refused}");
    }
}
