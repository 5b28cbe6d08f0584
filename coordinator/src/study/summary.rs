//! The result in numbers: what `summary.json` holds and `--json` prints.
//!
//! Everything is computed from the posterior and the stored forward run; nothing is re-estimated here. Next file to read:
//! [`super::warnings`].

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::posterior::{Estimate, estimates};
use super::store::PredictionRow;
use super::{Fit, Study};

/// How well the estimate reproduces one output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelFit {
    /// Output name.
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
    /// Normalised innovation squared per observation in the last pass (batch: squared whitened residual); about 1 is healthy.
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
    /// Runs.
    pub runs: Runs,
    /// Workers that answered at least one run.
    pub workers: usize,
    /// Wall time in s.
    pub wall_s: f64,
    /// What the reader must know before using the numbers.
    pub warnings: Vec<String>,
    /// What the intervals are conditional on.
    pub conditional_on: String,
}

impl Summary {
    /// Names the first figure that is no finite number: such a summary could be written but not read again.
    ///
    /// # Errors
    /// The figure's name.
    pub fn check_finite(&self) -> Result<(), String> {
        let of_parameters = self.parameters.iter().flat_map(|p| {
            let values = [p.estimate, p.sd, p.interval95[0], p.interval95[1], p.prior_median];
            values.map(|v| (format!("estimate of {}", p.name), v))
        });
        let of_correlation = self.correlation.iter().flatten().map(|v| ("correlation".to_owned(), *v));
        let of_fit = [("log-likelihood", self.fit.log_likelihood), ("NIS", self.fit.nis_per_observation)];
        let mut all = of_parameters.chain(of_correlation).chain(of_fit.map(|(name, v)| (name.to_owned(), v)));
        all.find(|(_, v)| !v.is_finite()).map_or(Ok(()), |(name, _)| Err(name))
    }
}

/// Gathers the summary but for its warnings; `wall_s` and `workers` are measured by the caller.
pub fn make(study: &Study, fit: &Fit, predictions: &[PredictionRow], workers: usize, wall_s: f64) -> Summary {
    Summary {
        study: study.name.clone(),
        model: study.setup.model.kind.clone(),
        estimator: study.describe_estimator(),
        seed: study.seed,
        parameters: estimates(study, &fit.posterior),
        correlation: rows_of(&starlings_estimators::correlation(&fit.posterior.covariance)),
        fit: fit_figures(study, fit, predictions),
        runs: Runs {
            total: fit.counts.total,
            failed: fit.counts.failed,
            retried: fit.counts.retried,
            rescued: fit.counts.rescued,
        },
        workers,
        wall_s,
        warnings: Vec::new(),
        conditional_on: conditional_on(study),
    }
}

fn rows_of(m: &DMatrix<f64>) -> Vec<Vec<f64>> {
    m.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn fit_figures(study: &Study, fit: &Fit, predictions: &[PredictionRow]) -> FitSummary {
    let pooled = |keep: &dyn Fn(&PredictionRow) -> bool| -> Vec<ChannelFit> {
        study.setup.outputs.iter().filter_map(|output| channel_fit(output, predictions, keep)).collect()
    };
    let records = study
        .records
        .iter()
        .map(|r| RecordFit { record: r.name.clone(), channels: pooled(&|p| p.record == r.name) })
        .collect();
    FitSummary {
        channels: pooled(&|_| true),
        records,
        nis_per_observation: fit.nis_per_observation(),
        log_likelihood: fit.log_likelihood,
    }
}

fn channel_fit(
    output: &str,
    predictions: &[PredictionRow],
    keep: &dyn Fn(&PredictionRow) -> bool,
) -> Option<ChannelFit> {
    let of_output: Vec<&PredictionRow> =
        predictions.iter().filter(|p| p.output == output && keep(p)).collect();
    let noise = of_output
        .iter()
        .map(|p| p.noise)
        .fold(None, |max: Option<f64>, s| Some(max.map_or(s, |m| m.max(s))))?;
    Some(ChannelFit {
        name: output.to_owned(),
        noise,
        train_rmse: rmse(of_output.iter().filter(|p| p.usage == "train")),
        held_out_rmse: rmse(of_output.iter().filter(|p| p.usage != "train")),
    })
}

/// Root mean square of observed − predicted over the rows that were observed.
pub fn rmse<'a>(rows: impl Iterator<Item = &'a &'a PredictionRow>) -> Option<f64> {
    let (sum, n) = rows
        .filter_map(|p| Some(p.observed? - p.predicted))
        .fold((0.0, 0_u32), |(sum, n), residual| (residual.mul_add(residual, sum), n + 1));
    (n > 0).then(|| (sum / f64::from(n)).sqrt())
}

fn conditional_on(study: &Study) -> String {
    format!(
        "Intervals are conditional on the model `{}` being right, on independent Gaussian measurement noise of the stated \
         standard deviations, on the stated priors, and on the model being close to linear within the posterior.",
        study.setup.model.kind
    )
}
