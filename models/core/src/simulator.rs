//! Runs a model over a window: predict, record, then correct.
//!
//! For each observation time: advance over the spans on which the inputs are linear, record the outputs, and only then let
//! the observer see the observed values of that same time. No clock, and no randomness but the noise that the setup's seed and the job draw: same job, same bits. A run over
//! consecutive windows equals one run over the whole. Next file to read: `inputs`, then `binding`.

use crate::SetupError;
use crate::binding::Binding;
use crate::effect;
use crate::inputs::Inputs;
use crate::job_check::{bad, check_job};
use crate::limits::{Limits, MAX_STEPS, TIMEOUT};
use crate::memory::with_memories;
use crate::noise::WhiteNoise;
use crate::observer::{self, Correction, Observer, Wiring};
use crate::past::Past;
use crate::segment::Segment;
use crate::sensitivity::Sensitive;
use crate::setup::Setup;
use crate::spans::Spans;
use crate::{
    Drive, Forward, Job, Model, ModelFailure, NativeModels, ParticleError, Prediction, Spec, Stop, Timeout,
    Until, nearest,
};

/// A model, its observer, and the way from a job's values to its parameters.
pub struct Simulator {
    model: Box<dyn Model>,
    /// The model's specification, with its memories as states.
    spec: Spec,
    observer: Box<dyn Observer>,
    binding: Binding,
    /// Number of states that a run hands on: the model's own, without their derivatives.
    n_state: usize,
    /// What stands in each predicted row.
    rows: Vec<Row>,
    /// Seed of the model's noise; `None` leaves it out.
    noise: Option<u64>,
    /// Steps of one run at most.
    max_steps: u64,
    /// Seconds of computing of one run at most.
    timeout: f64,
}

/// What is recorded in one row of a prediction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Row {
    /// A component of the outputs.
    Output(usize),
    /// A component of the state, as it is before any correction at that time.
    State(usize),
}

impl Simulator {
    /// Resolves the names of a setup against its model, effects included, and builds its observer. `native` are the models
    /// among which an observer that does not fit names those that it does.
    ///
    /// # Errors
    /// When a name is unknown (with the nearest valid one), given twice or without value.
    pub fn new(model: Box<dyn Model>, setup: &Setup, native: NativeModels) -> Result<Self, SetupError> {
        let spec = with_memories(model.spec(), model.memories());
        let rows = rows(model.spec(), &setup.outputs)?;
        let binding = Binding::new(setup, &spec, &free_names(setup, &spec)?)?;
        let (outputs, theta) = (&setup.outputs, binding.constants());
        let wiring = Wiring { spec: &spec, outputs, model: &*model, theta, native };
        let observer = observer::build(&setup.observer, wiring)?;
        let n_state = spec.n_state();
        let (model, spec, rows) = if setup.slopes {
            let rows = with_slopes(&rows, binding.len(), model.spec());
            let model = sensitive(model, setup, &binding)?;
            let spec = model.spec().clone();
            (model, spec, rows)
        } else {
            (model, spec, rows)
        };
        let max_steps = setup.max_steps.unwrap_or(MAX_STEPS);
        let timeout = setup.timeout.unwrap_or(TIMEOUT);
        Ok(Self { model, spec, observer, binding, n_state, rows, noise: setup.noise, max_steps, timeout })
    }

    /// The model's state at the window's start, and the past that led to it.
    fn start<'a>(
        &self,
        job: &'a Job,
        theta: &[f64],
        u: Drive<'_>,
    ) -> Result<(Vec<f64>, Past<'a>), ParticleError> {
        let (window, model) = (&*job.window, &*self.model);
        if let Some(x) = &job.state {
            let n = self.spec.n_state();
            if x.len() != n {
                return Err(bad(format!("{} state values for a model of {n}", x.len())));
            }
            self.check_finite(window.start, &[], x, &[])?;
            let mut x = x.to_vec();
            let past = Past::resumed(model, window, &mut x);
            return Ok((x, past));
        }
        let mut x = vec![0.0; model.spec().n_state()];
        model.initial(theta, &mut x);
        self.binding.initial(&job.theta, &mut x);
        self.check_finite(window.start, &[], &x, &[])?;
        let past = Past::constant(model, window, u, theta, &x);
        Ok((x, past))
    }

    /// Advances the model over one segment, and what it remembers with it.
    fn advance(
        &self,
        past: &mut Past<'_>,
        segment: Segment<'_>,
        theta: &[f64],
        x: &mut [f64],
    ) -> Result<(), ModelFailure> {
        if self.model.memories().is_empty() {
            return self.model.advance(segment, theta, x);
        }
        past.advance(&*self.model, segment, theta, x)
    }

    /// The first quantity that is not finite, as an error, of the outputs those that are recorded. A wrong input is named before what it
    /// spoils.
    fn check_finite(&self, t: f64, u: &[f64], x: &[f64], y: &[f64]) -> Result<(), ModelFailure> {
        let recorded = self.rows.iter().filter_map(|row| match *row {
            Row::Output(i) => y.get(i),
            Row::State(_) => None,
        });
        if x.iter().chain(recorded).all(|value| value.is_finite()) {
            return Ok(());
        }
        let spec = self.spec();
        let lists = [("input", &spec.inputs, u), ("state", &spec.states, x), ("output", &spec.outputs, y)];
        let found = lists.iter().find_map(|(what, list, values)| {
            let is_recorded = |i: usize| *what != "output" || self.rows.contains(&Row::Output(i));
            let mut at = values.iter().enumerate();
            let (at, _) = at.find(|(i, value)| !value.is_finite() && is_recorded(*i))?;
            Some(format!("{what} `{}`", Spec::component(list, at)))
        });
        Err(ModelFailure::NotFinite { what: found.unwrap_or_default(), time: t })
    }
}

impl Forward for Simulator {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn run(&self, job: &Job) -> Result<Prediction, ParticleError> {
        self.run_within(job, &Until { spent: &|| 0.0, stop: &Stop::default(), traceparent: None })
    }

    fn run_within(&self, job: &Job, until: &Until<'_>) -> Result<Prediction, ParticleError> {
        check_job(job, self.binding.len(), self.rows.len(), &self.spec)?;
        let end = job.window.times.last().copied().unwrap_or(job.window.start);
        let is_late = || until.stop.is_set() || (until.spent)() > self.timeout;
        let limits = Limits::new(self.max_steps, end, Some(&is_late));
        let ran = self.limited(job, &limits);
        if limits.stopped() { Err(self.late().into()) } else { ran }
    }
}

impl Simulator {
    /// Runs a job that fits.
    fn limited(&self, job: &Job, limits: &Limits<'_>) -> Result<Prediction, ParticleError> {
        let window = &*job.window;
        let theta = self.binding.theta(&job.theta, window.start)?;
        let mut inputs = Inputs::new(window);
        let noise = self.noise.filter(|_| self.model.n_noise() > 0).map(|seed| WhiteNoise::of(seed, job));
        let (mut x, mut past) = self.start(job, &theta, inputs.drive(window.start))?;
        let mut y = vec![0.0; self.spec.n_output()];
        let mut outputs = Vec::with_capacity(window.observed.len());
        let n_obs = self.rows.len();
        let mut previous = window.start;
        let mut spans = Spans::new(window, n_obs);
        for (j, &t) in window.times.iter().enumerate() {
            inputs.walk([previous, t], limits, |segment| {
                limits.take(1, segment.t0)?;
                self.advance(&mut past, Segment { noise: noise.as_ref(), ..segment }, &theta, &mut x)
            })?;
            let drive = Drive { history: &past, ..inputs.drive(t) };
            self.model.output(t, &x, &theta, drive, &mut y);
            self.check_finite(t, drive.value, &x, &y)?;
            outputs.extend(self.rows.iter().map(|&row| match row {
                Row::Output(i) => y[i],
                Row::State(i) => x[i],
            }));
            let column = j * n_obs..(j + 1) * n_obs;
            let (observed, predicted) = (&window.observed[column.clone()], &outputs[column]);
            if t > previous {
                let (model, theta, spans) = (&*self.model, theta.as_slice(), spans.until(t));
                self.observer.correct(Correction { t, spans, observed, predicted, model, theta }, &mut x);
            }
            spans.see(t, observed);
            previous = t;
        }
        past.store(previous, &mut x);
        // An observer moves the state after the last check.
        self.check_finite(previous, &[], &x, &[])?;
        x.truncate(self.n_state);
        Ok(Prediction { outputs, state: x.into(), cost: 0.0 })
    }

    fn late(&self) -> Timeout {
        let limit = self.timeout;
        let says =
            format!("the run computed for more than {limit} s (`timeout` in `[model]` sets the limit)");
        Timeout { limit, says }
    }
}

/// The model with its derivatives by each value of a job.
fn sensitive(model: Box<dyn Model>, setup: &Setup, binding: &Binding) -> Result<Box<dyn Model>, SetupError> {
    let refused = [
        (!setup.observer.is_off(), "under an observer"),
        (!setup.periods.is_empty(), "from a periodic start"),
        (setup.noise.is_some(), "with noise"),
    ];
    match refused.into_iter().find(|(is_so, _)| *is_so) {
        Some((_, what)) => Err(SetupError::Invalid(format!("derivatives of a run {what} are not to be had"))),
        None => Ok(Box::new(Sensitive::new(model, binding)?)),
    }
}

/// The rows of a model, and below them those of their derivatives by so many values.
fn with_slopes(rows: &[Row], n_value: usize, of: &Spec) -> Vec<Row> {
    let (n_state, n_output) = (of.n_state(), of.n_output());
    let below = |by: usize| {
        rows.iter().map(move |row| match *row {
            Row::Output(i) => Row::Output(by * n_output + i),
            Row::State(i) => Row::State(by * n_state + i),
        })
    };
    (0..=n_value).flat_map(below).collect()
}

/// The names that only terms of effects use, so that a constant may have them.
pub(crate) fn free_names(setup: &Setup, spec: &Spec) -> Result<Vec<String>, SetupError> {
    let lists = [&spec.states, &spec.inputs, &spec.outputs];
    let taken = |name: &String| lists.into_iter().flatten().any(|q| q.name == *name);
    Ok(effect::names(&setup.effects)?.into_iter().filter(|name| !taken(name)).collect())
}

/// What the named outputs record, in their order; a scalar state where no output has that name.
fn rows(spec: &Spec, outputs: &[String]) -> Result<Vec<Row>, SetupError> {
    let mut rows = Vec::new();
    for (i, name) in outputs.iter().enumerate() {
        if outputs[..i].contains(name) {
            return Err(SetupError::Twice(name.clone()));
        }
        if let Some(range) = Spec::range_of(&spec.outputs, name) {
            rows.extend(range.map(Row::Output));
        } else if let Some(at) = spec.scalar_state(name) {
            rows.push(Row::State(at));
        } else {
            let scalars = spec.states.iter().filter(|q| q.size == 1);
            return Err(SetupError::Unknown {
                what: "output or scalar state",
                name: name.clone(),
                nearest: nearest(name, spec.outputs.iter().chain(scalars).map(|q| &q.name)),
            });
        }
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Quantity;

    #[test]
    fn a_field_takes_one_row_per_component_and_is_named_with_its_index() {
        let field = Quantity { size: 3, ..Quantity::new("wall", "mm") };
        let list = vec![Quantity::new("p", ""), field, Quantity::new("q", "")];
        let states = vec![Quantity::new("p", "")];
        let spec = Spec { states, outputs: list.clone(), ..Spec::default() };
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        assert_eq!(
            rows(&spec, &names(&["q", "wall"])).expect("known outputs"),
            [4, 1, 2, 3].map(Row::Output)
        );
        assert_eq!(rows(&spec, &names(&["wall[2]", "p"])).expect("known outputs"), [3, 0].map(Row::Output));
        assert!(rows(&spec, &names(&["wall[3]"])).is_err(), "beyond the field");
        assert_eq!(Spec::component(&list, 3), "wall[2]");
        assert_eq!(Spec::component(&list, 4), "q");
    }
}
