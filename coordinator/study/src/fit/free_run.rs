//! The final forward run: every record from its start, free, with the estimate; its misfit is that of the fit.
//!
//! The runs get no observed value, neither of the training span nor of a held-out one, so that no observer can correct them.
//! Next file to read: [`crate::summary`].

use std::sync::Arc;

use nalgebra::DMatrix;
use starlings_estimators::Gaussian;

use super::runner::{AnalysisIndex, EnsembleRunner, StepWindows};
use crate::store::PredictionRow;
use crate::{RunError, Study};

/// Runs every record with the posterior mean and pairs predictions with observations.
///
/// # Errors
/// When the fleet fails, or the model fails at the estimate.
pub(crate) fn run(
    runner: &mut EnsembleRunner<'_>,
    posterior: &Gaussian,
) -> Result<Vec<PredictionRow>, RunError> {
    let study = runner.study();
    let windows: StepWindows =
        (0..study.records.len()).map(|record| (record, Arc::new(study.whole(record, false)))).collect();
    let theta = DMatrix::from_column_slice(posterior.mean.len(), 1, posterior.mean.as_slice());
    let results = runner.run_from_start(AnalysisIndex { pass: 0, step: 0 }, &theta, &windows)?;
    let mut rows = Vec::new();
    for ((record, window), result) in windows.iter().zip(results.into_iter().flatten()) {
        let prediction = result
            .map_err(|source| RunError::FinalRun { record: study.records[*record].name.clone(), source })?;
        rows.extend(pair(study, *record, &window.times, &prediction.outputs));
    }
    Ok(rows)
}

fn pair(study: &Study, record: usize, times: &[f64], outputs: &[f64]) -> Vec<PredictionRow> {
    let n_obs = study.setup.outputs.len();
    let of_record = &study.records[record];
    let mut rows = Vec::new();
    for channel in &of_record.channels {
        for (j, time) in times.iter().enumerate() {
            let observed = of_record.observed(channel, *time);
            // Without a surface there is nothing that a distance could be to.
            if channel.node.is_some() && observed.is_none() {
                continue;
            }
            let usage = if channel.held_out {
                "held-out-channel"
            } else if of_record.trains_at(*time) {
                "train"
            } else {
                "held-out"
            };
            rows.push(PredictionRow {
                record: of_record.name.clone(),
                output: channel.output.clone(),
                time: *time,
                observed,
                predicted: outputs[j * n_obs + channel.row],
                usage: usage.to_owned(),
                noise: channel.noise,
            });
        }
    }
    rows
}
