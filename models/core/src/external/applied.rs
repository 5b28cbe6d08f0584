//! Effects applied to signals: the inputs that another program is given, or the outputs that it gave.
//!
//! The signals are replayed through a model that only shows them, with the effects added to it, so that lags, delays and drifts
//! mean what they mean everywhere. Between samples the signals are linear. Next file to read: [`super::replay`].

use std::collections::BTreeMap;
use std::sync::Arc;

use super::replay::Replay;
use crate::SetupError;
use crate::effect::Extended;
use crate::setup::Setup;
use crate::{
    EffectDef, Forward, Job, Model, NativeModels, ParticleError, Prediction, Simulator, Spec, StateValues,
    Window,
};

/// Effects on signals, ready to run.
pub(super) struct Applied {
    simulator: Simulator,
    /// Where its parameters stand among those of the whole.
    places: Vec<usize>,
}

impl Applied {
    /// Adds effects to a replay; `whole` is the specification with all effects, `constants` what the study fixes.
    ///
    /// # Errors
    /// When an effect does not fit.
    pub(super) fn new(
        replay: Replay,
        effects: Vec<EffectDef>,
        whole: &Spec,
        constants: &BTreeMap<String, f64>,
    ) -> Result<Self, SetupError> {
        let shown: Vec<String> = replay.spec().outputs.iter().map(|q| q.name.clone()).collect();
        let model = Extended::new(Box::new(replay), &effects, constants)?;
        let parameters: Vec<String> = model.spec().parameters.iter().map(|q| q.name.clone()).collect();
        let place = |name: &String| whole.parameters.iter().position(|q| q.name == *name);
        let places = parameters.iter().filter_map(place).collect();
        let mut setup = Setup { outputs: shown, effects, ..Setup::default() };
        setup.model.constants = constants
            .iter()
            .filter(|(name, _)| !parameters.contains(name))
            .map(|(k, v)| (k.clone(), *v))
            .collect();
        setup.model.constants.retain(|name, _| !name.starts_with("initial:"));
        setup.parameters = parameters;
        Ok(Self { simulator: Simulator::new(Box::new(model), &setup, NativeModels::NONE)?, places })
    }

    /// Number of values that it carries from window to window.
    pub(super) fn n_state(&self) -> usize {
        self.simulator.spec().n_state()
    }

    /// Runs the signals of a window through the effects; `theta` are the parameters of the whole.
    ///
    /// # Errors
    /// When a term gives no finite number.
    pub(super) fn run(
        &self,
        theta: &[f64],
        window: Window,
        state: Option<Vec<f64>>,
    ) -> Result<Prediction, ParticleError> {
        let theta = self.places.iter().map(|i| theta[*i]).collect();
        self.simulator.run(&Job {
            particle: 0,
            record: 0,
            window: Arc::new(window),
            theta,
            state: state.map(StateValues::from),
        })
    }
}

/// Times at which inputs with effects are sampled: those of the inputs and of the observations, and three between each pair.
pub(super) fn grid(window: &Window) -> Vec<f64> {
    let end = window.times.last().copied().unwrap_or(window.start);
    let of_inputs = window.inputs.iter().flat_map(|signal| signal.times.iter().copied());
    let inside = of_inputs.filter(|t| *t > window.start && *t < end);
    let mut knots: Vec<f64> = inside.chain(window.times.iter().copied()).chain([window.start]).collect();
    knots.sort_by(f64::total_cmp);
    knots.dedup();
    let between =
        knots.windows(2).flat_map(|pair| (0..4).map(|i| pair[0] + (pair[1] - pair[0]) * f64::from(i) / 4.0));
    let mut times: Vec<f64> = between.chain(knots.last().copied()).collect();
    times.dedup();
    times
}
