//! What is tried out, and how answers are compared.

use starlings_models::{Description, ObserverDef, ParticleError, Run, Solved, SolverDef, Spec, Window};

use super::trial::{Trial, all_outputs};
use crate::Solvers;
use crate::adapter::Adapter;

/// Difference between a run in one piece and in two, relative to the largest value: what a solver may lose by writing its
/// state down with fewer digits is already too much.
pub(super) const SAME: f64 = 1e-9;

/// What is tried out.
pub(super) struct Subject<'a> {
    pub(super) solvers: &'a Solvers,
    pub(super) def: &'a SolverDef,
    pub(super) adapter: &'a dyn Adapter,
    pub(super) description: &'a Description,
    pub(super) trial: &'a Trial,
    /// No observer.
    pub(super) none: ObserverDef,
}

/// What a check found.
pub(super) enum Verdict {
    Holds,
    Fails(String),
    NoOccasion(String),
}

impl Subject<'_> {
    pub(super) fn spec(&self) -> &Spec {
        &self.description.spec
    }

    pub(super) fn run(&self, run: &Run<'_>) -> Result<Solved, ParticleError> {
        self.adapter.run(run)
    }

    /// The trial as it is.
    pub(super) fn plain(&self) -> Result<Solved, Verdict> {
        let outputs = all_outputs(self.spec());
        self.run(&self.trial.run(&outputs, &self.none))
            .map_err(|error| Verdict::Fails(format!("the trial itself fails: {error}")))
    }

    /// Observed values a little beside the outputs, for observers.
    pub(super) fn observed(&self, outputs: &[f64]) -> Window {
        let beside = |v: &f64| v + 0.05 * v.abs().max(1e-3);
        Window { observed: outputs.iter().map(beside).collect(), ..self.trial.window.clone() }
    }
}

/// Ends a check early: what could not be run has its verdict.
macro_rules! got {
    ($result:expr) => {
        match $result {
            Ok(value) => value,
            Err(verdict) => return verdict,
        }
    };
}

pub(super) fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Holds, or says how two answers differ.
pub(super) fn same(a: &Solved, b: &Solved, otherwise: &str) -> Verdict {
    if same_bits(&a.outputs, &b.outputs) && same_bits(&a.state, &b.state) {
        return Verdict::Holds;
    }
    Verdict::Fails(format!(
        "{otherwise}: the outputs differ by up to {:.1e}",
        distance(&a.outputs, &b.outputs)
    ))
}

pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    if a.len() != b.len() {
        return f64::INFINITY;
    }
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, |most, d| if d.is_nan() { f64::INFINITY } else { f64::max(most, d) })
}

pub(super) fn failed(what: &str) -> impl Fn(ParticleError) -> Verdict + '_ {
    move |error| Verdict::Fails(format!("{what} fails: {error}"))
}

pub(super) use got;
