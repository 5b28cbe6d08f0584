//! Jobs on a model that runs in a program of its own.
//!
//! Binds a job's values to the program's parameters, adds the effects that can be added from outside, checks what comes back.
//! How the program is reached is the business of whoever implements [`Solve`]; nothing here knows a process or a socket. Next
//! file to read: [`crate::solver`] for what is known of the program, then [`mod@split`] and [`mod@applied`].

mod applied;
mod outline;
mod parts;
mod replay;
mod rows;
mod run;
mod split;
pub mod table;

use std::collections::BTreeMap;

use crate::SetupError;
use crate::binding::Binding;
use crate::effect::Addition;
use crate::job_check::check_job;
use crate::setup::Setup;
use crate::simulator::free_names;
use crate::solver::Description;
use crate::{
    Forward, Job, ModelFailure, ObserverDef, ParticleError, Prediction, Signal, Spec, StateValues, Stop,
    Until, Window,
};
use applied::Applied;
pub use outline::{check_effects, outline};
pub use parts::spec;
use parts::{Parts, check_initial, check_observer};
use rows::Rows;
pub use run::Run;

/// What the program predicts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solved {
    /// Predicted outputs, laid out as [`Window::observed`].
    pub outputs: Vec<f64>,
    /// State at the last time, after the observer's correction; empty from a program that cannot restart.
    pub state: Vec<f64>,
}

/// A way to have a run made.
pub trait Solve: Send + Sync {
    /// Has one run made.
    ///
    /// # Errors
    /// When the run gives no prediction.
    fn solve(&self, run: &Run<'_>) -> Result<Solved, ParticleError>;
}

/// A model that runs in a program of its own, with its setup.
pub struct External<S> {
    solve: S,
    description: Description,
    /// The description's specification with what effects carry from window to window.
    spec: Spec,
    binding: Binding,
    observer: ObserverDef,
    rows: Rows,
    on_inputs: Option<Applied>,
    on_outputs: Option<Applied>,
    terms: Vec<Addition>,
    /// Places of the parameters of the terms among all, with their names.
    of_terms: Vec<(String, usize)>,
    constants: Vec<(String, f64)>,
}

impl<S: Solve> External<S> {
    /// Prepares a setup for a program that `solve` reaches and `description` describes.
    ///
    /// # Errors
    /// When a name is unknown, a value is missing, or an effect or the observer is more than the program takes.
    pub fn new(setup: &Setup, description: Description, solve: S) -> Result<Self, SetupError> {
        let Parts { whole, spec, on_inputs, on_outputs, hosted } = Parts::of(setup, &description)?;
        check_observer(&setup.observer, &description, on_outputs.is_some())?;
        check_initial(setup, &whole, description.spec.n_state())?;
        let binding = Binding::new(setup, &whole, &free_names(setup, &whole)?)?;
        let all = on_outputs.is_some();
        let rows = Rows::new(&description.spec, &setup.outputs, all)?;
        let n_own = description.spec.parameters.len();
        let place =
            |name: &String| whole.parameters.iter().position(|q| q.name == *name).filter(|i| *i >= n_own);
        let names = hosted.iter().flat_map(|effect| effect.parameters.iter().map(|p| p.name.clone()));
        let of_terms = names.filter_map(|name| place(&name).map(|i| (name, i))).collect();
        let fixed = setup.model.constants.iter().filter(|(name, _)| {
            whole.parameters.iter().all(|q| q.name != **name) && !name.starts_with("initial:")
        });
        Ok(Self {
            solve,
            spec,
            binding,
            observer: setup.observer.clone(),
            rows,
            on_inputs,
            on_outputs,
            terms: hosted.into_iter().flat_map(|effect| effect.adds).collect(),
            of_terms,
            constants: fixed.map(|(name, value)| (name.clone(), *value)).collect(),
            description,
        })
    }

    /// The window as the program sees it: inputs with their effects, and observed values of the outputs that are asked for.
    fn window(
        &self,
        job: &Job,
        theta: &[f64],
        of_effects: &mut EffectStates,
    ) -> Result<Window, ParticleError> {
        let window = &*job.window;
        let observed = self.rows.observed(window);
        let mut seen = Window { observed, ..window.clone() };
        if let Some(effects) = &self.on_inputs {
            let times = applied::grid(window);
            let n = self.description.spec.inputs.len();
            let replayed = Window::free(window.start, times.clone(), n, window.inputs.clone());
            let shown = effects.run(theta, replayed, of_effects.inputs.take())?;
            let signal = |i: usize| Signal {
                times: times.clone(),
                values: shown.outputs.iter().skip(i).step_by(n).copied().collect(),
            };
            seen.inputs = (0..n).map(signal).collect();
            of_effects.inputs = Some(shown.state.into_vec());
        }
        Ok(seen)
    }

    /// Adds effects to the outputs, laid out as they were asked for.
    fn add_to_outputs(
        &self,
        job: &Job,
        theta: &[f64],
        outputs: Vec<f64>,
        of_effects: &mut EffectStates,
    ) -> Result<Vec<f64>, ParticleError> {
        let Some(effects) = &self.on_outputs else { return Ok(outputs) };
        let window = &*job.window;
        let n = self.description.spec.n_output();
        let before = of_effects.last.take().filter(|_| window.times[0] > window.start);
        let times: Vec<f64> =
            before.iter().map(|_| window.start).chain(window.times.iter().copied()).collect();
        let recorded = (0..n).map(|i| Signal {
            times: times.clone(),
            values: before.iter().map(|y| y[i]).chain(outputs.iter().skip(i).step_by(n).copied()).collect(),
        });
        let inputs = window.inputs.iter().cloned().chain(recorded).collect();
        let replayed = Window::free(window.start, window.times.clone(), n, inputs);
        let shown = effects.run(theta, replayed, of_effects.outputs.take())?;
        of_effects.outputs = Some(shown.state.into_vec());
        of_effects.last = outputs.len().checked_sub(n).map(|first| outputs[first..].to_vec());
        Ok(shown.outputs)
    }

    /// The state of a job as that of the program, which may be large and stays where it is, and what effects remember.
    fn split_state<'a>(
        &self,
        state: Option<&'a [f64]>,
    ) -> Result<(Option<&'a [f64]>, EffectStates), ParticleError> {
        let Some(state) = state else { return Ok((None, EffectStates::default())) };
        if !self.spec.restart {
            let name = &self.description.name;
            return Err(bad(format!("a state for the solver `{name}`, which cannot restart from one")));
        }
        if state.len() != self.spec.n_state() {
            return Err(bad(format!("{} state values for a solver of {}", state.len(), self.spec.n_state())));
        }
        let (own, rest) = state.split_at(self.description.spec.n_state());
        let (of_inputs, rest) = rest.split_at(self.on_inputs.as_ref().map_or(0, Applied::n_state));
        let n_last = if self.on_outputs.is_some() { self.description.spec.n_output() } else { 0 };
        let (last, of_outputs) = rest.split_at(n_last);
        let some = |values: &[f64], there: bool| there.then(|| values.to_vec());
        let of_effects = EffectStates {
            inputs: some(of_inputs, self.on_inputs.is_some()),
            last: some(last, self.on_outputs.is_some()),
            outputs: some(of_outputs, self.on_outputs.is_some()),
        };
        Ok((Some(own), of_effects))
    }

    /// Refuses an answer of another shape, of which nobody knows whose doing it is, and one that is not finite.
    fn check(&self, solved: &Solved, window: &Window) -> Result<(), ParticleError> {
        let name = &self.description.name;
        let wrong = |what: &str, got: usize, wanted: usize| {
            Err(ParticleError::Undecided(format!(
                "the solver `{name}` returned {got} {what} where {wanted} belong"
            )))
        };
        if solved.outputs.len() != window.observed.len() {
            return wrong("output values", solved.outputs.len(), window.observed.len());
        }
        let n_state = if self.spec.restart { self.description.spec.n_state() } else { 0 };
        if solved.state.len() != n_state && self.spec.restart {
            return wrong("state values", solved.state.len(), n_state);
        }
        let n_row = self.rows.n_asked().max(1);
        if let Some(at) = solved.outputs.iter().position(|v| !v.is_finite()) {
            let what = format!(
                "output `{}` of the solver `{name}`",
                Spec::component(self.rows.quantities(), at % n_row)
            );
            return Err(ModelFailure::NotFinite { what, time: window.times[at / n_row] }.into());
        }
        if let Some(at) = solved.state.iter().position(|v| !v.is_finite()) {
            let what = format!(
                "state `{}` of the solver `{name}`",
                Spec::component(&self.description.spec.states, at)
            );
            let time = window.times.last().copied().unwrap_or(window.start);
            return Err(ModelFailure::NotFinite { what, time }.into());
        }
        Ok(())
    }
}

/// What effects on signals remember from window to window.
#[derive(Default)]
struct EffectStates {
    inputs: Option<Vec<f64>>,
    /// The outputs at the end of the window before, without effects.
    last: Option<Vec<f64>>,
    outputs: Option<Vec<f64>>,
}

impl EffectStates {
    /// What they remember behind the program's own state, in whose memory it is where there is nothing to remember.
    fn after(self, mut own: Vec<f64>) -> Vec<f64> {
        let parts = [self.inputs, self.last, self.outputs];
        own.reserve_exact(parts.iter().flatten().map(Vec::len).sum());
        for part in parts.into_iter().flatten() {
            own.extend(part);
        }
        own
    }
}

impl<S: Solve> Forward for External<S> {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn run(&self, job: &Job) -> Result<Prediction, ParticleError> {
        self.run_within(job, &Until { spent: &|| 0.0, stop: &Stop::default(), traceparent: None })
    }

    fn run_within(&self, job: &Job, until: &Until<'_>) -> Result<Prediction, ParticleError> {
        check_job(job, self.binding.len(), self.rows.n_row(), &self.spec)?;
        let own = &self.description.spec;
        let theta = self.binding.theta(&job.theta, job.window.start)?;
        let (state, mut of_effects) = self.split_state(job.state.as_deref())?;
        let window = self.window(job, &theta, &mut of_effects)?;
        let given: BTreeMap<usize, f64> = self.binding.initial_values(&job.theta).collect();
        let initial: Vec<(String, f64)> =
            given.into_iter().map(|(i, value)| (Spec::component(&own.states, i), value)).collect();
        let of_terms = self.of_terms.iter().map(|(name, place)| (name.clone(), theta[*place]));
        let constants: Vec<(String, f64)> = of_terms.chain(self.constants.iter().cloned()).collect();
        let run = Run {
            particle: job.particle,
            record: job.record,
            parameters: &theta[..own.parameters.len()],
            initial: &initial,
            outputs: self.rows.asked(),
            window: &window,
            observer: &self.observer,
            state,
            terms: &self.terms,
            constants: &constants,
            stop: Some(until.stop),
            traceparent: until.traceparent,
        };
        let solved = self.solve.solve(&run)?;
        self.check(&solved, &window)?;
        let shown = self.add_to_outputs(job, &theta, solved.outputs, &mut of_effects)?;
        let outputs = self.rows.picked(&shown);
        let state =
            if self.spec.restart { of_effects.after(solved.state).into() } else { StateValues::default() };
        Ok(Prediction { outputs, state, cost: 0.0 })
    }
}

fn bad(message: String) -> ParticleError {
    ParticleError::BadJob(message)
}
