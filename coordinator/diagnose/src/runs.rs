//! What was measured, in the order of its times, and runs of several models over all of it in one batch.
//!
//! Every record that trains is run from its start, without an observer, which would pull the simulation towards the data. Next file to
//! read: [`super::hypothesis`].

use std::sync::Arc;

use nalgebra::DVector;
use starlings_fleet::{Fleet, Held};
use starlings_models::{Job, Window};
use starlings_study::{Stage, Study};

use crate::error::{DiagnoseError, no_answer};
use crate::foreseen::Foreseen;

/// Runs of one batch at most: what comes back of them is held together.
const BATCH: usize = 512;

/// One measured value that is compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Row {
    /// Index in [`Study::records`].
    pub(crate) record: usize,
    /// Index in the record's times.
    pub(crate) step: usize,
    /// Index in the outputs of the setup.
    pub(crate) output: usize,
    /// Time.
    pub(crate) time: f64,
    /// Measured value.
    pub(crate) observed: f64,
    /// Noise sd, in the channel's unit.
    pub(crate) noise: f64,
}

/// The values of the training spans: records in order, then times, then outputs.
pub(crate) fn rows(study: &Study) -> Vec<Row> {
    let mut rows = Vec::new();
    for (record, of) in study.records.iter().enumerate() {
        for (step, &time) in of.times.iter().enumerate().filter(|(_, time)| of.trains_at(**time)) {
            let fitted = of.channels.iter().filter(|channel| !channel.held_out);
            let measured = fitted.map(|channel| (channel, channel.values[step]));
            for (channel, observed) in measured.filter(|(_, value)| value.is_finite()) {
                let (output, noise) = (channel.row, channel.noise);
                rows.push(Row { record, step, output, time, observed, noise });
            }
        }
    }
    rows
}

/// Series of rows that follow one another in time: one per record and output, by the indices of their rows.
pub(crate) fn series(rows: &[Row]) -> Vec<Vec<usize>> {
    let mut series: Vec<Vec<usize>> = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        let same = |of: &&mut Vec<usize>| {
            of.first().is_some_and(|first| {
                let first = &rows[*first];
                (first.record, first.output) == (row.record, row.output)
            })
        };
        match series.iter_mut().find(same) {
            Some(of) => of.push(i),
            None => series.push(vec![i]),
        }
    }
    series
}

/// A model with the windows of its records.
#[derive(Clone, Debug)]
pub(crate) struct Runnable {
    pub(crate) study: Study,
    /// Of the records that train.
    windows: Vec<(usize, Arc<Window>)>,
}

/// What a point predicts of every row, or why it cannot be run.
pub(crate) type Predicted = Result<Vec<f64>, String>;

impl Runnable {
    /// A study as it is run: freely.
    pub(crate) fn new(study: &Study) -> Self {
        let mut study = study.clone();
        study.setup.observer = starlings_models::ObserverDef::default();
        let trained = (0..study.records.len()).filter(|record| study.records[*record].is_trained());
        let windows = trained.map(|record| (record, Arc::new(study.whole(record, false)))).collect();
        Self { study, windows }
    }
}

/// Runs models on the fleet, over the same rows.
pub(crate) struct Runs<'a> {
    fleet: &'a mut dyn Fleet,
    pub(crate) rows: Vec<Row>,
    /// Runs so far.
    pub(crate) n_run: u64,
    watch: &'a mut dyn FnMut(&Stage),
    foreseen: Foreseen,
    /// What is being done, in a word and in a few.
    stage: (&'static str, String),
}

impl<'a> Runs<'a> {
    pub(crate) fn new(
        fleet: &'a mut dyn Fleet,
        rows: Vec<Row>,
        foreseen: Foreseen,
        watch: &'a mut dyn FnMut(&Stage),
    ) -> Self {
        Self { fleet, rows, n_run: 0, watch, foreseen, stage: ("", String::new()) }
    }

    /// A part of the diagnosis begins.
    pub(crate) fn begin(&mut self, part: usize, name: &'static str, says: String) {
        self.foreseen.begin(part, self.n_run);
        self.stage = (name, says);
        self.tell(0);
    }

    fn tell(&mut self, next: usize) {
        let (name, says) = self.stage.clone();
        let work = self.foreseen.work(self.n_run, next);
        (self.watch)(&Stage { name, says, runs: self.n_run, workers: self.fleet.n_workers(), work });
    }

    /// The predictions of points (transformed parameters) of models, in their order.
    ///
    /// # Errors
    /// When the fleet fails.
    pub(crate) fn run(
        &mut self,
        points: &[(&Runnable, DVector<f64>)],
    ) -> Result<Vec<Predicted>, DiagnoseError> {
        let mut answers = Vec::with_capacity(points.len());
        let records = points.first().map_or(1, |(of, _)| of.windows.len()).max(1);
        for some in points.chunks((BATCH / records).max(1)) {
            answers.extend(self.batch(some)?);
        }
        Ok(answers)
    }

    fn batch(&mut self, points: &[(&Runnable, DVector<f64>)]) -> Result<Vec<Predicted>, DiagnoseError> {
        let mut jobs = Vec::new();
        for (particle, (of, theta)) in points.iter().enumerate() {
            let setup = self.fleet.install(&of.study.setup)?;
            for (record, window) in &of.windows {
                let theta = of.study.theta_for(*record, theta.as_slice());
                let (particle, record, window) = (particle as u32, *record as u32, Arc::clone(window));
                jobs.push((setup, Job::<Held> { particle, record, window, theta, state: None }));
            }
        }
        self.tell(jobs.len());
        self.n_run += jobs.len() as u64;
        let mut outcomes = self.fleet.run_held(jobs)?.into_iter();
        self.tell(0);
        let mut answers = Vec::with_capacity(points.len());
        for (particle, (of, _)) in points.iter().enumerate() {
            let mut outputs: Vec<Vec<f64>> = vec![Vec::new(); of.study.records.len()];
            let mut failure = None;
            for ((record, window), outcome) in of.windows.iter().zip(outcomes.by_ref()) {
                match outcome.result {
                    Ok(prediction) => {
                        let (n, wanted) = (prediction.outputs.len(), window.observed.len());
                        if n != wanted {
                            return Err(no_answer(&of.study, particle, *record, n, wanted));
                        }
                        outputs[*record] = prediction.outputs;
                        of.study.measure(*record, &window.times, &mut outputs[*record]);
                    }
                    Err(reason) => failure = failure.or_else(|| Some(reason.to_string())),
                }
            }
            answers.push(failure.map_or_else(|| self.picked(&outputs, of.study.setup.outputs.len()), Err));
        }
        Ok(answers)
    }

    /// Of the outputs of every record those of the rows.
    fn picked(&self, outputs: &[Vec<f64>], n_output: usize) -> Predicted {
        let value = |row: &Row| outputs[row.record][row.step * n_output + row.output];
        let picked: Vec<f64> = self.rows.iter().map(value).collect();
        match picked.iter().position(|value| !value.is_finite()) {
            None => Ok(picked),
            Some(at) => Err(format!("predicts {} at time {}", picked[at], self.rows[at].time)),
        }
    }

    /// (observed − predicted) / noise of every row.
    pub(crate) fn residual(&self, predicted: &[f64]) -> DVector<f64> {
        let scaled = self.rows.iter().zip(predicted).map(|(row, y)| (row.observed - y) / row.noise);
        DVector::from_iterator(self.rows.len(), scaled)
    }
}
