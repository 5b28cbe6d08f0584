//! What differs from pass to pass of the filter: noise, spread, drift, and what is reported.
//!
//! Pass 1 of several runs with the noise annealed (its sd multiplied), so that early data do not trap the ensemble while the
//! particles are still far apart; it only chooses where the later passes linearise. These start from tight sigma points
//! around the previous estimate, and the study's real prior is put back exactly at every report ([`exchange_prior`]): no
//! datum counts twice. Such a pass is a step of Gauss and Newton; where the study does not fix their number, [`super::settle`]
//! says how far along it the next pass starts, and when the passes end.
//!
//! A parameter that drifts has no single value to linearise around, and exchanging priors is not exact for it. A study with
//! one has two passes at most: the annealed one without drift, and one with drift that starts from the annealed posterior; what
//! that start adds is taken out by [`super::drifting`]. Next file to read: [`super::settle`].

use std::sync::Arc;

use starlings_estimators::{Filter, FromStart, Gaussian, MakeFilter, Particles, exchange_prior};
use starlings_models::Window;

use super::drifting;
use super::runner::{EnsembleRunner, StepWindows};
use super::walking::Walking;
use crate::store::snapshot::{Ensemble, Figures, Snapshot};
use crate::work::plan::{self, WorkPlan};
use crate::work::settling::More;
use crate::{Fit, Move, Progress, RunError, Study, ThetaEntry, posterior};

/// Least width of the points in prior sd: closer, rounding inside the model would show.
const CLOSEST: f64 = 1e-6;

/// Everything about the fit that does not change from step to step.
pub(super) struct Schedule<'a> {
    pub(super) study: &'a Study,
    pub(super) filter: Box<dyn Filter>,
    /// Number of passes where it is fixed; `None` for as many as it takes.
    pub(super) passes: Option<usize>,
    pub(super) resample: bool,
    pub(super) prior: Gaussian,
    /// Entries that follow their states in the pass with drift.
    walking: Walking,
    /// Training windows by record.
    pub(super) windows: Vec<Vec<Arc<Window>>>,
    work: WorkPlan,
}

/// What is known under the study's own prior, and the figures of the pass so far that belong to it.
pub(super) struct Reported {
    pub(super) posterior: Gaussian,
    pub(super) log_likelihood: f64,
    pub(super) nis: f64,
}

impl<'a> Schedule<'a> {
    pub(super) fn new(study: &'a Study, make: MakeFilter) -> Result<Self, RunError> {
        let filter = make(&study.filter_options())?;
        let work = WorkPlan::new(study, filter.n_particle());
        Ok(Self {
            study,
            resample: study.estimator.resample && filter.resamples(),
            filter,
            passes: study.passes(),
            walking: Walking::of(study),
            prior: posterior::prior(study),
            windows: (0..study.records.len()).map(|record| study.windows(record)).collect(),
            work,
        })
    }

    /// The entries that follow their states in one pass: those of states that walk, in the pass with drift.
    pub(super) fn walking(&self, pass: usize) -> Option<&Walking> {
        self.is_last(pass).then_some(&self.walking)
    }

    /// Whether a fixed number of passes ends with this one.
    pub(super) fn is_last(&self, pass: usize) -> bool {
        self.passes == Some(pass + 1)
    }

    pub(super) fn n_step(&self) -> usize {
        self.windows.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Factor on the noise sd in this pass.
    pub(super) fn anneal(&self, pass: usize) -> f64 {
        if pass == 0 && self.passes != Some(1) { self.study.estimator.anneal } else { 1.0 }
    }

    /// Standard deviations of the points at the start of a pass, transformed units.
    ///
    /// Where the number of passes is open, no point starts further out than one posterior sd: with data that determine a
    /// parameter to less than `spread` of its prior, the predictions of a wider ensemble would be far from linear.
    fn scale(&self, pass: usize, around: &Gaussian, narrow: f64) -> Vec<f64> {
        let sd = posterior::standard_deviations(around);
        if pass > 0 && self.study.drifts() {
            return self.study.theta.iter().zip(sd).map(|(t, sd)| sd.min(t.prior_sd)).collect();
        }
        let spread = if pass == 0 { 1.0 } else { self.study.spread() };
        let closest = |prior: f64, sd: f64| narrow * sd.max(CLOSEST * prior).min(spread * prior);
        let open = pass > 0 && self.passes.is_none();
        let scale =
            |(t, sd): (&ThetaEntry, f64)| if open { closest(t.prior_sd, sd) } else { spread * t.prior_sd };
        self.study.theta.iter().zip(sd).map(scale).collect()
    }

    /// The ensemble at the start of a pass, around the given estimate.
    pub(super) fn start(&self, pass: usize, around: &Gaussian) -> Snapshot<Ensemble> {
        self.start_at(pass, around, around.mean.iter().copied().collect(), 1.0)
    }

    /// The ensemble at the start of a pass around `centre`, no wider than `around`; `narrow` draws it together.
    pub(super) fn start_at(
        &self,
        pass: usize,
        around: &Gaussian,
        centre: Vec<f64>,
        narrow: f64,
    ) -> Snapshot<Ensemble> {
        let scale = self.scale(pass, around, narrow);
        let start = posterior::independent(&centre, &scale);
        let particles = self.filter.init(&start);
        let from_start =
            (self.study.drifts() && self.is_last(pass)).then(|| Box::new(FromStart::new(&start)));
        Snapshot {
            figures: Figures { pass, ..Figures::default() },
            estimate: Ensemble {
                theta: (&particles.theta).into(),
                centre,
                scale,
                cost: None,
                narrow,
                from_start,
            },
            states: vec![None; self.study.records.len()],
        }
    }

    /// The windows of one step, one for each record that still has data.
    pub(super) fn step_windows(&self, step: usize) -> StepWindows {
        self.windows.iter().enumerate().filter_map(|(r, w)| w.get(step).map(|w| (r, Arc::clone(w)))).collect()
    }

    /// What is known now under the study's own prior, whatever spread this pass started with.
    pub(super) fn reported(&self, now: &Snapshot<Ensemble>) -> Result<Reported, RunError> {
        let used = drifting::used(&now.estimate);
        let exchanged = if let Some(from) = &now.estimate.from_start {
            from.restated(&used, &self.prior)?
        } else {
            let posterior = self.filter.gaussian(&particles(now));
            if now.figures.pass == 0 || self.study.drifts() {
                return Ok(Reported {
                    posterior,
                    log_likelihood: now.figures.log_likelihood,
                    nis: now.figures.nis,
                });
            }
            exchange_prior(&posterior, &used, &self.prior)?
        };
        Ok(Reported {
            nis: exchanged.corrected_nis(now.figures.nis),
            log_likelihood: now.figures.log_likelihood + exchanged.log_likelihood,
            posterior: exchanged.posterior,
        })
    }

    /// How far the pass moved the estimate from where it started: the entry that moved most, in posterior standard deviations.
    /// `None` for a first pass, which starts at the prior, and for parameters that drift.
    pub(super) fn last_move(&self, now: &Snapshot<Ensemble>, reported: &Reported) -> Option<Move> {
        if now.figures.pass == 0 || self.study.drifts() {
            return None;
        }
        let sd = posterior::standard_deviations(&reported.posterior);
        let moved = reported.posterior.mean.iter().zip(&now.estimate.centre).zip(sd);
        let moves = moved.enumerate().map(|(entry, ((m, c), sd))| Move { entry, size: (m - c).abs() / sd });
        moves.max_by(|a, b| a.size.total_cmp(&b.size))
    }

    pub(super) fn finish(&self, now: &Snapshot<Ensemble>, reported: Reported) -> Fit {
        Fit {
            last_move: self.last_move(now, &reported),
            starts: self.walking.starts(&now.estimate.centre),
            work: (
                self.work.clone(),
                plan::done(&self.work.at(now.figures.pass, now.figures.step, More::Expected(0))),
            ),
            posterior: reported.posterior,
            log_likelihood: reported.log_likelihood,
            nis: reported.nis,
            n_used: now.figures.n_used,
            information_lost: now.figures.information_lost,
            dropped: now.figures.dropped,
            counts: now.figures.counts,
            passes: now.figures.pass + 1,
            converged: true,
        }
    }

    /// Where the fit stands, and the passes after this one.
    pub(super) fn progress(
        &self,
        now: &Snapshot<Ensemble>,
        more: More,
        runner: &EnsembleRunner<'_>,
    ) -> Progress {
        Progress {
            stage: "filter",
            pass: now.figures.pass + 1,
            passes: self.passes,
            step: now.figures.step,
            steps: self.n_step(),
            runs: now.figures.counts.total,
            workers: runner.n_workers(),
            work: self.work.at(now.figures.pass, now.figures.step, more),
        }
    }
}

/// The ensemble between two analyses, every point in its place.
pub(super) fn particles(now: &Snapshot<Ensemble>) -> Particles {
    let theta = now.estimate.theta.to_dense();
    let pull = vec![1.0; theta.ncols()];
    Particles { theta, pull }
}
