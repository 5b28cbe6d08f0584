//! The whole loop: fit, forward run, summary, artefacts. Everything between a checked study and a finished run folder.
//!
//! The same code starts a run and continues a killed one: what is already in the store is not done again. Next files to
//! read: [`crate::fit::filter`] and [`crate::fit::batch`].

use std::sync::mpsc::Receiver;

use starlings_estimators::{Form, Gaussian};
use starlings_fleet::{Fleet, FleetEvent};

use super::constants::{self, HangsOn};
use super::failures::FailureCluster;
use super::fit::{batch, filter, free_run};
use super::given_residuals::{self, Beside, GivenResiduals};
use super::identify::IdentifyError;
use super::store::{PredictionRow, Store, StoreError};
use super::summary::Summary;
use super::{RunError, Study, observer_gain, predicted, summary, warnings};
use crate::fit::runner::EnsembleRunner;
use crate::observer_gain::Compared;
use crate::predicted::Predictions;
use crate::progress::{LAST, Progress};
use crate::store::folder::{GIVEN_RESIDUALS, OBSERVER, PREDICTION_SD, RunFolder};
use crate::store::json::json;
use crate::store::snapshot::{Counts, Snapshot};
use crate::work::plan::WorkPlan;

/// What a fit leaves behind.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Posterior in transformed units, under the study's own prior.
    pub posterior: Gaussian,
    /// Evidence: log-likelihood with the parameters integrated out.
    pub log_likelihood: f64,
    /// Normalised innovation squared of the last pass, summed.
    pub nis: f64,
    /// Observations used in the last pass.
    pub n_used: usize,
    /// Largest share of the spread lost at one analysis.
    pub information_lost: f64,
    /// Largest share of the spread that a resampling left out.
    pub dropped: f64,
    /// Runs.
    pub counts: Counts,
    /// Passes done.
    pub passes: usize,
    /// False when the iteration limit came first.
    pub converged: bool,
    /// How far the last pass moved the estimate; `None` for one pass, which has no estimate before it.
    pub last_move: Option<Move>,
    /// Entries that stand for the last value of a state that walks, with the value at which runs from the start begin.
    pub(crate) starts: Vec<(usize, f64)>,
    /// What was planned, and how much of it the fit was.
    pub(crate) work: (WorkPlan, [f64; 2]),
}

impl Fit {
    /// The posterior that runs from the start of a record are made with.
    fn at_the_start(&self) -> Gaussian {
        let mut posterior = self.posterior.clone();
        for (entry, value) in &self.starts {
            posterior.mean[*entry] = *value;
        }
        posterior
    }
}

/// The entry of the estimated vector that a pass moved most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// Its position.
    pub entry: usize,
    /// How far, in its posterior standard deviations.
    pub size: f64,
}

impl Move {
    /// Below this many posterior standard deviations an estimate counts as settled.
    pub(crate) const SETTLED: f64 = 0.1;

    /// Whether no entry moved further.
    pub(crate) fn is_settled(&self) -> bool {
        self.size < Self::SETTLED
    }
}

impl Fit {
    /// Normalised innovation squared per observation of the last pass.
    pub fn nis_per_observation(&self) -> f64 {
        self.nis / (self.n_used.max(1)) as f64
    }
}

/// What the run gets from its caller: a clock, a function for progress, and the fleet's events.
pub struct RunContext<'a> {
    /// Seconds since the program started.
    pub clock: &'a dyn Fn() -> f64,
    /// Called after every analysis.
    pub watch: &'a mut dyn FnMut(&Progress),
    /// Events of the fleet, kept in the store.
    pub events: Option<&'a Receiver<FleetEvent>>,
    /// Wall time of the earlier parts of a resumed run, in s.
    pub earlier_s: f64,
    /// Threads for the recombination of states, which happens here and not on the fleet; no result depends on them.
    pub threads: usize,
}

impl RunContext<'_> {
    /// Wall time of the run so far, earlier parts included, in s.
    pub fn elapsed(&self) -> f64 {
        self.earlier_s + (self.clock)()
    }

    /// Stores the fleet's events and reports progress.
    pub(super) fn after_step(&mut self, store: &Store, progress: &Progress) -> Result<(), StoreError> {
        self.keep_events(store)?;
        store.commit_if_due(self.elapsed(), |store| progress.note(store))?;
        (self.watch)(progress);
        Ok(())
    }

    /// Reports where a pass or a fit begins or goes on, between two analyses.
    pub(super) fn stands(&mut self, progress: &Progress) {
        (self.watch)(progress);
    }

    /// The fit is over, after so many runs in all, and the runs of a place of [`LAST`] begin.
    fn goes_on(&mut self, store: &Store, fit: &Fit, place: usize, runs: u64, runner: &EnsembleRunner<'_>) {
        let (plan, done) = &fit.work;
        let progress = Progress {
            stage: LAST[place],
            pass: fit.passes,
            passes: Some(fit.passes),
            step: place,
            steps: LAST.len() - 1,
            runs,
            workers: runner.n_workers(),
            work: plan.after(*done, place),
        };
        // What looks at the store may miss it; the run does not depend on it.
        let _ = progress.note(store);
        (self.watch)(&progress);
    }

    fn keep_events(&self, store: &Store) -> Result<(), StoreError> {
        for event in self.events.iter().flat_map(|events| events.try_iter()) {
            store.event(self.elapsed(), event.kind(), &event.to_string())?;
        }
        Ok(())
    }
}

/// Runs or continues a study in its folder and writes the result.
///
/// # Errors
/// When the fleet, the estimator or the store fails; what was done until then stays in the store, with the fleet's events.
pub fn run(
    study: &Study,
    fleet: &mut dyn Fleet,
    folder: &mut RunFolder,
    context: &mut RunContext<'_>,
) -> Result<Summary, RunError> {
    let result = from_start_to_end(study, fleet, folder, context);
    if result.is_err() {
        // The error of the run is returned, not that of the events, also where the store caused both.
        let _ = context.keep_events(&folder.store);
    }
    result
}

fn from_start_to_end(
    study: &Study,
    fleet: &mut dyn Fleet,
    folder: &mut RunFolder,
    context: &mut RunContext<'_>,
) -> Result<Summary, RunError> {
    let states = folder.settle_states(fleet.states())?;
    folder.store.reopen_arrived(&states)?;
    let resumed = Snapshot::read(&folder.store, study.records.len(), &states)?;
    context.earlier_s = folder.store.elapsed_s()?;
    folder.store.event(
        context.elapsed(),
        "run",
        if resumed.is_some() { "run resumed" } else { "run started" },
    )?;
    let mut runner = EnsembleRunner::new(study, fleet)?.deciding(&folder.store)?;
    runner.threads = context.threads.max(1);
    let fit = match study.estimator.kind.form {
        Form::Windows(make) => filter::fit(make, &mut runner, &folder.store, context, resumed)?,
        Form::WholeRecords(_) => batch::fit(&mut runner, &folder.store, context, resumed)?,
    };
    let AfterFit { predictions, predicted, observer, hangs_on, beside } =
        after_fit(&mut runner, &folder.store, &fit, context)?;
    let jobs = runner.take_rows();
    folder.store.predictions(&predictions, &jobs)?;
    context.keep_events(&folder.store)?;
    let mut result = summary::make(study, &fit, &predictions, runner.n_answered(), context.elapsed());
    result.add_residuals(study, &fit, &beside.given);
    predicted::keep(&folder.store, &predicted.courses)?;
    result.add_predictions(study, predicted.outputs, &beside.given);
    keep_covariance(&folder.store, &beside.given)?;
    if let Some(spread) = &beside.spread {
        folder.store.set_meta(PREDICTION_SD, &json(spread))?;
    }
    let mut unknown = Vec::new();
    match observer {
        Compared::NoObserver => {}
        Compared::Both(observer) => {
            folder.store.set_meta(OBSERVER, &json(&observer.courses))?;
            result.observer = Some(observer.fit);
            unknown = observer.left_out;
        }
        Compared::Failed(why) => unknown.push(why),
    }
    let residuals = warnings::residuals::residuals(study, &fit, &folder.store, &predictions)?;
    result.warnings = warnings::collect(study, &fit, &result, &predictions, &residuals);
    result.warnings.extend(unknown);
    result.warnings.extend(predicted.warnings);
    result.warnings.extend(folder.mixed()?);
    result.warnings.extend(runner.timeouts());
    result.warnings.extend(folder.store.told_of_workers()?);
    result.failures = runner.failures();
    result.warnings.extend(result.failures.iter().take(3).map(FailureCluster::told));
    match hangs_on {
        Ok(found) => result.hangs_on = (found.runs > 0).then_some(found),
        Err(why) => result.warnings.push(why),
    }
    result.check_finite().map_err(RunError::NotFinite)?;
    folder.store.event(context.elapsed(), "run", "run finished")?;
    folder.finish(study, &fit, &result)?;
    states.clear();
    Ok(result)
}

/// What the runs after a fit gave.
struct AfterFit {
    predictions: Vec<PredictionRow>,
    predicted: Predictions,
    observer: Compared,
    hangs_on: Result<HangsOn, String>,
    beside: Beside,
}

/// The runs after a fit, in the order of [`LAST`].
fn after_fit(
    runner: &mut EnsembleRunner<'_>,
    store: &Store,
    fit: &Fit,
    context: &mut RunContext<'_>,
) -> Result<AfterFit, RunError> {
    // Runs of earlier parts of a resumed run are none of this runner's.
    let earlier = fit.counts.total.saturating_sub(runner.counts.total);
    let runs = |runner: &EnsembleRunner<'_>| earlier + runner.counts.total;
    context.goes_on(store, fit, 0, runs(runner), runner);
    let at_the_start = fit.at_the_start();
    let predictions = free_run::run(runner, &at_the_start)?;
    context.goes_on(store, fit, 1, runs(runner), runner);
    let observer = observer_gain::compare(runner, &at_the_start, &predictions)?;
    // What fails at the estimate itself need not be tried beside it.
    let (hangs_on, beside) = if observer.fails() {
        (Ok(HangsOn::default()), Beside::unknown("the model fails under its observer"))
    } else {
        context.goes_on(store, fit, 2, runs(runner), runner);
        let hangs_on = hangs_on(runner, fit)?;
        context.goes_on(store, fit, 3, runs(runner), runner);
        (hangs_on, given_residuals::compare(runner, &fit.posterior)?)
    };
    let mut predicted = Predictions::default();
    if !runner.study().predict.outputs.is_empty() {
        context.goes_on(store, fit, 4, runs(runner), runner);
        predicted = predicted::predict(runner, &beside.given.widened(&fit.posterior))?;
    }
    context.goes_on(store, fit, LAST.len() - 1, runs(runner), runner);
    Ok(AfterFit { predictions, predicted, observer, hangs_on, beside })
}

/// Stores the covariance given the residuals, for forecasts.
fn keep_covariance(store: &Store, given: &GivenResiduals) -> Result<(), StoreError> {
    let GivenResiduals::Wider { covariance, .. } = given else { return Ok(()) };
    let rows: Vec<Vec<f64>> = covariance.row_iter().map(|row| row.iter().copied().collect()).collect();
    store.set_meta(GIVEN_RESIDUALS, &json(&rows))
}

/// How far the estimates follow the constants, or why that is not known. Empty for parameters that drift: they follow any
/// change of the model.
fn hangs_on(runner: &mut EnsembleRunner<'_>, fit: &Fit) -> Result<Result<HangsOn, String>, RunError> {
    if runner.study().drifts() {
        return Ok(Ok(HangsOn::default()));
    }
    match constants::of_fit(runner, fit.posterior.mean.as_slice()) {
        Ok(found) => Ok(Ok(found)),
        Err(IdentifyError::Run(error)) => Err(error),
        Err(error) => Ok(Err(format!("which constants the answer hangs on is not known: {error}"))),
    }
}
