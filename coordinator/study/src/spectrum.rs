//! The poles of a study's model under the observers that it can host: which are compared, at which gains, and what was found.
//!
//! The model stands at its prior medians, where its runs start. The arithmetic of poles is in `starlings_models::spectrum`;
//! how the result is shown is the caller's. Next file to read: `models/core/src/spectrum.rs`.

use starlings_models::catalogue::NATIVE;
use starlings_models::spectrum::{Decay, LinearisedSetup, ObserverSpectrum, SpectrumError};
use starlings_models::{BuildSetup, ObserverDef, SOLVER, observer};

use super::{Study, posterior};

/// Poles in the result where no number is asked for.
const LISTED: usize = 100;

/// The slowest poles that gains are chosen around where none are given.
const AROUND: usize = 16;

/// What is asked; what is left open is taken from the study's section `[spectrum]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wanted {
    /// Kinds of observers; empty for all that the model can host.
    pub observers: Vec<String>,
    /// Gains in 1/time; empty for a range around the poles.
    pub gains: Vec<f64>,
    /// The decay that is wanted.
    pub decay: Option<Decay>,
    /// How many of the slowest poles are listed; 100 without it.
    pub poles: Option<usize>,
}

/// The names of observers that a spectrum may be asked for: every kind, and several of a study one by one and by their joined name.
pub fn observer_names(own: &ObserverDef) -> Vec<String> {
    let mut names: Vec<String> = observer::kinds().iter().map(|k| k.kind.to_owned()).collect();
    if !own.beside.is_empty() {
        names.extend(own.names());
        names.push(own.name());
        names.sort();
        names.dedup();
    }
    names
}

/// What was found.
pub struct Spectrum {
    /// The linearised model without observer.
    pub linearised: LinearisedSetup,
    /// The decay that is wanted.
    pub decay: Option<Decay>,
    /// Poles listed, at most those that there are.
    pub listed: usize,
    /// One entry per observer, in the order asked for.
    pub observers: Vec<ObserverSpectrum>,
    /// Observers that the model cannot host, with the reason; empty where observers were asked for.
    pub refused: Vec<(String, String)>,
    /// The largest common factor on the gains of the study's own observers that is stable; `None` where they are stable together.
    pub stable_share: Option<f64>,
}

/// One listed pole at one gain.
#[derive(Clone, Debug, PartialEq)]
pub struct LocusPoint {
    /// The observer.
    pub observer: String,
    /// Its gain in 1/time.
    pub gain: f64,
    /// Largest real part of all poles at this gain, in 1/time.
    pub max_re: f64,
    /// Number of the pole, from 0, in the order without observer.
    pub pole: usize,
    /// Real part in 1/time.
    pub re: f64,
    /// Imaginary part in 1/time.
    pub im: f64,
}

/// Why there is no spectrum.
#[derive(Debug, thiserror::Error)]
pub enum ExamineError {
    /// The model has none, or cannot host an observer that was asked for.
    #[error(transparent)]
    Spectrum(#[from] SpectrumError),
    /// The model is a solver: its equations are not known.
    #[error("the model runs in a program of its own: its equations are not known, nor are its poles")]
    Solver,
    /// The examination of an observer panicked.
    #[error("the observer `{0}` could not be examined")]
    Broken(String),
}

/// Examines the observers of a study, each on a thread of its own.
///
/// # Errors
/// When the model cannot be linearised where its runs start, or cannot host an observer that was asked for.
pub fn examine(study: &Study, wanted: &Wanted) -> Result<Spectrum, ExamineError> {
    if study.setup.model.kind == SOLVER {
        return Err(ExamineError::Solver);
    }
    let medians = study.theta_for(0, posterior::prior(study).mean.as_slice());
    let model = study.setup.model().map_err(SpectrumError::from)?;
    let linearised = LinearisedSetup::new(model, &study.setup, &medians, NATIVE)?;
    let listed = wanted.poles.unwrap_or(LISTED).min(linearised.poles().len());
    let gains = gains(study, wanted, &linearised);
    let (kinds, refused) = kinds(study, wanted, &linearised);
    let decay = wanted.decay.or(study.spectrum.decay);
    let work = |kind: &String| linearised.examine(kind, &gains, listed, decay);
    let results: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = kinds.iter().map(|kind| scope.spawn(move || work(kind))).collect();
        threads.into_iter().map(std::thread::ScopedJoinHandle::join).collect()
    });
    let mut observers = Vec::with_capacity(results.len());
    for (kind, result) in kinds.iter().zip(results) {
        observers.push(result.map_err(|_| ExamineError::Broken(kind.clone()))??);
    }
    let several = !study.setup.observer.beside.is_empty();
    let stable_share = if several { linearised.stable_share()? } else { None };
    Ok(Spectrum { linearised, decay, listed, observers, refused, stable_share })
}

/// The gains that are asked for, else the study's, else a range around the poles.
fn gains(study: &Study, wanted: &Wanted, linearised: &LinearisedSetup) -> Vec<f64> {
    match (wanted.gains.is_empty(), study.spectrum.gains.is_empty()) {
        (false, _) => wanted.gains.clone(),
        (true, false) => study.spectrum.gains.clone(),
        (true, true) => linearised.usual_gains(AROUND),
    }
}

/// The observers to compare, each once, and those that the model cannot host, which are listed only where none is named. A
/// named observer that the model cannot host is an error later on.
fn kinds(
    study: &Study,
    wanted: &Wanted,
    linearised: &LinearisedSetup,
) -> (Vec<String>, Vec<(String, String)>) {
    let named = if wanted.observers.is_empty() { &study.spectrum.observers } else { &wanted.observers };
    let (mut kinds, mut refused) = (Vec::new(), Vec::new());
    if named.is_empty() {
        for (kind, why) in linearised.observers() {
            match why {
                None => kinds.push(kind),
                Some(why) => refused.push((kind, why.to_string())),
            }
        }
    }
    for kind in named.iter().flat_map(|kind| linearised.of_kind(kind)) {
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    (kinds, refused)
}

impl Spectrum {
    /// The listed poles at every gain: by observer, then by gain, then by pole. Each pole is followed from gain to gain from
    /// zero on, whatever the order of the gains.
    ///
    /// # Errors
    /// When poles are not found.
    pub fn locus(&self) -> Result<Vec<LocusPoint>, SpectrumError> {
        let mut points = Vec::new();
        for observer in &self.observers {
            let mut gains = observer.gain.clone();
            gains.push(0.0);
            gains.sort_by(f64::total_cmp);
            gains.dedup();
            let ways = observer.locus(&gains, self.listed)?;
            for (&gain, &max_re) in observer.gain.iter().zip(&observer.max_re) {
                let at = gains.iter().position(|g| g.to_bits() == gain.to_bits()).unwrap_or(0);
                points.extend(ways.iter().enumerate().map(|(pole, way)| LocusPoint {
                    observer: observer.name.clone(),
                    gain,
                    max_re,
                    pole,
                    re: way[at].re,
                    im: way[at].im,
                }));
            }
        }
        Ok(points)
    }
}
