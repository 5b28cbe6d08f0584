//! An ensemble that is run and told of, whoever drew its members: from the posterior of a run, or from that of an inference.
//!
//! Next files to read: `members.rs`, which runs it, and [`super::result`].

use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_estimators::Gaussian;
use starlings_estimators::forecast::{Crossings, Fan};
use starlings_fleet::Fleet;
use starlings_models::{Setup, Signal};

use super::measurement::{Errors, From};
use super::members::Members;
use super::own_errors::OwnErrors;
use super::result::{Band, Forecast, LevelForecast, OutputForecast};
use super::{Ask, StudyForecastError};
use crate::{Stage, Study, Work};

/// Stream of the seed that members are drawn with.
const DRAWS: u64 = 0;

/// The source of what members are drawn with.
pub fn draws(seed: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(DRAWS);
    rng
}

/// So many vectors from a posterior, in transformed units.
pub(crate) fn drawn(posterior: &Gaussian, n: usize, seed: u64) -> Vec<DVector<f64>> {
    let (mut rng, root) = (draws(seed), posterior.factor());
    let mut one = |_| {
        let z = DVector::from_fn(root.ncols(), |_, _| StandardNormal.sample(&mut rng));
        &posterior.mean + &root * z
    };
    (0..n).map(&mut one).collect()
}

/// What members are run with and what they are compared with.
#[derive(Clone, Debug)]
pub struct Ensemble {
    /// Number and name of the record.
    pub record: (u32, String),
    /// The model, with the outputs that are wanted.
    pub setup: Setup,
    /// Inputs, in the order of the model's.
    pub inputs: Vec<Signal>,
    /// Times of the predictions; members start at the first.
    pub times: Vec<f64>,
    /// Values of the setup's parameters, by member.
    pub members: Vec<Vec<f64>>,
    /// What is measured of every output of the setup; `None` of one that is not.
    pub measured: Vec<Option<MeasuredOutput>>,
    /// Last time of the record.
    pub measured_until: f64,
    /// By how many times the posterior is wider than at the stated noise, at the most, where that is known.
    pub wider: Option<f64>,
    /// What the bands are conditional on.
    pub conditional_on: String,
    /// What is doubtful, besides members without a prediction.
    pub warnings: Vec<String>,
}

/// Measured values of an output.
#[derive(Clone, Debug)]
pub struct MeasuredOutput {
    /// Errors of what would be measured.
    pub errors: Errors,
    /// The values, in the order of time.
    pub values: Vec<MeasuredValue>,
    /// Whether nothing was fitted of it, so that its own values tell more of its errors.
    pub never_fitted: bool,
}

/// One measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredValue {
    /// Its time.
    pub time: f64,
    /// The value.
    pub value: f64,
    /// Whether nothing was estimated from it.
    pub held_out: bool,
}

impl Ensemble {
    /// Runs the members and says what they make. `watch` hears of that as it begins.
    ///
    /// # Errors
    /// When the fleet fails, or no member has a prediction.
    pub fn forecast(
        self,
        study: &Study,
        fleet: &mut dyn Fleet,
        ask: &Ask,
        watch: &mut dyn FnMut(&Stage),
    ) -> Result<Forecast, StudyForecastError> {
        let n = self.members.len();
        let work = Work::of_runs(0.0, n as f64, n as f64);
        let says = format!("{n} members");
        watch(&Stage { name: "ensemble", says, runs: 0, workers: fleet.n_workers(), work });
        let members = Members::run(fleet, &self)?;
        let outputs = (0..self.setup.outputs.len()).map(|row| self.output(study, &members, ask.seed, row));
        let outputs = outputs.collect::<Result<Vec<_>, _>>()?;
        let levels = ask.thresholds.iter().map(|threshold| {
            let row = self.setup.outputs.iter().position(|name| *name == threshold.output);
            let courses = members.courses(row.unwrap_or_default());
            let crossings = Crossings::of(&self.times, &courses, threshold.level)?;
            Ok(LevelForecast::new(study, threshold, ask.horizon, crossings))
        });
        let levels = levels.collect::<Result<Vec<_>, StudyForecastError>>()?;
        let mut warnings = Vec::new();
        if let Some(reason) = &members.failure {
            warnings.push(format!(
                "{} of {} members have no prediction and are left out of every figure: {reason}",
                members.n_failed(),
                ask.members
            ));
        }
        warnings.extend(outputs.iter().filter_map(OutputForecast::says_what_no_fit_shows));
        warnings.extend(self.warnings);
        Ok(Forecast {
            study: study.name.clone(),
            model: study.setup.model.kind.clone(),
            record: self.record.1,
            time_unit: study.time_unit.clone(),
            from: self.times[0],
            measured_until: self.measured_until,
            until: self.times[self.times.len() - 1],
            members: ask.members,
            failed: members.n_failed(),
            seed: ask.seed,
            model_noise: self.setup.noise.is_some(),
            wider_given_residuals: self.wider,
            conditional_on: self.conditional_on,
            set: ask.values.clone(),
            warnings,
            outputs,
            levels,
        })
    }

    fn output(
        &self,
        study: &Study,
        members: &Members,
        seed: u64,
        row: usize,
    ) -> Result<OutputForecast, StudyForecastError> {
        let courses = members.courses(row);
        let fan = Fan::of(&self.times, &courses, &Fan::USUAL)?;
        let measured = self.measured[row].as_ref();
        let band =
            measured.map(|measured| self.band(measured, &courses, |sd| members.with_noise(row, sd, seed)));
        let values = measured.map_or(&[][..], |m| &m.values);
        Ok(OutputForecast::new(study, &self.setup.outputs[row], fan, band.transpose()?, values))
    }

    /// The band of what would be measured, for members with errors of a standard deviation at every time.
    fn band(
        &self,
        measured: &MeasuredOutput,
        courses: &[Vec<f64>],
        with_noise: impl Fn(&[f64]) -> Vec<Vec<f64>>,
    ) -> Result<Band, StudyForecastError> {
        let fan = |sd: &[f64]| Fan::of(&self.times, &with_noise(sd), &Fan::USUAL);
        let Errors { noise, sd, from } = measured.errors;
        let by_fit = fan(&vec![sd; self.times.len()])?;
        let own = OwnErrors::of(&measured.values, &self.times, courses);
        let Some(own) = own.filter(|own| measured.never_fitted && own.whole() > sd) else {
            return Ok(Band { fan: by_fit, by_fit: None, errors: Errors { noise, sd, from } });
        };
        let at: Vec<f64> = self.times.iter().map(|time| own.at(*time).max(sd)).collect();
        let errors = Errors { noise, sd: own.whole(), from: From::OwnValues };
        Ok(Band { fan: fan(&at)?, by_fit: Some((by_fit, sd)), errors })
    }
}
