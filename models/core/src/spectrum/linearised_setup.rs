//! One setup, linearised where its runs start, under every observer that it can host.
//!
//! It keeps the observed outputs of the setup: a setup that observes half a wall shows partial observation. Next file to read: [`mod@super::observed`].

mod own;

use nalgebra::{Complex, DMatrix};

use super::component::ROUNDING;
use super::coordinates::Energy;
use super::gain::{Best, GainCurve};
use super::linearise::linearisation_at;
use super::observed::{Feedback, ObservedSystem};
use super::sensitivity::{Slope, slopes};
use super::{Decay, Follower, SpectrumError};
use crate::binding::Binding;
use crate::memory::with_memories;
use crate::observer::{self, Wiring};
use crate::simulator::free_names;
use crate::{Model, NativeModels, ObserverDef, Setup, SetupError, Spec};

/// A setup at given parameter values, linearised where its runs start.
pub struct LinearisedSetup {
    model: Box<dyn Model>,
    spec: Spec,
    theta: Vec<f64>,
    outputs: Vec<String>,
    observer: ObserverDef,
    /// A in energy coordinates, where the model has any.
    a: DMatrix<f64>,
    energy: Option<Energy>,
    poles: Vec<Complex<f64>>,
    native: NativeModels,
}

/// What one observer does to the poles.
#[derive(Clone, Debug)]
pub struct ObserverSpectrum {
    /// Kind of the observer.
    pub name: String,
    /// What its poles stand for where that is not plain ([`observer::Observer::note`]).
    pub note: Option<&'static str>,
    /// Gains that were asked for, in 1/time.
    pub gain: Vec<f64>,
    /// Largest real part at each of them, in 1/time.
    pub max_re: Vec<f64>,
    /// ∂λ/∂γ of the listed poles.
    pub slopes: Vec<Slope>,
    /// The largest real part over a wide range of gains.
    pub curve: GainCurve,
    /// The fastest decay.
    pub best: Best,
    /// The smallest gain with the wanted decay; `None` where none was wanted or no gain gives it.
    pub gain_for_decay: Option<f64>,
    /// The matrices, for any other gain.
    pub system: ObservedSystem,
}

impl LinearisedSetup {
    /// A setup and its model, effects included, at values of the setup's parameters, in their order. `native` are the models
    /// among which an observer that does not fit names those that it does.
    ///
    /// # Errors
    /// When a name of the setup is unknown, or the model cannot be linearised where its runs start.
    pub fn new(
        model: Box<dyn Model>,
        setup: &Setup,
        values: &[f64],
        native: NativeModels,
    ) -> Result<Self, SpectrumError> {
        let (theta, x) = start(setup, &*model, values)?;
        let a = linearisation_at(&*model, &theta, &x)?;
        let energy = model.blocks(&theta).and_then(|blocks| Energy::new(&blocks));
        let a = energy.as_ref().map_or_else(|| a.clone(), |energy| energy.of(&a));
        let none = Feedback::none(a.nrows());
        Ok(Self {
            poles: ObservedSystem::new(&a, &none, if energy.is_some() { ROUNDING } else { 0.0 })?
                .poles(0.0)?,
            spec: model.spec().clone(),
            model,
            theta,
            outputs: setup.outputs.clone(),
            observer: setup.observer.clone(),
            a,
            energy,
            native,
        })
    }

    /// The poles without observer, sorted by modulus, then by imaginary part.
    pub fn poles(&self) -> &[Complex<f64>] {
        &self.poles
    }

    /// The error of the state under an observer, for any gain.
    ///
    /// # Errors
    /// When the model cannot host the observer with the observed outputs, or the poles are not found.
    pub fn observed(&self, kind: &str) -> Result<ObservedSystem, SpectrumError> {
        let at = |gain| Ok::<_, SetupError>(self.feedback(&*self.build(kind, gain)?));
        let feedback =
            Feedback::of(at)?.ok_or_else(|| SpectrumError::NotPolynomial { observer: kind.to_owned() })?;
        ObservedSystem::new(&self.a, &feedback, self.negligible())
    }

    /// What an observer does: at the given gains, to the first `listed` poles, and at best.
    ///
    /// # Errors
    /// When the model cannot host the observer with the observed outputs, a gain is too large, or the poles are not found.
    pub fn examine(
        &self,
        kind: &str,
        gains: &[f64],
        listed: usize,
        decay: Option<Decay>,
    ) -> Result<ObserverSpectrum, SpectrumError> {
        let system = self.observed(kind)?;
        gains.iter().try_for_each(|&gain| system.check_gain(gain))?;
        let curve = GainCurve::scan(&system)?;
        let best = curve.best(&system)?;
        let gain_for_decay = match decay {
            Some(decay) => curve.gain_for(&system, best, decay.max_re())?,
            None => None,
        };
        Ok(ObserverSpectrum {
            name: kind.to_owned(),
            note: self.build(kind, 1.0)?.note(),
            gain: gains.to_vec(),
            max_re: gains.iter().map(|&gain| system.max_re(gain)).collect::<Result<_, _>>()?,
            slopes: slopes(&system, &self.poles[..listed.min(self.poles.len())])?,
            curve,
            best,
            gain_for_decay,
            system,
        })
    }

    /// Observers of the list with why the model cannot host them with these outputs, `none` left out; where the setup has several,
    /// those together come first, under their joined name.
    pub fn observers(&self) -> Vec<(String, Option<SetupError>)> {
        let own = (!self.observer.beside.is_empty()).then(|| self.observer.name());
        let kinds = observer::kinds().into_iter().map(|kind| kind.kind).filter(|kind| *kind != "none");
        let names = own.into_iter().chain(kinds.flat_map(|kind| self.of_kind(kind)));
        names.map(|name| (name.clone(), self.build(&name, 1.0).err())).collect()
    }

    /// Gains around the poles, 0 first, then 1, 2 and 5 of every decade from a tenth of the slowest to ten times the fastest
    /// of the first `listed` poles.
    pub fn usual_gains(&self, listed: usize) -> Vec<f64> {
        let moduli = self.poles.iter().take(listed).map(|p| p.norm()).filter(|m| *m > 0.0);
        let (lo, hi) = moduli.fold((f64::INFINITY, 0.0_f64), |(lo, hi), m| (lo.min(m), hi.max(m)));
        let (lo, hi) = if hi > 0.0 { (0.1 * lo.max(1e-6 * hi), 10.0 * hi) } else { (0.1, 10.0) };
        let decades = lo.log10().floor() as i32..=hi.log10().ceil() as i32;
        let nice = decades.flat_map(|d| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(d)));
        std::iter::once(0.0).chain(nice.filter(|gain| (lo..=hi).contains(gain))).collect()
    }

    /// The coupling that is rounding.
    fn negligible(&self) -> f64 {
        if self.energy.is_some() { ROUNDING } else { 0.0 }
    }

    fn build(&self, kind: &str, gain: f64) -> Result<Box<dyn observer::Observer>, SetupError> {
        observer::build(&self.def(kind, gain), self.wiring())
    }

    fn wiring(&self) -> Wiring<'_> {
        let (spec, outputs, model, theta) = (&self.spec, &self.outputs[..], &*self.model, &self.theta[..]);
        Wiring { spec, outputs, model, theta, native: self.native }
    }

    fn feedback(&self, observer: &dyn observer::Observer) -> DMatrix<f64> {
        let feedback = observer.feedback(&*self.model, &self.theta);
        self.energy.as_ref().map_or_else(|| feedback.clone(), |energy| energy.of(&feedback))
    }
}

/// The model's parameters, at values of the setup's, and the state in which its runs start.
///
/// # Errors
/// When a name of the setup is unknown, or the values are not as many as its parameters.
pub fn start(setup: &Setup, model: &dyn Model, values: &[f64]) -> Result<(Vec<f64>, Vec<f64>), SetupError> {
    let spec = with_memories(model.spec(), model.memories());
    let binding = Binding::new(setup, &spec, &free_names(setup, &spec)?)?;
    if values.len() != binding.len() {
        let (given, wanted) = (values.len(), binding.len());
        return Err(SetupError::Invalid(format!("{given} parameter values for {wanted} parameters")));
    }
    let theta = binding.theta(values, 0.0).map_err(|error| SetupError::Invalid(error.to_string()))?;
    let n_state = model.spec().n_state();
    let mut x = vec![0.0; spec.n_state()];
    model.initial(&theta, &mut x[..n_state]);
    binding.initial(values, &mut x);
    x.truncate(n_state);
    Ok((theta, x))
}

impl ObserverSpectrum {
    /// The first `listed` poles at every gain: `[pole][gain]`. The gains start at 0.
    ///
    /// # Errors
    /// When the poles are not found.
    pub fn locus(&self, gains: &[f64], listed: usize) -> Result<Vec<Vec<Complex<f64>>>, SpectrumError> {
        Follower::new(&self.system).follow(gains, listed)
    }
}
