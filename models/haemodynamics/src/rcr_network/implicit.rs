//! Implicit steps of a network that is not linear, over a span on which its signals are linear.
//!
//! RODAS (Hairer & Wanner 1996, §VI.3) for the network's differential-algebraic equations: stiffly accurate and L-stable, so that what
//! rings or decays much faster than a step is damped at once, and six stages share one sparse factorisation. The algebraic
//! variables start from the nodal equations, so that a span depends on nothing but its job. Next file to read:
//! [`super::companion`].

use starlings_models_core::integrate::rodas::{A, ALPHA, C, GAMMA, STAGES, TIME};
use starlings_models_core::limits::Limits;
use starlings_models_core::{ModelFailure, Quantity, Role};

use super::companion::Moment;
use super::factors::Factors;
use super::solve::{Given, Network};
use super::step::Span;

/// Safety in the choice of a step.
const SAFETY: f64 = 0.9;
/// Smallest and largest factor between two steps.
const FACTOR: [f64; 2] = [0.1, 8.0];
/// A state counts as no smaller than this part of the largest of its kind.
const SMALL: f64 = 1e-3;

/// What is integrated, and how exactly.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub(super) network: &'a Network,
    pub(super) states: &'a [Quantity],
    pub(super) theta: &'a [f64],
    pub(super) tolerance: f64,
    pub(super) limits: &'a Limits<'a>,
    /// Time of the span's start.
    pub(super) start: f64,
}

/// Advances a state over a span.
///
/// # Errors
/// [`ModelFailure::TooManySteps`], [`ModelFailure::StepTooSmall`] or [`ModelFailure::NotFinite`], with the time reached.
pub(super) fn advance(task: Task<'_>, span: Span<'_>, x: &mut [f64]) -> Result<(), ModelFailure> {
    if x.is_empty() {
        return Ok(());
    }
    let mut run = Run::new(task, span, x);
    let end = task.start + span.length;
    let shortest = 16.0 * f64::EPSILON * task.start.abs().max(end.abs());
    let (mut done, mut h) = (0.0, span.length);
    let mut consistent = true;
    while done < span.length {
        let last = h * 1.01 >= span.length - done;
        let step = if last { span.length - done } else { h };
        task.limits.take(1, task.start + done)?;
        let error = run.attempt(done, step);
        if error <= 1.0 {
            std::mem::swap(&mut run.z, &mut run.new);
            done = if last { span.length } else { done + step };
            h = step * (SAFETY * error.max(1e-10).powf(-0.25)).clamp(FACTOR[0], FACTOR[1]);
            consistent = false;
            continue;
        }
        if !consistent {
            run.settle(done);
            consistent = true;
            continue;
        }
        h = step
            * if error.is_finite() { (SAFETY * error.powf(-0.25)).clamp(FACTOR[0], 0.9) } else { FACTOR[0] };
        if h < shortest {
            return Err(run.failure(task.start + done, h));
        }
    }
    x.copy_from_slice(&run.z[..x.len()]);
    Ok(())
}

/// One integration under way.
struct Run<'a> {
    task: Task<'a>,
    span: Span<'a>,
    /// Rates of the signals, and of the offsets of nodes that sources join.
    rates: Vec<f64>,
    offset_rates: Vec<f64>,
    least: f64,
    /// Variables at the start of a step and after it.
    z: Vec<f64>,
    new: Vec<f64>,
    stages: Vec<f64>,
    in_time: Vec<f64>,
    signals: Vec<f64>,
    offsets: Vec<f64>,
    factors: Factors,
}

impl<'a> Run<'a> {
    fn new(task: Task<'a>, span: Span<'a>, x: &[f64]) -> Self {
        let Task { network, theta, .. } = task;
        let given = Given { x, theta, signals: span.start, slopes: span.slopes };
        let n = network.companion.n_variable();
        let mut z = vec![0.0; n];
        network.companion.variables(x, &network.solve(given), &mut z);
        let rate = |(start, end): (&f64, &f64)| (end - start) / span.length;
        let rates: Vec<f64> = span.start.iter().zip(span.end).map(rate).collect();
        let n_node = network.circuit.nodes.len();
        let level_rates = constant_free(network, theta);
        let mut offset_rates = vec![0.0; n_node];
        network.companion.offsets(&network.circuit, &level_rates, &rates, &mut offset_rates);
        Self {
            task,
            span,
            rates,
            offset_rates,
            least: network.circuit.least_resistance(theta),
            new: z.clone(),
            stages: vec![0.0; STAGES * n],
            in_time: vec![0.0; n],
            signals: span.start.to_vec(),
            offsets: vec![0.0; n_node],
            factors: Factors::default(),
            z,
        }
    }

    /// Sets signals and offsets to those of a time after the span's start.
    fn at(&mut self, time: f64) {
        for ((signal, start), rate) in self.signals.iter_mut().zip(self.span.start).zip(&self.rates) {
            *signal = start + rate * time;
        }
        let Task { network, theta, .. } = self.task;
        network.companion.offsets(&network.circuit, theta, &self.signals, &mut self.offsets);
    }

    /// Takes pressures and flows from the nodal equations again. A step leaves them exact to its tolerance, which at the kink of a
    /// valve may be on the other side of it, from where no step however short finds back.
    fn settle(&mut self, done: f64) {
        self.at(done);
        let Task { network, theta, .. } = self.task;
        let x = self.z[..network.circuit.n_state].to_vec();
        let given = Given { x: &x, theta, signals: &self.signals, slopes: self.span.slopes };
        network.companion.variables(&x, &network.solve(given), &mut self.z);
    }

    /// One attempt at a step of length `h`; gives its error in units of the tolerance.
    fn attempt(&mut self, done: f64, h: f64) -> f64 {
        let Task { network, theta, .. } = self.task;
        let (equations, circuit) = (&network.companion, &network.circuit);
        let n = self.z.len();
        let n_state = circuit.n_state;
        let slopes = self.span.slopes;
        let least = self.least;
        self.at(done);
        let moment = Moment { theta, signals: &self.signals, rates: &self.rates, slopes, least };
        let offsets = [&self.offsets[..], &self.offset_rates];
        equations.in_time(circuit, moment, offsets, &self.z, &mut self.in_time);
        if !equations.factorise(circuit, moment, &self.offsets, &self.z, GAMMA * h, &mut self.factors) {
            return f64::NAN;
        }
        for i in 0..STAGES {
            if i > 0 {
                self.at(done + ALPHA[i] * h);
            }
            let (before, here) = self.stages.split_at_mut(i * n);
            let here = &mut here[..n];
            self.new.copy_from_slice(&self.z);
            for (k, a) in before.chunks_exact(n).zip(A[i]) {
                self.new.iter_mut().zip(k).for_each(|(new, k)| *new += a * k);
            }
            let moment = Moment { theta, signals: &self.signals, rates: &self.rates, slopes, least };
            equations.evaluate(circuit, moment, &self.offsets, &self.new, here);
            for (here, rate) in here.iter_mut().zip(&self.in_time) {
                *here += TIME[i] * h * rate;
            }
            for (k, c) in before.chunks_exact(n).zip(C[i]) {
                here.iter_mut().zip(k).take(n_state).for_each(|(here, k)| *here += c / h * k);
            }
            equations.solve(circuit, &self.factors, here);
        }
        let error = &self.stages[(STAGES - 1) * n..];
        self.new.iter_mut().zip(error).for_each(|(new, e)| *new += e);
        self.error(&error[..n_state])
    }

    /// Root mean square of errors in units of the tolerance: each relative to its state, which counts as no smaller than a part of
    /// the largest of its kind.
    fn error(&self, error: &[f64]) -> f64 {
        if !self.new.iter().all(|v| v.is_finite()) {
            return f64::NAN;
        }
        let size = |at: usize| self.z[at].abs().max(self.new[at].abs());
        // Pressures and flows beside the state count too, so that a flow that begins at zero has a size.
        let (pressures, flows) = self.task.network.companion.beside(&self.z);
        let most = |values: &[f64]| values.iter().fold(f64::MIN_POSITIVE, |most: f64, v| most.max(v.abs()));
        let mut largest = [most(pressures), most(flows), f64::MIN_POSITIVE];
        for (at, state) in self.task.states.iter().enumerate() {
            let most = &mut largest[kind(state.role)];
            *most = most.max(size(at));
        }
        let scaled = error.iter().zip(self.task.states).enumerate().map(|(at, (error, state))| {
            let size = size(at).max(SMALL * largest[kind(state.role)]);
            (error / (self.task.tolerance * size)).powi(2)
        });
        (scaled.sum::<f64>() / error.len().max(1) as f64).sqrt()
    }

    /// Why no step could be made.
    fn failure(&self, time: f64, step: f64) -> ModelFailure {
        let found = self.new.iter().take(self.task.states.len()).position(|v| !v.is_finite());
        match found {
            Some(at) => ModelFailure::NotFinite { what: self.task.states[at].name.clone(), time },
            None => ModelFailure::StepTooSmall { time, step },
        }
    }
}

/// Kinds of states that are measured in one unit.
fn kind(role: Role) -> usize {
    match role {
        Role::Pressure => 0,
        Role::Flow => 1,
        _ => 2,
    }
}

/// θ without the constant levels of sources, whose rates are zero.
fn constant_free(network: &Network, theta: &[f64]) -> Vec<f64> {
    let mut rates = theta.to_vec();
    network.circuit.constant_levels().for_each(|at| rates[at] = 0.0);
    rates
}
