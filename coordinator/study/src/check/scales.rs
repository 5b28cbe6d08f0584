//! Numbers of built-in effects that do not count in the model's units but in the course of a quantity, the length of a
//! recording or its sampling interval.
//!
//! They become numbers of the model once, before anything is run with the effect. Where one counts on a course, the model is
//! run without such effects at the prior medians. A range on a course limits where a search looks, not what is physically
//! possible: it gives the default of a parameter without a value; a value outside of it is accepted with a warning. Next file
//! to read: [`starlings_models::effect::scale`].

use std::collections::BTreeMap;
use std::sync::Arc;

use starlings_models::effect::{EffectParameter, Scale, names, scale};
use starlings_models::units::spaced;
use starlings_models::{
    BuildSetup, EffectDef, Job, ObserverDef, ParticleError, SOLVER, Setup, SetupError, Spec, Stop, Until,
    Window,
};
use starlings_proto::spent::spent;

use super::built::CheckedModel;
use super::model;
use super::prior;
use super::relative::{OPEN, relative};
use crate::checked::{Record, StudyParameter};
use crate::expand::INITIAL;
use crate::field::quantity_of;
use crate::file::StudyFile;
use crate::plan::training_rows;
use crate::problem::Source;
use crate::solver_host::SolverHost;

/// The scales in which numbers of effects count.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Ruler {
    /// The smallest and the largest value of each scalar state, output and input.
    courses: BTreeMap<String, [f64; 2]>,
    /// The first and the last time.
    record: [f64; 2],
    /// Interval between observations.
    sampling: f64,
}

/// A run of the model without the effects to be measured: its times and inputs, and the values of [`Setup::parameters`].
pub(crate) struct Trial<'a> {
    pub(crate) record: &'a Record,
    pub(crate) times: Vec<f64>,
    pub(crate) theta: Vec<f64>,
}

/// Why there are no courses.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CourseError {
    #[error(transparent)]
    Setup(#[from] SetupError),
    #[error(transparent)]
    Run(#[from] ParticleError),
}

impl Ruler {
    /// Measures the scales that the effects of this setup need. The sampling is that of the first trial; without a trial no
    /// scale is known.
    ///
    /// # Errors
    /// When the model without these effects does not build or run.
    pub(crate) fn new(
        setup: &Setup,
        trials: &[Trial<'_>],
        solver_host: &SolverHost,
    ) -> Result<Self, CourseError> {
        let times = || trials.iter().flat_map(|trial| trial.times.iter().copied());
        let record = [times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max)];
        let mut steps: Vec<f64> =
            trials.first().map(|t| t.times.windows(2).map(|w| w[1] - w[0]).collect()).unwrap_or_default();
        steps.sort_by(f64::total_cmp);
        let sampling = steps.get(steps.len() / 2).copied().unwrap_or(1.0);
        let on_course = relative(&setup.effects).any(|p| is_on_course(&p.scale));
        let courses = if on_course { courses(setup, trials, solver_host)? } else { BTreeMap::new() };
        Ok(Self { courses, record, sampling })
    }

    /// The effect with ranges and grids in the model's units, as a search uses them.
    fn as_searched(&self, def: &EffectDef) -> EffectDef {
        scale::in_units(def, &|name| self.courses.get(name).copied(), self.record, self.sampling)
    }

    /// The effect in the model's units: what counts on a course, or is no unknown to a search, may have any value.
    pub(crate) fn in_units(&self, def: &EffectDef) -> EffectDef {
        let mut found = self.as_searched(def);
        for (parameter, written) in found.parameters.iter_mut().zip(&def.parameters) {
            let [lo, hi] = written.range;
            if is_on_course(&written.scale) || (written.scale != Scale::Absolute && lo >= hi) {
                parameter.range = OPEN;
            }
        }
        found
    }
}

fn is_on_course(scale: &Scale) -> bool {
    matches!(scale, Scale::Range(_) | Scale::Amplitude(_))
}

/// The model without the effects that are to be measured, and without the values that only they use.
fn bare(setup: &Setup) -> Result<Setup, SetupError> {
    let mut bare = setup.clone();
    bare.observer = ObserverDef::default();
    bare.effects.retain(|effect| relative(std::slice::from_ref(effect)).next().is_none());
    let spec = bare.model()?.spec().clone();
    let in_terms = names(&bare.effects)?;
    let known = |name: &String| {
        name.starts_with(INITIAL) || quantity_of(&spec.parameters, name).is_some() || in_terms.contains(name)
    };
    bare.parameters.retain(known);
    bare.model.constants.retain(|name, _| known(name));
    bare.outputs = scalars(&spec, bare.model.kind == SOLVER);
    Ok(bare)
}

/// Names of everything that one row can record: outputs, then states, which no solver is asked for.
fn scalars(spec: &Spec, is_solver: bool) -> Vec<String> {
    let outputs = spec.outputs.iter().filter(|q| q.size == 1);
    let own = |name: &str| !spec.outputs.iter().any(|output| output.name == name);
    let states = spec.states.iter().filter(|q| !is_solver && q.size == 1 && own(&q.name));
    outputs.chain(states).map(|q| q.name.clone()).collect()
}

/// The smallest and the largest value of every scalar over these runs.
fn courses(
    setup: &Setup,
    trials: &[Trial<'_>],
    solver_host: &SolverHost,
) -> Result<BTreeMap<String, [f64; 2]>, CourseError> {
    let bare = bare(setup)?;
    let model = solver_host.build(&bare)?;
    let kept: Vec<bool> = setup.parameters.iter().map(|name| bare.parameters.contains(name)).collect();
    let mut courses: BTreeMap<String, [f64; 2]> = BTreeMap::new();
    let mut widen = |name: &str, value: f64| {
        let [lo, hi] = courses.entry(name.to_owned()).or_insert([f64::INFINITY, f64::NEG_INFINITY]);
        (*lo, *hi) = (lo.min(value), hi.max(value));
    };
    for (index, trial) in trials.iter().enumerate() {
        let n_obs = bare.outputs.len();
        let window =
            Window::free(trial.record.start, trial.times.clone(), n_obs, trial.record.inputs.clone());
        let theta = trial.theta.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(v, _)| *v).collect();
        let job = Job { particle: 0, record: index as u32, window: Arc::new(window), theta, state: None };
        let outputs = model
            .run_within(&job, &Until { spent: &spent(), stop: &Stop::default(), traceparent: None })?
            .outputs;
        for row in outputs.chunks(n_obs.max(1)) {
            bare.outputs.iter().zip(row).for_each(|(name, value)| widen(name, *value));
        }
        for (input, signal) in model.spec().inputs.iter().zip(&trial.record.inputs) {
            trial.times.iter().for_each(|t| widen(&input.name, signal.at(*t)));
        }
    }
    Ok(courses)
}

/// Brings the effects of the model into its units, and checks the values of their parameters.
pub(crate) fn check(
    source: &Source,
    file: &StudyFile,
    model: &mut CheckedModel,
    (parameters, records): (&[StudyParameter], &[Record]),
    solver_host: &SolverHost,
    warnings: &mut Vec<String>,
) {
    let relative: Vec<EffectParameter> = relative(&model.setup.effects).cloned().collect();
    if relative.is_empty() {
        return;
    }
    let trials: Vec<Trial<'_>> = records
        .iter()
        .enumerate()
        .filter(|(_, record)| record.is_trained())
        .map(|(i, record)| Trial {
            record,
            times: training_rows(record).into_iter().map(|row| record.times[row]).collect(),
            theta: parameters.iter().map(|p| p.transform.to_physical(p.prior_mean[i])).collect(),
        })
        .collect();
    // Where the model fails no course is known, and a parameter that counts on one needs a value.
    let ruler = Ruler::new(&model.setup, &trials, solver_host).unwrap_or_else(|error| {
        warnings.push(format!("the model does not run at the prior medians: {error}"));
        Ruler::new(&Setup::default(), &trials, solver_host).unwrap_or_default()
    });
    let searched: Vec<EffectDef> = model.setup.effects.iter().map(|e| ruler.as_searched(e)).collect();
    model.setup.effects = model.setup.effects.iter().map(|e| ruler.in_units(e)).collect();
    let Some(spec) = model::spec(source, file, &model.setup) else { return };
    model.spec = spec;
    let is_relative = |name: &str| relative.iter().any(|p| p.name == name);
    model::check_values(source, file, model, &is_relative);
    for section in file.parameters.iter().filter(|p| is_relative(p.name.get_ref())) {
        let name = section.name.get_ref();
        let quantity = quantity_of(&model.spec.parameters, name);
        let prior = prior::prior(source, section, quantity);
        warnings.extend(prior.zip(quantity).and_then(|(prior, q)| prior::reach_warning(name, &prior, q)));
    }
    let on_course: Vec<&EffectParameter> = relative.iter().filter(|p| is_on_course(&p.scale)).collect();
    warnings.extend(on_course.iter().filter_map(|written| {
        let found = searched.iter().flat_map(|e| &e.parameters).find(|p| p.name == written.name)?;
        elsewhere(file, written, found)
    }));
}

/// A warning about a value that a study gives to a parameter far from the course of the quantity that it counts on.
fn elsewhere(file: &StudyFile, written: &EffectParameter, found: &EffectParameter) -> Option<String> {
    let name = &written.name;
    let constant = file.model.constants.iter().find(|(n, _)| n.get_ref() == name).map(|(_, v)| *v.get_ref());
    let median = file.parameters.iter().find(|p| p.name.get_ref() == name);
    let (what, value) = match (constant, median.and_then(|p| p.prior.middle())) {
        (Some(value), _) => ("constant", value),
        (None, Some(median)) => ("the prior median of", *median.get_ref()),
        (None, None) => return None,
    };
    let ([lo, hi], Scale::Range(of) | Scale::Amplitude(of)) = (found.range, &written.scale) else {
        return None;
    };
    let beyond = found.scale == Scale::Absolute && lo < hi && !(lo..=hi).contains(&value);
    beyond.then(|| {
        let unit = spaced(&written.unit);
        format!(
            "{what} `{name}` is {value}{unit}, and a search would look from {lo:.4} to {hi:.4}: it counts on the course of \
             `{of}` in a run at the prior medians."
        )
    })
}
