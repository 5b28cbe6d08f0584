//! What a screening of missing effects costs: many setups of one effect each, with hardly more than one run for each.
//!
//! Cold, the workers have built none of the setups; warm, all of them. Installing the setups counts in both, because every
//! batch of an explanation begins with it.

use std::sync::Arc;
use std::time::{Duration, Instant};

use starlings_coordinator::fleet::{Fleet, GrpcFleet, Outcome, SetupId};
use starlings_models::equations::{EquationsDef, Method, OutputDef, SolverDef, StateDef};
use starlings_models::{Addition, BuildSetup, EffectDef, EffectParameter, Job, ModelDef, Setup, Window};

use crate::{Failure, WORKERS, quantile};

/// Effects of one screening.
pub(crate) const SETUPS: usize = 40;

/// Runs beyond one per effect: second points of grids.
const EXTRA: usize = 8;

/// Fixed step that makes a run of [`DURATION`] take about 10 ms.
const STEP: f64 = 1e-3;

const DURATION: f64 = 20.0;

const OBSERVATIONS: usize = 200;

/// Factors of the terms, the first with all of the second.
const SHAPES: [&str; 8] = ["x", "v", "x^2", "x*v", "sin(3*x)", "tanh(v)", "exp(-x^2)", "x^3"];
const MODULATIONS: [&str; 5] = ["x", "v", "v^2", "cos(t)", "sin(2*t)"];

/// What was measured: medians over the rounds.
pub(crate) struct Screening {
    /// Sum of the runs' wall times in the workers over (workers × wall time from the first install to the last outcome), no
    /// setup built yet.
    pub(crate) cold: f64,
    /// The same once all setups are built.
    pub(crate) warm: f64,
    /// Mean wall time of a run, in the workers, warm.
    pub(crate) run_ms: f64,
    /// Wall time of building one setup, in this process.
    pub(crate) build_ms: f64,
}

/// Screens `rounds` times, each time other setups: first cold, then warm.
pub(crate) fn measure(fleet: &mut GrpcFleet, rounds: usize) -> Result<Screening, Failure> {
    let (mut cold, mut warm, mut runs, mut builds) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for round in 0..rounds {
        let setups: Vec<Setup> = (0..SETUPS).map(|i| setup(round, i)).collect();
        let first = screen(fleet, &setups)?;
        let again = screen(fleet, &setups)?;
        if first.outputs.is_empty() || first.outputs != again.outputs {
            return Err("the same screening gave other values".into());
        }
        cold.push(first.efficiency());
        warm.push(again.efficiency());
        runs.push(again.busy / (SETUPS + EXTRA) as u32);
        let started = Instant::now();
        for setup in &setups {
            std::hint::black_box(setup.build()?);
        }
        builds.push(started.elapsed() / SETUPS as u32);
    }
    runs.sort_unstable();
    builds.sort_unstable();
    Ok(Screening {
        cold: median(cold),
        warm: median(warm),
        run_ms: 1e3 * quantile(&runs, 0.5),
        build_ms: 1e3 * quantile(&builds, 0.5),
    })
}

/// One screening.
struct Screened {
    outputs: Vec<u64>,
    busy: Duration,
    wall: Duration,
}

impl Screened {
    fn efficiency(&self) -> f64 {
        self.busy.as_secs_f64() / (WORKERS as f64 * self.wall.as_secs_f64())
    }
}

fn screen(fleet: &mut GrpcFleet, setups: &[Setup]) -> Result<Screened, Failure> {
    let times: Vec<f64> = (1..=OBSERVATIONS).map(|i| DURATION * i as f64 / OBSERVATIONS as f64).collect();
    let window = Arc::new(Window::free(0.0, times, 1, vec![]));
    let started = Instant::now();
    let ids = setups.iter().map(|setup| fleet.install(setup)).collect::<Result<Vec<SetupId>, _>>()?;
    let job = |i: usize| {
        let amplitude = if i < SETUPS { 1e-3 } else { 2e-3 };
        let (window, theta) = (Arc::clone(&window), vec![1.0, amplitude]);
        (ids[i % SETUPS], Job { particle: i as u32, record: 0, window, theta, state: None })
    };
    let outcomes = fleet.run_mixed((0..SETUPS + EXTRA).map(job).collect())?;
    let wall = started.elapsed();
    let (mut outputs, mut busy) = (Vec::new(), Duration::ZERO);
    for Outcome { result, .. } in outcomes {
        let prediction = result?;
        busy += Duration::from_secs_f64(prediction.cost);
        outputs.extend(prediction.outputs.iter().map(|y| y.to_bits()));
    }
    Ok(Screened { outputs, busy, wall })
}

/// A damped oscillator in equations with one effect; no two rounds share a setup.
fn setup(round: usize, i: usize) -> Setup {
    let state = |name: &str, initial: &str, rate: &str| StateDef {
        name: name.to_owned(),
        initial: initial.to_owned(),
        rate: vec![(name.to_owned(), rate.to_owned())],
        ..StateDef::default()
    };
    let equations = EquationsDef {
        states: vec![state("x", "1", "v"), state("v", "0", "-(k*x + c*v)/m")],
        outputs: vec![OutputDef {
            name: "position".to_owned(),
            value: "x".to_owned(),
            ..OutputDef::default()
        }],
        solver: SolverDef { method: Method::Fixed, step: Some(STEP), ..SolverDef::default() },
        ..EquationsDef::default()
    };
    let term = format!("a*{}*{}", SHAPES[i % SHAPES.len()], MODULATIONS[i / SHAPES.len()]);
    let effect = EffectDef {
        name: format!("effect-{round}-{i}"),
        adds: vec![Addition { to: "v".to_owned(), term }],
        parameters: vec![EffectParameter { name: "a".to_owned(), ..EffectParameter::default() }],
        ..EffectDef::default()
    };
    Setup {
        model: ModelDef {
            kind: "equations".to_owned(),
            constants: [("m", 1.0), ("c", 0.1)].map(|(name, value)| (name.to_owned(), value)).into(),
            equations: Some(equations),
            ..ModelDef::default()
        },
        parameters: vec!["k".to_owned(), "a".to_owned()],
        outputs: vec!["position".to_owned()],
        effects: vec![effect],
        ..Setup::default()
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
