//! The integrators on smooth problems with known solutions: order, tolerance, stiffness, restart, failure.

use starlings_models_core::integrate::{Solver, Tolerance};
use starlings_models_core::limits::Limits;
use starlings_models_core::segment::{Drive, History, Segment};
use starlings_models_core::{Model, ModelFailure, Quantity, Spec, advance_by};

type Rate = fn(f64, &[f64], &[f64], &mut [f64]);

/// A model given by its rate; the third argument of the rate is the inputs.
struct Ode {
    spec: Spec,
    rate: Rate,
}

fn ode(n: usize, rate: Rate) -> Ode {
    let spec = Spec {
        kind: "test".to_owned(),
        says: String::new(),
        states: (0..n).map(|i| Quantity::new(&format!("x{i}"), "")).collect(),
        parameters: vec![],
        outputs: vec![],
        inputs: vec![],
        measures: vec![],
        restart: true,
    };
    Ode { spec, rate }
}

impl Model for Ode {
    fn spec(&self) -> &Spec {
        &self.spec
    }
    fn initial(&self, _: &[f64], _: &mut [f64]) {}
    fn rhs(&self, t: f64, x: &[f64], _: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        (self.rate)(t, x, u.value, dx);
    }
    fn output(&self, _: f64, _: &[f64], _: &[f64], _: Drive<'_>, _: &mut [f64]) {}
}

struct Never;

impl History for Never {
    fn at(&self, _: usize, _: f64) -> f64 {
        f64::NAN
    }
}

fn run(model: &Ode, solver: Solver, [t0, t1]: [f64; 2], x0: &[f64]) -> Result<Vec<f64>, ModelFailure> {
    let mut x = x0.to_vec();
    let segment =
        Segment { t0, t1, u0: &[1.0], slope: &[2.0], history: &Never, limits: &Limits::none(), noise: None };
    advance_by(model, solver, segment, &[], &mut x).map(|()| x)
}

fn tolerance(relative: f64) -> Tolerance {
    Tolerance { relative, absolute: relative * 1e-2 }
}

/// Logistic growth with a rate that depends on time: closed form x = 1/(1 + e^{-t²/2}) from 1/2.
fn logistic() -> Ode {
    ode(1, |t, x, _, dx| dx[0] = t * x[0] * (1.0 - x[0]))
}

fn logistic_error(solver: Solver) -> f64 {
    let x = run(&logistic(), solver, [0.0, 2.0], &[0.5]).expect("a smooth problem");
    (x[0] - 1.0 / (1.0 + (-2.0_f64).exp())).abs()
}

/// Undamped oscillator of frequency 3.
fn oscillator() -> Ode {
    ode(2, |_, x, _, dx| {
        dx[0] = x[1];
        dx[1] = -9.0 * x[0];
    })
}

/// Chemical kinetics of Robertson (1966).
fn robertson() -> Ode {
    ode(3, |_, y, _, dy| {
        dy[0] = -0.04 * y[0] + 1e4 * y[1] * y[2];
        dy[2] = 3e7 * y[1] * y[1];
        dy[1] = -dy[0] - dy[2];
    })
}

const ROBERTSON_AT_40: [f64; 3] = [0.715_827_068_7, 9.185_534_765e-6, 0.284_163_745_7];

#[test]
fn the_fixed_method_converges_with_order_four() {
    let [coarse, fine] = [0.05, 0.025].map(|step| logistic_error(Solver::Fixed { step }));
    let order = (coarse / fine).log2();
    // Half a unit allows for the next term of the error expansion.
    assert!((order - 4.0).abs() < 0.5, "order {order}");
}

/// Global error against work: with error ∝ tolerance and step ∝ tolerance^(1/order), the number of rate evaluations tells
/// the order.
fn order_by_work(method: fn(Tolerance) -> Solver) -> f64 {
    use std::sync::atomic::{AtomicU64, Ordering};
    static CALLS: AtomicU64 = AtomicU64::new(0);
    static LOCK: std::sync::Mutex<()> = std::sync::Mutex::new(());
    let _one_at_a_time = LOCK.lock().expect("no run panicked");
    let counted = ode(2, |t, x, _, dx| {
        CALLS.fetch_add(1, Ordering::Relaxed);
        dx[0] = x[1];
        dx[1] = -9.0 * x[0] + t.sin();
    });
    let [coarse, fine] = [1e-6, 1e-9].map(|relative| {
        CALLS.store(0, Ordering::Relaxed);
        let x =
            run(&counted, method(tolerance(relative)), [0.0, 20.0], &[1.0, 0.0]).expect("a smooth problem");
        // x'' = -9 x + sin t from (1, 0): cos 3t − sin(3t)/24 + sin(t)/8.
        let exact = 60.0_f64.cos() - 60.0_f64.sin() / 24.0 + 20.0_f64.sin() / 8.0;
        ((x[0] - exact).abs(), CALLS.load(Ordering::Relaxed) as f64)
    });
    (coarse.0 / fine.0).ln() / (fine.1 / coarse.1).ln()
}

#[test]
fn dormand_prince_converges_with_order_five() {
    let order = order_by_work(Solver::Dopri5);
    assert!((order - 5.0).abs() < 0.7, "order {order}: rejected steps and the first step blur it");
}

#[test]
fn rosenbrock_converges_with_order_four() {
    let order = order_by_work(Solver::Rosenbrock);
    assert!((order - 4.0).abs() < 0.6, "order {order}: rejected steps and the first step blur it");
}

#[test]
fn every_adaptive_method_keeps_its_tolerance() {
    for method in [Solver::Dopri5, Solver::Rosenbrock, Solver::Auto] {
        for relative in [1e-4, 1e-6, 1e-8, 1e-10] {
            let error = logistic_error(method(tolerance(relative)));
            // The tolerance bounds each step; over a few dozen steps the sum may be some times larger.
            assert!(error < 20.0 * relative, "{:?}: {error:e}", method(tolerance(relative)));
        }
    }
}

#[test]
fn a_linear_input_enters_at_its_own_time() {
    // x' = u with u = 1 + 2 (t - 1): exact for every method of order two or more.
    let model = ode(1, |_, _, u, dx| dx[0] = u[0]);
    let solvers = [
        Solver::Dopri5(Tolerance::default()),
        Solver::Rosenbrock(Tolerance::default()),
        Solver::Fixed { step: 0.7 },
    ];
    for solver in solvers {
        let x = run(&model, solver, [1.0, 3.0], &[0.0]).unwrap();
        // Rounding only, but Rosenbrock takes the rate's time derivative by differences here.
        let allowed = if matches!(solver, Solver::Rosenbrock(_)) { 1e-8 } else { 1e-12 };
        assert!((x[0] - 6.0).abs() < allowed, "{solver:?}: {}", x[0]);
    }
}

#[test]
fn rosenbrock_solves_robertson_kinetics_to_the_published_values() {
    let tolerance = Tolerance { relative: 1e-9, absolute: 1e-14 };
    for solver in [Solver::Rosenbrock(tolerance), Solver::Auto(tolerance)] {
        let y = run(&robertson(), solver, [0.0, 40.0], &[1.0, 0.0, 0.0]).unwrap();
        for (y, reference) in y.iter().zip(ROBERTSON_AT_40) {
            // Ten published digits, at a tolerance of nine.
            assert!((y - reference).abs() < 1e-8 * reference, "{solver:?}: {y} against {reference}");
        }
    }
}

#[test]
fn auto_goes_over_to_rosenbrock_where_dormand_prince_gives_up() {
    // Robertson's kinetics up to 4000 would take Dormand-Prince more than a million steps.
    let tolerance = Tolerance { relative: 1e-6, absolute: 1e-10 };
    let y0 = [1.0, 0.0, 0.0];
    let stuck = run(&robertson(), Solver::Dopri5(tolerance), [0.0, 4e3], &y0);
    assert!(matches!(stuck, Err(ModelFailure::TooManySteps { .. })), "{stuck:?}");
    let y = run(&robertson(), Solver::Auto(tolerance), [0.0, 4e3], &y0).unwrap();
    let strict = Tolerance { relative: 1e-10, absolute: 1e-15 };
    let exact = run(&robertson(), Solver::Rosenbrock(strict), [0.0, 4e3], &y0).unwrap();
    assert!(
        (y[0] - exact[0]).abs() < 1e-5 * exact[0],
        "{} against {}: ten times the tolerance",
        y[0],
        exact[0]
    );
    assert!((y.iter().sum::<f64>() - 1.0).abs() < 1e-10, "mass is conserved by a linear invariant");
}

#[test]
fn the_stiff_van_der_pol_oscillator_reaches_its_reference() {
    // mu = 1000 from (2, 0) at t = 2000 (Mazzia & Magherini 2008, test set for initial value problems).
    let model = ode(2, |_, y, _, dy| {
        dy[0] = y[1];
        dy[1] = 1e3 * (1.0 - y[0] * y[0]) * y[1] - y[0];
    });
    let solver = Solver::Auto(Tolerance { relative: 1e-9, absolute: 1e-11 });
    let y = run(&model, solver, [0.0, 2000.0], &[2.0, 0.0]).unwrap();
    // The phase after two jumps magnifies the tolerance about a thousandfold.
    assert!((y[0] - 1.706_167_732_170_483).abs() < 1e-6, "{}", y[0]);
}

#[test]
fn a_run_cut_at_window_boundaries_equals_the_continuous_run() {
    let solver = Solver::Dopri5(tolerance(1e-9));
    let whole = run(&oscillator(), solver, [0.0, 2.0], &[1.0, 0.0]).unwrap();
    let mut cut = vec![1.0, 0.0];
    for i in 0..400 {
        let at = |i: i32| f64::from(i) * 0.005;
        cut = run(&oscillator(), solver, [at(i), at(i + 1)], &cut).unwrap();
    }
    assert!((whole[0] - 6.0_f64.cos()).abs() < 1e-7, "a hundred steps of tolerance 1e-9");
    assert!((cut[0] - whole[0]).abs() < 1e-7, "{} {}", cut[0], whole[0]);
}

#[test]
fn the_same_job_gives_the_same_bits() {
    for solver in
        [Solver::Auto(tolerance(1e-8)), Solver::Rosenbrock(tolerance(1e-8)), Solver::Fixed { step: 0.01 }]
    {
        let bits =
            || run(&oscillator(), solver, [0.0, 3.0], &[1.0, 0.5]).unwrap().into_iter().map(f64::to_bits);
        assert!(bits().eq(bits()));
    }
}

#[test]
fn failures_are_named() {
    let solver = Solver::Dopri5(Tolerance::default());
    // x' = x² from 1 has a pole at t = 1.
    let pole = ode(1, |_, x, _, dx| dx[0] = x[0] * x[0]);
    match run(&pole, solver, [0.0, 2.0], &[1.0]) {
        Err(ModelFailure::StepTooSmall { time, .. } | ModelFailure::NotFinite { time, .. }) => {
            assert!((time - 1.0).abs() < 1e-6, "{time}");
        }
        other => panic!("{other:?}"),
    }
    let nan = ode(2, |_, x, _, dx| {
        dx[0] = 1.0;
        dx[1] = (0.5 - x[0]).sqrt();
    });
    for solver in [solver, Solver::Rosenbrock(Tolerance::default()), Solver::Fixed { step: 0.01 }] {
        match run(&nan, solver, [0.0, 1.0], &[0.0, 0.0]) {
            Err(ModelFailure::NotFinite { what, time }) => {
                assert_eq!(what, "state `x1`");
                assert!((time - 0.5).abs() < 0.02, "{time}");
            }
            other => panic!("{solver:?} {other:?}"),
        }
    }
    let error = run(&oscillator(), Solver::Fixed { step: 1e-9 }, [0.0, 1.0], &[1.0, 0.0]).unwrap_err();
    assert!(matches!(error, ModelFailure::TooManySteps { limit: 1_000_000, .. }));
}
