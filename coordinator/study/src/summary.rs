//! The result in numbers: what `summary.json` holds and `--json` prints.
//!
//! Everything is computed from the posterior and the stored forward run; nothing is re-estimated here. Next file to read:
//! [`super::warnings`].

use std::fmt::Write as _;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::constants::HangsOn;
use super::failures::FailureCluster;
use super::field::field_of;
use super::given_residuals::GivenResiduals;
use super::observer_gain::ObserverFit;
use super::posterior::{self, Estimate, estimates};
use super::predicted::{self, Figure, PredictedOutput};
use super::store::PredictionRow;
use super::{Fit, Study};

/// Ratio of the two intervals above which the one given the residuals comes first.
const FIRST: f64 = 1.5;
/// What the intervals given the residuals assume.
const RESIDUALS: &str = " The intervals given the residuals ask nothing of the noise's size and correlation, which they take from \
    the residuals; they ask that what the model lacks does not repeat with its inputs.";

/// How well the estimate reproduces one output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelFit {
    /// Output name; a field counts as one, whatever the number of its observed components.
    pub name: String,
    /// Standard deviation of its noise; the largest where records differ.
    pub noise: f64,
    /// Root mean square of observed − predicted over the training spans; `null` when nothing was trained.
    pub train_rmse: Option<f64>,
    /// The same over everything held out; `null` when nothing was.
    pub held_out_rmse: Option<f64>,
}

/// The same for one record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordFit {
    /// Record name.
    pub record: String,
    /// Its outputs.
    pub channels: Vec<ChannelFit>,
}

/// Fit figures of a free forward run with the estimate, and the filter's own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitSummary {
    /// Per output, pooled over the records.
    pub channels: Vec<ChannelFit>,
    /// Per record.
    pub records: Vec<RecordFit>,
    /// Normalised innovation squared per observation in the last pass (batch: squared whitened residual); about 1 when the
    /// model explains the data at the stated noise.
    pub nis_per_observation: f64,
    /// Log-likelihood of the data with the parameters integrated out (natural logarithm).
    pub log_likelihood: f64,
}

/// Runs of the forward model.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Runs {
    /// Asked of the fleet.
    pub total: u64,
    /// Failed for good.
    pub failed: u64,
    /// Extra attempts.
    pub retried: u64,
    /// Sigma points pulled towards the mean or dropped.
    pub rescued: u64,
}

/// The result of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Study name.
    pub study: String,
    /// Model kind.
    pub model: String,
    /// Estimator kind and sigma set.
    pub estimator: String,
    /// Seed.
    pub seed: u64,
    /// One entry per estimated parameter.
    pub parameters: Vec<Estimate>,
    /// Posterior correlation of the transformed parameters, row by row.
    pub correlation: Vec<Vec<f64>>,
    /// Fit figures.
    pub fit: FitSummary,
    /// What the observer does for the state; absent without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observer: Option<ObserverFit>,
    /// How far the estimates follow the constants of the model; absent where it has none, and for parameters that drift.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hangs_on: Option<HangsOn>,
    /// What was predicted that the study asks for in `[predict]`; absent where it does not.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub predictions: Vec<PredictedOutput>,
    /// Runs.
    pub runs: Runs,
    /// Workers that answered at least one run.
    pub workers: usize,
    /// Wall time in s.
    pub wall_s: f64,
    /// Failed runs by message and place; those of this part of the run where it was resumed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<FailureCluster>,
    /// What the reader must know before using the numbers.
    pub warnings: Vec<String>,
    /// What the intervals are conditional on.
    pub conditional_on: String,
}

impl Summary {
    /// Adds the intervals given the residuals, or why there are none.
    pub(super) fn add_residuals(&mut self, study: &Study, fit: &Fit, given: &GivenResiduals) {
        match given {
            GivenResiduals::Wider { factors, .. } => {
                posterior::widen(study, &fit.posterior, &mut self.parameters, factors);
                self.conditional_on.push_str(RESIDUALS);
            }
            GivenResiduals::Unknown(why) => {
                let _ = write!(self.conditional_on, " Intervals given the residuals are not stated: {why}.");
            }
        }
    }

    /// Adds what was predicted of quantities that the study asks for.
    pub(super) fn add_predictions(
        &mut self,
        study: &Study,
        predictions: Vec<PredictedOutput>,
        given: &GivenResiduals,
    ) {
        if !predictions.is_empty() {
            let wider = matches!(given, GivenResiduals::Wider { .. });
            self.conditional_on.push_str(&predicted::conditional_on(study, wider));
        }
        self.predictions = predictions;
    }

    /// Whether the interval of a parameter given the residuals is more than 1.5 times that at the stated noise: then it is the
    /// one to look at first.
    pub fn residuals_first(&self) -> bool {
        self.wider_given_residuals().is_some_and(|wider| wider > FIRST)
    }

    /// How many times wider the intervals given the residuals are, at the most; `None` when there are none.
    pub fn wider_given_residuals(&self) -> Option<f64> {
        let wider = self.parameters.iter().filter_map(|p| Some(p.sd_given_residuals? / p.sd));
        wider.filter(|wider| wider.is_finite()).reduce(f64::max)
    }

    /// Names the first figure that is no finite number: such a summary could be written but not read again.
    ///
    /// # Errors
    /// The figure's name.
    pub fn check_finite(&self) -> Result<(), String> {
        let of_parameters = self.parameters.iter().flat_map(|p| {
            let values = [p.estimate, p.sd, p.interval95[0], p.interval95[1], p.prior_median];
            let given = p.interval95_given_residuals.into_iter().flatten().chain(p.sd_given_residuals);
            let all = values.into_iter().chain(given);
            all.map(|v| (format!("estimate of {}", p.name), v)).collect::<Vec<_>>()
        });
        let of_correlation = self.correlation.iter().flatten().map(|v| ("correlation".to_owned(), *v));
        let of_fit = [("log-likelihood", self.fit.log_likelihood), ("NIS", self.fit.nis_per_observation)];
        let of_predictions = self.predictions.iter().flat_map(|p| {
            let values = p.figures().map(|(_, Figure { estimate, interval95: [lo, hi] })| [estimate, lo, hi]);
            values.into_iter().flatten().map(|v| (format!("prediction of {}", p.output), v))
        });
        let of_correlation = of_correlation.chain(of_predictions);
        let mut all = of_parameters.chain(of_correlation).chain(of_fit.map(|(name, v)| (name.to_owned(), v)));
        all.find(|(_, v)| !v.is_finite()).map_or(Ok(()), |(name, _)| Err(name))
    }
}

/// Gathers the summary but for its warnings; `wall_s` and `workers` are measured by the caller.
pub fn make(study: &Study, fit: &Fit, predictions: &[PredictionRow], workers: usize, wall_s: f64) -> Summary {
    Summary {
        study: study.name.clone(),
        model: study.setup.model.kind.clone(),
        estimator: study.describe_with(Some(fit.passes)),
        seed: study.seed,
        parameters: estimates(study, &fit.posterior),
        correlation: rows_of(&starlings_estimators::correlation(&fit.posterior.covariance)),
        fit: fit_figures(study, fit, predictions),
        observer: None,
        hangs_on: None,
        predictions: Vec::new(),
        runs: Runs {
            total: fit.counts.total,
            failed: fit.counts.failed,
            retried: fit.counts.retried,
            rescued: fit.counts.rescued,
        },
        workers,
        wall_s,
        failures: Vec::new(),
        warnings: Vec::new(),
        conditional_on: conditional_on(study),
    }
}

fn rows_of(m: &DMatrix<f64>) -> Vec<Vec<f64>> {
    m.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn fit_figures(study: &Study, fit: &Fit, predictions: &[PredictionRow]) -> FitSummary {
    let mut all: Vec<Tally> = Vec::new();
    for output in &study.setup.outputs {
        if all.last().is_none_or(|tally| tally.name != field_of(output)) && tally_of(&all, output).is_none() {
            all.push(Tally::new(field_of(output)));
        }
    }
    let mut records: Vec<(&str, Vec<Tally>)> =
        study.records.iter().map(|r| (r.name.as_str(), all.clone())).collect();
    for row in predictions {
        let Some(at) = tally_of(&all, &row.output) else { continue };
        all[at].add(row);
        if let Some((_, of_record)) = records.iter_mut().find(|(name, _)| *name == row.record) {
            of_record[at].add(row);
        }
    }
    let fits = |tallies: &[Tally]| tallies.iter().filter_map(Tally::fit).collect::<Vec<ChannelFit>>();
    let of_record = |(record, tallies): &(&str, Vec<Tally>)| RecordFit {
        record: (*record).to_owned(),
        channels: fits(tallies),
    };
    FitSummary {
        channels: fits(&all),
        records: records.iter().map(of_record).collect(),
        nis_per_observation: fit.nis_per_observation(),
        log_likelihood: fit.log_likelihood,
    }
}

fn tally_of(tallies: &[Tally], output: &str) -> Option<usize> {
    tallies.iter().position(|tally| tally.name == field_of(output))
}

/// Squared residuals of one output or field, summed.
#[derive(Clone)]
struct Tally {
    name: String,
    noise: Option<f64>,
    train: (f64, u32),
    held_out: (f64, u32),
}

impl Tally {
    fn new(name: &str) -> Self {
        Self { name: name.to_owned(), noise: None, train: (0.0, 0), held_out: (0.0, 0) }
    }

    fn add(&mut self, row: &PredictionRow) {
        self.noise = Some(self.noise.map_or(row.noise, |noise| noise.max(row.noise)));
        let part = if row.usage == "train" { &mut self.train } else { &mut self.held_out };
        if let Some(residual) = row.observed.map(|observed| observed - row.predicted) {
            part.0 = residual.mul_add(residual, part.0);
            part.1 += 1;
        }
    }

    /// The figures; none where nothing was predicted.
    fn fit(&self) -> Option<ChannelFit> {
        let rmse = |(sum, n): (f64, u32)| (n > 0).then(|| (sum / f64::from(n)).sqrt());
        Some(ChannelFit {
            name: self.name.clone(),
            noise: self.noise?,
            train_rmse: rmse(self.train),
            held_out_rmse: rmse(self.held_out),
        })
    }
}

fn conditional_on(study: &Study) -> String {
    let walks = if study.walks() {
        " States walk: the estimate of an initial value is the state after the last analysis."
    } else {
        ""
    };
    format!(
        "Intervals are conditional on the model `{}` being right, on independent Gaussian measurement noise of the stated \
         standard deviations, on the stated priors, and on the model being close to linear within the posterior.{walks}",
        study.setup.model.kind
    )
}
