//! The sequential fit: passes of the reduced-order UKF over the training windows, one ensemble per step.
//!
//! Pass 1 of several runs with the noise annealed (its sd multiplied), so that early data do not trap the ensemble while the
//! particles are still far apart; it only chooses where the later passes linearise. These start from tight sigma points
//! around the previous estimate, and the study's real prior is put back exactly at every report ([`exchange_prior`]): no
//! datum counts twice. The sigma-point arithmetic lives in `starlings-estimators`; model states are only recombined here.
//! Next file to read: [`super::rescue`].

use std::sync::Arc;

use nalgebra::DMatrix;
use starlings_estimators::{
    Analysis, Data, Drift, Gaussian, Noise, Particles, Roukf, SigmaSet, exchange_prior,
};
use starlings_models::Window;

use super::flight::{Flight, Place, StepWindows, stack_outputs, stack_states};
use super::resample;
use super::rescue::{Flown, fly};
use crate::study::store::snapshot::{Head, Snapshot};
use crate::study::store::{AnalysisRow, InnovationRow, Store};
use crate::study::{Fit, RunContext, RunError, Study, posterior};

/// Runs every pass, continuing from `resumed` if there is one.
///
/// # Errors
/// When the fleet or the store fails, or too few sigma points can be run.
pub fn fit(
    flight: &mut Flight<'_>,
    store: &mut Store,
    context: &mut RunContext<'_>,
    resumed: Option<Snapshot>,
) -> Result<Fit, RunError> {
    let study = flight.study();
    let schedule = Schedule::new(study)?;
    let mut now = match resumed {
        Some(snapshot) => snapshot,
        None => schedule.start(0, &posterior::prior(study)),
    };
    let mut reported = schedule.reported(&now)?;
    loop {
        while now.head.step < schedule.n_step() {
            let (row, next) = step(flight, &schedule, &mut now, &reported)?;
            reported = next;
            store.analysis(&row, &now)?;
            context.after_step(store, &schedule.progress(&now, flight))?;
        }
        if now.head.pass + 1 == schedule.passes {
            return Ok(schedule.finish(&now, reported));
        }
        let head = now.head;
        now = schedule.start(head.pass + 1, &reported.posterior);
        now.head.counts = head.counts;
        now.head.information_lost = head.information_lost;
        reported = schedule.reported(&now)?;
    }
}

/// Everything about the fit that does not change from step to step.
struct Schedule<'a> {
    study: &'a Study,
    roukf: Roukf,
    passes: usize,
    resample: bool,
    prior: Gaussian,
    /// Training windows by record.
    windows: Vec<Vec<Arc<Window>>>,
}

/// What is known under the study's own prior, and the figures of the pass so far that belong to it.
struct Reported {
    posterior: Gaussian,
    log_likelihood: f64,
    nis: f64,
}

impl<'a> Schedule<'a> {
    fn new(study: &'a Study) -> Result<Self, RunError> {
        let e = &study.estimator;
        let set = SigmaSet::new(e.points, study.theta.len())?;
        let drift: Vec<Drift> = study.theta.iter().map(|t| t.drift).collect();
        let drifting = drift.iter().any(|d| !matches!(d, Drift::None));
        Ok(Self {
            study,
            resample: e.resample && set.n_particle() > set.n_param() + 1,
            roukf: Roukf { set, root: e.root, drift },
            // A drifting parameter has no single value to linearise around: one pass.
            passes: if drifting { 1 } else { e.passes },
            prior: posterior::prior(study),
            windows: (0..study.records.len()).map(|record| study.windows(record)).collect(),
        })
    }

    fn n_step(&self) -> usize {
        self.windows.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Factor on the noise sd in this pass.
    fn anneal(&self, pass: usize) -> f64 {
        if pass == 0 && self.passes > 1 { self.study.estimator.anneal } else { 1.0 }
    }

    /// The ensemble at the start of a pass, around the given estimate.
    fn start(&self, pass: usize, around: &Gaussian) -> Snapshot {
        let spread = if pass == 0 { 1.0 } else { self.study.estimator.spread };
        let scale: Vec<f64> = self.study.theta.iter().map(|t| spread * t.prior_sd).collect();
        let centre: Vec<f64> = around.mean.iter().copied().collect();
        let particles = self.roukf.init(&posterior::independent(&centre, &scale));
        Snapshot {
            head: Head {
                pass,
                step: 0,
                theta: (&particles.theta).into(),
                centre,
                scale,
                batch: String::new(),
                nis: 0.0,
                n_used: 0,
                log_likelihood: 0.0,
                information_lost: 0.0,
                counts: crate::study::store::snapshot::Counts::default(),
            },
            states: vec![None; self.study.records.len()],
        }
    }

    /// The windows of one step, one for each record that still has data.
    fn step_windows(&self, step: usize) -> StepWindows {
        self.windows.iter().enumerate().filter_map(|(r, w)| w.get(step).map(|w| (r, Arc::clone(w)))).collect()
    }

    /// What is known now under the study's own prior, whatever spread this pass started with.
    fn reported(&self, now: &Snapshot) -> Result<Reported, RunError> {
        let particles = particles(now);
        let posterior = self.roukf.gaussian(&particles);
        if now.head.pass == 0 {
            return Ok(Reported { posterior, log_likelihood: now.head.log_likelihood, nis: now.head.nis });
        }
        let used = posterior::independent(&now.head.centre, &now.head.scale);
        let exchanged = exchange_prior(&posterior, &used, &self.prior)?;
        Ok(Reported {
            posterior: exchanged.posterior,
            log_likelihood: now.head.log_likelihood + exchanged.log_likelihood,
            nis: now.head.nis + exchanged.nis,
        })
    }

    fn finish(&self, now: &Snapshot, reported: Reported) -> Fit {
        let sd = posterior::standard_deviations(&reported.posterior);
        let moves = reported
            .posterior
            .mean
            .iter()
            .zip(&now.head.centre)
            .zip(sd)
            .map(|((m, c), sd)| (m - c).abs() / sd);
        let last_move = if now.head.pass == 0 { 0.0 } else { moves.fold(0.0, f64::max) };
        Fit {
            posterior: reported.posterior,
            log_likelihood: reported.log_likelihood,
            nis: reported.nis,
            n_used: now.head.n_used,
            information_lost: now.head.information_lost,
            counts: now.head.counts,
            passes: self.passes,
            converged: true,
            last_move,
        }
    }

    fn progress(&self, now: &Snapshot, flight: &Flight<'_>) -> crate::study::Progress {
        crate::study::Progress {
            stage: "filter",
            pass: now.head.pass + 1,
            passes: self.passes,
            step: now.head.step,
            steps: self.n_step(),
            runs: now.head.counts.total,
            workers: flight.n_workers(),
        }
    }
}

/// Predict, observe, analyse, recombine: one step of the filter over every record that still has data. Returns what the
/// store keeps of it and what is known after it; `before` is what was known before.
fn step(
    flight: &mut Flight<'_>,
    schedule: &Schedule<'_>,
    now: &mut Snapshot,
    before: &Reported,
) -> Result<(AnalysisRow, Reported), RunError> {
    let windows = schedule.step_windows(now.head.step);
    let place = Place { pass: now.head.pass + 1, step: now.head.step };
    let counted = (flight.total, flight.failed, flight.retried);
    let Flown { mut particles, results, rescued } =
        fly(flight, &schedule.roukf, particles(now), &mut now.states, &windows, place)?;
    for (index, (record, _)) in windows.iter().enumerate() {
        now.states[*record] = Some(stack_states(&results, index));
    }
    let mut predictions = stack_outputs(&results, &windows);
    if schedule.resample && rescued == 0 {
        let states = &mut now.states;
        let drawn =
            resample::redraw(flight, &schedule.roukf, place, &windows, &particles, &predictions, states)?;
        if let Some((redrawn, observed)) = drawn {
            (particles, predictions) = (redrawn, observed);
        }
    }
    let values: Vec<f64> = windows.iter().flat_map(|(_, w)| w.observed.iter().copied()).collect();
    let noise = noise(schedule.study, &windows, schedule.anneal(now.head.pass));
    let (particles, analysis) =
        schedule.roukf.analysis(&particles, &predictions, &Data { values: &values, noise: &noise })?;
    recombine(&mut now.states, &analysis.transform);
    for (record, states) in now.states.iter_mut().enumerate() {
        if schedule.windows[record].len() <= place.step + 1 {
            *states = None;
        }
    }
    advance(now, &particles, &analysis);
    now.head.counts.total += flight.total - counted.0;
    now.head.counts.failed += flight.failed - counted.1;
    now.head.counts.retried += flight.retried - counted.2;
    now.head.counts.rescued += rescued;
    let after = schedule.reported(now)?;
    let mut row = row(schedule.study, place, &windows, &analysis, before, &after);
    row.jobs = flight.take_rows();
    Ok((row, after))
}

fn particles(now: &Snapshot) -> Particles {
    let theta = now.head.theta.to_dense();
    let pull = vec![1.0; theta.ncols()];
    Particles { theta, pull }
}

/// X⁺ = X⁻T for the states of every record.
pub(super) fn recombine(states: &mut [Option<DMatrix<f64>>], transform: &DMatrix<f64>) {
    for x in states.iter_mut().flatten() {
        let mut out = DMatrix::zeros(x.nrows(), x.ncols());
        starlings_estimators::recombine(x, transform, &mut out);
        *x = out;
    }
}

/// Noise sd of every row, in the order of the stacked predictions.
pub(in crate::study) fn noise(study: &Study, windows: &StepWindows, factor: f64) -> Noise {
    let sd = windows.iter().flat_map(|(record, window)| {
        let of_record = study.noise(*record);
        window.times.iter().flat_map(move |_| of_record.clone())
    });
    Noise::Diagonal(sd.map(|s| s * factor).collect())
}

fn advance(now: &mut Snapshot, particles: &Particles, analysis: &Analysis) {
    now.head.theta = (&particles.theta).into();
    now.head.step += 1;
    now.head.nis += analysis.nis;
    now.head.n_used += analysis.n_used;
    now.head.log_likelihood += analysis.log_likelihood;
    now.head.information_lost = now.head.information_lost.max(analysis.information_lost);
}

fn row(
    study: &Study,
    place: Place,
    windows: &StepWindows,
    analysis: &Analysis,
    before: &Reported,
    after: &Reported,
) -> AnalysisRow {
    AnalysisRow {
        pass: place.pass,
        step: place.step,
        time: elapsed(study, windows),
        n_used: analysis.n_used,
        nis: after.nis - before.nis,
        log_likelihood: after.log_likelihood - before.log_likelihood,
        information_lost: analysis.information_lost,
        transform: Some(analysis.transform.clone()),
        estimates: posterior::rows(study, &after.posterior),
        innovations: innovations(study, windows, analysis),
        jobs: Vec::new(),
    }
}

/// Longest time since a record's start among the step's windows.
fn elapsed(study: &Study, windows: &StepWindows) -> f64 {
    windows
        .iter()
        .filter_map(|(record, w)| Some(w.times.last()? - study.records[*record].times.first()?))
        .fold(0.0, f64::max)
}

fn innovations(study: &Study, windows: &StepWindows, analysis: &Analysis) -> Vec<InnovationRow> {
    let mut rows = Vec::new();
    let mut at = 0;
    for (record, window) in windows {
        for time in &window.times {
            for output in &study.setup.outputs {
                if analysis.innovation[at].is_finite() {
                    rows.push(InnovationRow {
                        record: study.records[*record].name.clone(),
                        output: output.clone(),
                        time: *time,
                        innovation: analysis.innovation[at],
                        sd: analysis.innovation_sd[at],
                    });
                }
                at += 1;
            }
        }
    }
    rows
}
