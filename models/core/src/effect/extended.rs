//! A model with effects, itself a model.
//!
//! The effects' states follow the model's states and their parameters follow its parameters. The model sees the inputs with the
//! effects' additions, except through `delay`, which reads the record, and so do terms that add to outputs; other terms see the
//! recorded inputs. Parameters of the model stand in terms with their plain values; the model sees the shifted ones, in its
//! rates, outputs, switches and memories, so that an output in a term is that of the shifted model, before any term is added to
//! it; where it starts follows from the plain values, because there is no state yet that a term could read. Where effects only add to
//! outputs, or shift parameters by what does not change during a run, the model keeps its own step, so that its states are
//! those of the model alone to the last bit. A parameter that a term drives out of its range may leave the model without a
//! finite rate: the run then fails as any other. An output goes on measuring the
//! state that it measured, for observers, though a term may bend the relation between the two. Next file to read: [`mod@super::library`].

use std::collections::BTreeMap;

use super::extended_spec::extended_spec;
use super::scope::{Reach, Scope, note_memories};
use super::{Effect, EffectDef, Moment, TermEffect, Touches};
use crate::SetupError;
use crate::blocks::Sections;
use crate::equations::Slot;
use crate::integrate::Solver;
use crate::scratch::Scratch;
use crate::segment::{Drive, Segment};
use crate::slopes::Slopes;
use crate::{Blocks, Memory, Model, ModelFailure, Spec, advance_by};

/// A model and the effects added to it.
pub struct Extended {
    inner: Box<dyn Model>,
    effects: Vec<Box<dyn Effect>>,
    spec: Spec,
    touches: Touches,
    /// State components and parameters of the inner model.
    n_state: usize,
    n_param: usize,
    /// The inner model's memories, then those that only effects read.
    memories: Vec<Memory>,
    /// For each of the latter, the state or output that it remembers.
    sources: Vec<Slot>,
}

impl Extended {
    /// Adds effects, written out, to a model. `constants` are values that terms may use besides the model's parameters.
    ///
    /// # Errors
    /// When a name is given twice or an effect does not fit the model.
    pub fn new(
        inner: Box<dyn Model>,
        defs: &[EffectDef],
        constants: &BTreeMap<String, f64>,
    ) -> Result<Self, SetupError> {
        let spec = extended_spec(inner.spec(), defs)?;
        let mut memories = inner.memories().to_vec();
        let n_own = inner.spec().parameters.len();
        let n_inner = memories.len();
        for def in defs {
            note_memories(def, Scope { spec: &spec, constants, memories: &[], n_own }, &mut memories)?;
        }
        let scope = Scope { spec: &spec, constants, memories: &memories, n_own };
        let sources =
            memories[n_inner..].iter().filter_map(|memory| scope.slot(&memory.of, Reach::All)).collect();
        let mut effects: Vec<Box<dyn Effect>> = Vec::with_capacity(defs.len());
        for def in defs {
            effects.push(Box::new(TermEffect::new(def, scope)?));
        }
        let touches = effects.iter().fold(Touches::default(), |all, effect| all.or(effect.touches()));
        let n_state = inner.spec().n_state();
        Ok(Self { inner, effects, spec, touches, n_state, n_param: n_own, memories, sources })
    }

    /// The inner model's outputs as it shows them with the inputs and parameters that it sees, where a term reads them;
    /// nothing is added to them yet. `rate` is the extended state's rate, or empty.
    fn inner_outputs(&self, at: Moment<'_>, rate: &[f64]) -> Scratch {
        let mut y = Scratch::new(if self.touches.reads_outputs { self.spec.n_output() } else { 0 });
        if self.touches.reads_outputs {
            let x = &at.x[..self.n_state];
            self.with_both(at, rate, |theta, u| self.inner.output(at.t, x, theta, u, y.as_mut()));
        }
        y
    }

    /// The inner model's outputs where a term reads them, and the state's rate where an input's slope needs it.
    fn outputs_and_rate(&self, at: Moment<'_>) -> (Scratch, Scratch) {
        // A rate may read outputs and an output the slope of an input that follows a state: the rate is found with that slope
        // as far as it does not follow states, as everywhere.
        let y = self.inner_outputs(at, &[]);
        let rate = self.rate_for_slopes(Moment { y: y.as_ref(), ..at });
        let y = if self.touches.inputs_follow_states { self.inner_outputs(at, rate.as_ref()) } else { y };
        (y, rate)
    }

    /// Calls `use_inputs` with the inputs as the inner model sees them. `rate` is the extended state's rate, or empty.
    fn with_inputs(&self, at: Moment<'_>, rate: &[f64], use_inputs: impl FnOnce(Drive<'_>)) {
        if !self.touches.inputs {
            return use_inputs(at.u);
        }
        let (mut value, mut slope) = (Scratch::of(at.u.value), Scratch::of(at.u.slope));
        for effect in &self.effects {
            effect.add_to_inputs(at, rate, value.as_mut(), slope.as_mut());
        }
        use_inputs(Drive { value: value.as_ref(), slope: slope.as_ref(), history: at.u.history });
    }

    /// Calls `use_parameters` with the inner model's parameters as it sees them.
    fn with_parameters<R>(&self, at: Moment<'_>, use_parameters: impl FnOnce(&[f64]) -> R) -> R {
        let plain = &at.theta[..self.n_param];
        if !self.touches.parameters {
            return use_parameters(plain);
        }
        let mut theta = Scratch::of(plain);
        for effect in &self.effects {
            effect.add_to_parameters(at, theta.as_mut());
        }
        use_parameters(theta.as_ref())
    }

    /// As [`Extended::with_parameters`], where no term uses anything that changes during a run.
    fn with_fixed_parameters<R>(&self, theta: &[f64], use_parameters: impl FnOnce(&[f64]) -> R) -> R {
        self.with_parameters(Moment { t: 0.0, x: &[], theta, u: Drive::NONE, y: &[] }, use_parameters)
    }

    /// Calls `use_both` with the inputs and the parameters as the inner model sees them.
    fn with_both(&self, at: Moment<'_>, rate: &[f64], use_both: impl FnOnce(&[f64], Drive<'_>)) {
        self.with_parameters(at, |theta| self.with_inputs(at, rate, |u| use_both(theta, u)));
    }

    /// The rate of the extended state, with the inputs' slopes as far as `rate` tells the state's part of them.
    fn rate(&self, at: Moment<'_>, rate: &[f64], dx: &mut [f64]) {
        let x = &at.x[..self.n_state];
        let (inner, own) = dx.split_at_mut(self.n_state);
        self.with_both(at, rate, |theta, u| self.inner.rhs(at.t, x, theta, u, inner));
        own.fill(0.0);
        for effect in &self.effects {
            effect.add_to_rates(at, dx);
        }
    }

    /// The rate of the state where an input's slope needs it, else nothing.
    fn rate_for_slopes(&self, at: Moment<'_>) -> Scratch {
        let mut rate = Scratch::new(if self.touches.inputs_follow_states { at.x.len() } else { 0 });
        if self.touches.inputs_follow_states {
            self.rate(at, &[], rate.as_mut());
        }
        rate
    }
}

impl Model for Extended {
    fn slopes(&self) -> Result<&dyn Slopes, String> {
        Err("it has effects, whose derivatives are not known".to_owned())
    }

    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, theta: &[f64], x: &mut [f64]) {
        let (inner, own) = x.split_at_mut(self.n_state);
        self.inner.initial(&theta[..self.n_param], inner);
        own.fill(0.0);
        for effect in &self.effects {
            effect.initial(theta, x);
        }
    }

    fn rhs(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        let at = Moment { t, x, theta, u, y: &[] };
        if !self.touches.reads_outputs && !self.touches.inputs_follow_states {
            return self.rate(at, &[], dx);
        }
        let (y, rate) = self.outputs_and_rate(at);
        self.rate(Moment { y: y.as_ref(), ..at }, rate.as_ref(), dx);
    }

    fn output(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, y: &mut [f64]) {
        let at = Moment { t, x, theta, u, y: &[] };
        let (inner, rate) = self.outputs_and_rate(at);
        let inner_x = &x[..self.n_state];
        self.with_both(at, rate.as_ref(), |theta, u| self.inner.output(t, inner_x, theta, u, y));
        self.with_inputs(at, rate.as_ref(), |u| {
            for effect in &self.effects {
                effect.add_to_outputs(Moment { u, y: inner.as_ref(), ..at }, y);
            }
        });
    }

    /// Those of the inner model: its states come first, and what effects add is a load, or shifts its parameters.
    fn blocks(&self, theta: &[f64]) -> Option<Blocks> {
        if self.touches.parameters_vary {
            return self.inner.blocks(&theta[..self.n_param]);
        }
        self.with_fixed_parameters(theta, |theta| self.inner.blocks(theta))
    }

    fn sections(&self, theta: &[f64]) -> Option<Sections> {
        if self.touches.parameters_vary {
            return self.inner.sections(&theta[..self.n_param]);
        }
        self.with_fixed_parameters(theta, |theta| self.inner.sections(theta))
    }

    fn solver(&self) -> Solver {
        self.inner.solver()
    }

    fn n_noise(&self) -> usize {
        self.inner.n_noise()
    }

    fn noise(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, b: &mut [f64]) {
        let at = Moment { t, x, theta, u, y: &[] };
        let (y, rate) = self.outputs_and_rate(at);
        let at = Moment { y: y.as_ref(), ..at };
        let (n, inner_x) = (self.n_state, &x[..self.n_state]);
        let mut inner = Scratch::new(n * self.inner.n_noise());
        self.with_both(at, rate.as_ref(), |theta, u| self.inner.noise(t, inner_x, theta, u, inner.as_mut()));
        // States of effects have no noise.
        b.fill(0.0);
        for (b, inner) in b.chunks_exact_mut(x.len()).zip(inner.as_ref().chunks_exact(n)) {
            b[..n].copy_from_slice(inner);
        }
    }

    fn n_switch(&self) -> usize {
        self.inner.n_switch() + self.effects.iter().map(|effect| effect.n_switch()).sum::<usize>()
    }

    fn switches(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, g: &mut [f64]) {
        let at = Moment { t, x, theta, u, y: &[] };
        let (y, rate) = self.outputs_and_rate(at);
        let at = Moment { y: y.as_ref(), ..at };
        let (inner, mut rest) = g.split_at_mut(self.inner.n_switch());
        let inner_x = &x[..self.n_state];
        self.with_both(at, rate.as_ref(), |theta, u| self.inner.switches(t, inner_x, theta, u, inner));
        for effect in &self.effects {
            let (own, others) = rest.split_at_mut(effect.n_switch());
            effect.switches(at, own);
            rest = others;
        }
    }

    fn memories(&self) -> &[Memory] {
        &self.memories
    }

    fn remembered(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, values: &mut [f64]) {
        let at = Moment { t, x, theta, u, y: &[] };
        let (y, rate) = self.outputs_and_rate(at);
        let (inner, own) = values.split_at_mut(values.len() - self.sources.len());
        let inner_x = &x[..self.n_state];
        self.with_both(at, rate.as_ref(), |theta, u| self.inner.remembered(t, inner_x, theta, u, inner));
        for (value, source) in own.iter_mut().zip(&self.sources) {
            *value = match *source {
                Slot::State(i) => x[i],
                Slot::Output(i) => y.as_ref()[i],
                _ => f64::NAN,
            };
        }
    }

    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        let Touches { rates, inputs, parameters_vary, .. } = self.touches;
        if rates || inputs || parameters_vary {
            return advance_by(self, self.solver(), segment, theta, x);
        }
        self.with_fixed_parameters(theta, |theta| self.inner.advance(segment, theta, x))
    }
}
