//! The trial of a study by its workers: the same runs, made by the fleet, since nothing of a solver is started where the coordinator
//! listens, and since large states are in bounded memory there and here.
//!
//! What the trial finds is stored, so that a resumed run does not make it again. Next file to read: [`mod@super::dry_run`].

use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use starlings_estimators::Kind;
use starlings_fleet::{Fleet, FleetError, Held, SetupId};
use starlings_models::{Failure, Job, ParticleError, Prediction, Setup};

use super::dry_run::{Depth, dry_run_by};
use super::{Runner, TrialError, asked, trial_by};
use crate::checked::Rounding;
use crate::predicted::members::setup_of;
use crate::store::json::json;
use crate::store::{Store, StoreError};
use crate::{Study, check};

/// Name under which the store keeps what the trial found.
const FOUND: &str = "trial";

/// Why there is no trial.
#[derive(Debug, thiserror::Error)]
pub enum FleetTrialError {
    /// The model fails.
    #[error(transparent)]
    Trial(#[from] TrialError),
    /// The fleet failed as a whole.
    #[error(transparent)]
    Fleet(#[from] FleetError),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// What a trial found that the runs of a fit depend on.
#[derive(Serialize, Deserialize)]
struct Found {
    whole_answers: bool,
    #[serde(default)]
    rounding: Rounding,
    warnings: Vec<String>,
}

/// Makes the runs of [`super::dry_run()`] on the fleet, or without a kind of fit those of [`super::trial()`]; once in the life of a run.
///
/// # Errors
/// As there, and when the fleet or the store fails.
pub fn trial_on_fleet(
    study: &mut Study,
    kind: Option<&Kind>,
    fleet: &mut (dyn Fleet + Send),
    store: Option<&Store>,
) -> Result<(), FleetTrialError> {
    if let Some(found) = store.map(read).transpose()?.flatten() {
        (study.whole_answers, study.warnings) = (found.whole_answers, found.warnings);
        study.rounding = found.rounding;
        return Ok(());
    }
    let setup = study.setup.clone();
    on(study, &setup, fleet, |study, model| match kind {
        Some(kind) => dry_run_by(study, kind, Depth::First, model),
        None => trial_by(study, model),
    })??;
    if kind.is_some() && asked::is_more(study) {
        let setup = setup_of(study);
        on(study, &setup, fleet, |study, model| asked::predictions(study, Depth::First, model))??;
    }
    study.warnings.retain(|warning| !warning.contains(check::UNTRIED));
    if let Some(store) = store {
        let (whole_answers, rounding) = (study.whole_answers, study.rounding);
        let found = Found { whole_answers, rounding, warnings: study.warnings.clone() };
        store.set_meta(FOUND, &json(&found))?;
    }
    Ok(())
}

fn read(store: &Store) -> Result<Option<Found>, StoreError> {
    let text = store.meta(FOUND)?;
    text.map(|text| serde_json::from_str(&text).map_err(|e| store.damaged(FOUND, e))).transpose()
}

/// Runs something with a model of a study as the fleet runs it; the outer error is the fleet's.
fn on<T>(
    study: &mut Study,
    setup: &Setup,
    fleet: &mut (dyn Fleet + Send),
    act: impl FnOnce(&mut Study, &dyn Runner) -> T,
) -> Result<T, FleetError> {
    let setup = fleet.install(setup)?;
    let away = Mutex::new(Away { fleet, failed: None });
    let model = OnFleet { away: &away, setup };
    let done = act(study, &model);
    match away.into_inner().unwrap_or_else(PoisonError::into_inner).failed {
        Some(error) => Err(error),
        None => Ok(done),
    }
}

/// The fleet, and how it failed.
struct Away<'a> {
    fleet: &'a mut (dyn Fleet + Send),
    failed: Option<FleetError>,
}

/// Runs that are batches of one.
struct OnFleet<'a, 'f> {
    away: &'a Mutex<Away<'f>>,
    setup: SetupId,
}

impl Runner for OnFleet<'_, '_> {
    fn run(&self, job: Job<Held>) -> Result<Prediction<Held>, ParticleError> {
        let mut away = self.away.lock().unwrap_or_else(PoisonError::into_inner);
        match away.fleet.run_held(vec![(self.setup, job)]) {
            Ok(outcomes) => match outcomes.into_iter().next().map(|outcome| outcome.result) {
                Some(Ok(prediction)) => Ok(prediction),
                Some(Err(Failure::Model(failed))) => Err(failed.into()),
                Some(Err(Failure::Timeout(late))) => Err(late.into()),
                None => Err(ParticleError::Infrastructure("the fleet gave no answer".to_owned())),
            },
            Err(FleetError::NoControl { reason, .. } | FleetError::NoAnswer { reason, .. }) => {
                Err(ParticleError::Undecided(reason))
            }
            Err(error) => {
                let text = error.to_string();
                away.failed = Some(error);
                Err(ParticleError::Infrastructure(text))
            }
        }
    }
}
