//! The outputs of `[predict]`, asked for once at the prior median: what no run gives would be missing after the whole fit.
//!
//! Next file to read: [`crate::predicted`], which asks for them at draws of the posterior.

use starlings_models::quoted_list;
use std::sync::Arc;

use super::dry_run::Depth;
use super::{Fault, Runner, TrialError, named, run};
use crate::field::observed_fields;
use crate::predicted::members::{step_of, window_of};
use crate::{Study, posterior};

/// Whether predictions ask for more than the trial of what is measured: other outputs, or other times.
pub(super) fn is_more(study: &Study) -> bool {
    let asked = &study.predict;
    !asked.outputs.is_empty()
        && (step_of(study).is_some()
            || asked.outputs.iter().any(|output| !study.setup.outputs.contains(output)))
}

/// One run of what is predicted, over the first record or over all.
///
/// # Errors
/// When it gives no prediction, with the outputs that were asked for.
pub(super) fn predictions(study: &Study, depth: Depth, model: &dyn Runner) -> Result<(), TrialError> {
    let prior = posterior::prior(study);
    let n_record = if depth == Depth::First { 1 } else { study.records.len() };
    for (index, record) in study.records.iter().enumerate().take(n_record) {
        let (window, theta) = (window_of(study, index), study.theta_for(index, prior.mean.as_slice()));
        run(model, index, &Arc::new(window), &theta, None).map_err(|fault| {
            let record = record.name.clone();
            match fault {
                Fault::Run(source) => TrialError::Predict {
                    outputs: quoted_list(observed_fields(&study.predict.outputs)),
                    record,
                    values: named(study, &theta),
                    source,
                },
                Fault::Travel(source) => TrialError::Travel { record, source },
            }
        })?;
    }
    Ok(())
}
