//! Each check of conformance finds the flaw that it is there for.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use starlings_models::{Description, ParticleError, Quantity, SOLVER, Solved, SolverDef, Spec};
use starlings_proto::convert::solver::description::encode_description;
use starlings_proto::convert::solver::{Reply, Request, decode_run, encode_reply};
use starlings_proto::generated_solver::solver_server::{Solver, SolverServer};
use starlings_proto::generated_solver::{self as generated, RunReply, RunRequest};
use starlings_solver::conformance::{Conformance, Trial, conformance};
use starlings_solver::{SiteOptions, Solvers};
use tokio::net::UnixListener;
use tokio_stream::wrappers::UnixListenerStream;
use tonic::{Response, Status};

/// What is wrong with the solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Flaw {
    Nothing,
    ForgetsOutputs,
    Wanders,
    KeepsTimeToItself,
    IgnoresTheOrder,
    LooksAhead,
    TakesAnything,
    MakesUpNumbers,
    LeavesTraces,
    AlwaysNudges,
    CorrectsFirst,
    AddsToItself,
    Transposes,
    AnswersIntegers,
    SwapsBytes,
    DividesByTheFirstStep,
    IgnoresTheStart,
}

/// A quantity that decays, dx/dt = -k x, shown as it is and doubled; with a flaw.
struct Decay {
    flaw: Flaw,
    runs: AtomicU64,
}

impl Decay {
    fn description() -> Description {
        let spec = Spec {
            kind: SOLVER.to_owned(),
            states: vec![Quantity::new("x", "m"), Quantity::new("clock", "s")],
            parameters: vec![Quantity::new("k", "1/s").default(0.7)],
            outputs: vec![Quantity::new("plain", "m"), Quantity::new("double", "m")],
            restart: true,
            ..Spec::default()
        };
        Description {
            spec,
            name: "decay".to_owned(),
            deterministic: true,
            observers: vec!["nudging".to_owned()],
            hosts: vec!["x".to_owned()],
        }
    }

    fn run(&self, request: &Request) -> Result<Solved, ParticleError> {
        let runs = self.runs.fetch_add(1, Ordering::Relaxed);
        let mut k = match request.parameters.as_slice() {
            [k] => *k,
            _ if self.flaw == Flaw::TakesAnything => 0.7,
            others => {
                return Err(ParticleError::BadJob(format!("{} parameters where one belongs", others.len())));
            }
        };
        if k.is_nan() && self.flaw == Flaw::MakesUpNumbers {
            k = 0.1;
        }
        Ok(self.go(request, k, runs))
    }

    fn go(&self, request: &Request, k: f64, runs: u64) -> Solved {
        let window = &request.window;
        let begun =
            request.initial.iter().find(|(name, _)| name == "x" && self.flaw != Flaw::IgnoresTheStart);
        let begin = begun.map_or(1.0, |(_, value)| *value);
        let mut x = request.state.as_ref().map_or(begin, |state| state[0]);
        if self.flaw == Flaw::Wanders {
            x += 1e-12 * runs as f64;
        }
        if self.flaw == Flaw::LeavesTraces {
            // A run that was given up is one more than those that were answered.
            x += if runs >= 1 { 1e-3 * (runs as f64).ln_1p() } else { 0.0 };
        }
        let mut before = match (self.flaw, request.state.is_some()) {
            // It forgets where it was: every window begins at its own first time.
            (Flaw::KeepsTimeToItself, true) => window.times[0],
            _ => window.start,
        };
        let asked = if self.flaw == Flaw::IgnoresTheOrder {
            &["plain".to_owned(), "double".to_owned()][..request.outputs.len()]
        } else {
            &request.outputs[..]
        };
        let mut outputs = Vec::new();
        let (gain, nudges) = (request.observer.gain, request.observer.kind == "nudging");
        for (j, &t) in window.times.iter().enumerate() {
            x *= (-k * (t - before)).exp();
            if !request.terms.is_empty() && self.flaw == Flaw::AddsToItself {
                x += 0.01;
            }
            let datum = window.observed.get(j * asked.len()).copied().filter(|v| v.is_finite());
            let pull = |x: f64| datum.map_or(x, |y| x + 0.1 * gain * (y - x));
            if self.flaw == Flaw::CorrectsFirst && nudges {
                x = pull(x);
            }
            let seen = if self.flaw == Flaw::LooksAhead { x + 1e-3 * window.times.len() as f64 } else { x };
            outputs.extend(asked.iter().map(|name| if name == "double" { 2.0 * seen } else { seen }));
            if nudges && self.flaw == Flaw::AlwaysNudges {
                x = datum.map_or(x, |y| x + 0.1 * (y - x));
            } else if nudges && self.flaw != Flaw::CorrectsFirst {
                x = pull(x);
            }
            before = t;
        }
        self.spoil(&mut outputs, asked.len());
        if self.flaw == Flaw::DividesByTheFirstStep {
            // A ratio to the first step has no value where the first time is the start.
            if window.times[0] <= window.start {
                outputs[0] = f64::NAN;
            }
        }
        Solved { outputs, state: vec![x, before] }
    }
}

impl Decay {
    /// What is wrong with the table of `n` outputs alone.
    fn spoil(&self, outputs: &mut Vec<f64>, n: usize) {
        match self.flaw {
            Flaw::ForgetsOutputs => drop(outputs.pop()),
            Flaw::Transposes => {
                *outputs = (0..n).flat_map(|i| outputs.iter().skip(i).step_by(n)).copied().collect();
            }
            // As numpy gives the bytes of an array that was made of whole numbers.
            Flaw::AnswersIntegers => {
                for value in outputs {
                    *value = f64::from_bits((100.0 * *value) as u64);
                }
            }
            Flaw::SwapsBytes => {
                // So few digits that all of them stand in the first bytes.
                let round = |v: f64| (64.0 * v).round() / 64.0;
                for value in outputs {
                    *value = f64::from_bits(round(*value).to_bits().swap_bytes());
                }
            }
            _ => {}
        }
    }
}

struct Service(Arc<Decay>);

#[tonic::async_trait]
impl Solver for Service {
    async fn describe(
        &self,
        _request: tonic::Request<generated::DescribeRequest>,
    ) -> Result<Response<generated::Description>, Status> {
        Ok(Response::new(encode_description(&Decay::description())))
    }

    type RunStream = tokio_stream::Once<Result<RunReply, Status>>;

    async fn run(&self, request: tonic::Request<RunRequest>) -> Result<Response<Self::RunStream>, Status> {
        let answer = self.0.run(&decode_run(request.get_ref()).unwrap());
        Ok(Response::new(tokio_stream::once(Ok(encode_reply(&Reply::Ended(answer))))))
    }
}

const ROWS: &str = "outputs are a row of 64-bit floats per time, however many times there are";

/// Tries a solver with this flaw out.
fn tried(flaw: Flaw, folder: &Path) -> Conformance {
    let socket = folder.join(format!("{flaw:?}"));
    let listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
    listener.set_nonblocking(true).unwrap();
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let incoming = UnixListenerStream::new(UnixListener::from_std(listener).unwrap());
            let service = SolverServer::new(Service(Arc::new(Decay { flaw, runs: AtomicU64::new(0) })));
            tonic::transport::Server::builder()
                .add_service(service)
                .serve_with_incoming(incoming)
                .await
                .unwrap();
        });
    });
    let address = Some(format!("unix:{}", socket.display()));
    let def = SolverDef { address, ..SolverDef::default() };
    let times: Vec<f64> = (0..21).map(|i| 0.1 * f64::from(i)).collect();
    let solvers = Solvers::new(SiteOptions::default());
    conformance(&solvers, &def, |d| Trial::of(d, &BTreeMap::new(), &times)).unwrap()
}

#[test]
fn a_solver_without_a_flaw_passes_every_check() {
    let folder = tempfile::tempdir().unwrap();
    let found = tried(Flaw::Nothing, folder.path());
    assert_eq!((found.failed.len(), found.skipped.len(), found.passed.len()), (0, 0, 14), "{found:?}");
}

#[test]
fn every_flaw_is_found_by_the_check_that_is_there_for_it() {
    let cases = [
        (Flaw::ForgetsOutputs, "a run gives the outputs and the state that the description promises"),
        (Flaw::ForgetsOutputs, ROWS),
        (Flaw::Transposes, ROWS),
        (Flaw::AnswersIntegers, ROWS),
        (Flaw::SwapsBytes, ROWS),
        (Flaw::DividesByTheFirstStep, "a first time that is the start itself is served"),
        (Flaw::IgnoresTheStart, "a run begins with the initial value that it is given"),
        (Flaw::Wanders, "equal requests give equal bits, in another process too"),
        (Flaw::KeepsTimeToItself, "a run in two pieces is the run in one piece"),
        (Flaw::IgnoresTheOrder, "outputs come in the order in which they are asked for"),
        (Flaw::LooksAhead, "a later time changes nothing at an earlier one"),
        (Flaw::TakesAnything, "a request that does not fit is refused in words, and the next one is served"),
        (Flaw::MakesUpNumbers, "a parameter that is no number gives no numbers"),
        (Flaw::LeavesTraces, "a run that was given up does not spoil the next"),
        (Flaw::AlwaysNudges, "an observer of gain zero is none"),
        (Flaw::CorrectsFirst, "an observer sees a datum only after its output is recorded"),
        (Flaw::AddsToItself, "a hosted term of zero is none"),
    ];
    for (flaw, check) in cases {
        let folder = tempfile::tempdir().unwrap();
        let found = tried(flaw, folder.path());
        let failed: Vec<&str> = found.failed.iter().map(|f| f.name.as_str()).collect();
        assert!(failed.contains(&check), "{flaw:?} is not found by `{check}`: {found:?}");
        assert!(found.failed.iter().all(|f| !f.reason.is_empty()), "{found:?}");
    }
}

/// The reason for which this check fails.
fn reason(found: &Conformance, check: &str) -> String {
    found.failed.iter().find(|f| f.name == check).map_or_else(|| panic!("{found:?}"), |f| f.reason.clone())
}

#[test]
fn a_transposed_table_is_called_so_also_where_times_and_outputs_are_as_many() {
    let folder = tempfile::tempdir().unwrap();
    let transposed = reason(&tried(Flaw::Transposes, folder.path()), ROWS);
    assert!(
        transposed.starts_with("the outputs are transposed: all times of the first output come first"),
        "{transposed}"
    );
    assert!(transposed.contains("`sol.y.T`"), "{transposed}");
    let integers = reason(&tried(Flaw::AnswersIntegers, folder.path()), ROWS);
    assert!(integers.contains("are the bytes of integers, or in another byte order"), "{integers}");
}

#[test]
fn a_trial_that_fails_is_told_by_the_checks_of_its_shape_and_not_by_every_other_again() {
    let folder = tempfile::tempdir().unwrap();
    let found = tried(Flaw::ForgetsOutputs, folder.path());
    assert_eq!(found.failed.len(), 2, "{found:?}");
    assert!(
        found.failed.iter().all(|f| f.reason.contains("returned 39 output values where 40 belong")),
        "{found:?}"
    );
    assert!(
        found.skipped.iter().all(|f| f.reason == "the trial itself fails") && found.skipped.len() == 12,
        "{found:?}"
    );
}
