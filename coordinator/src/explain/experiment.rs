//! The experiment that would tell tied effects apart: what to measure, how to drive, how long to record.
//!
//! Every experiment is simulated with each of the tied versions as fitted; their difference in the noise of the channels is
//! how well it separates them. The model's own parameters would be fitted again in the new data, so the figure is an upper
//! bound, and so is the one for the data at hand that it is compared with. Next file to read: [`super::verdict`].

use std::sync::Arc;

use nalgebra::DVector;
use starlings_models::{Job, Signal, Window};

use super::ExplainError;
use super::judge::Judged;
use super::laboratory::Laboratory;
use super::locate::Track;
use super::result::Experiment;
use crate::study::{Record, Study};

/// Noise of a quantity that was never measured, as a share of its spread.
const NEW_CHANNEL: f64 = 0.03;
/// Factors on the drive.
const HARDER: f64 = 2.0;

/// One thing to do.
struct Trial {
    says: String,
    window: Window,
    /// Names of what is measured, with noise sd.
    measured: Vec<(String, f64)>,
}

/// Simulates experiments with the best version and its nearest rival; nothing when neither differs anywhere.
///
/// # Errors
/// When the fleet fails.
pub(super) fn propose(
    laboratory: &mut Laboratory<'_>,
    best: &Judged<'_>,
    rival: &Judged<'_>,
    tracks: &[Track],
) -> Result<Option<Experiment>, ExplainError> {
    let study = laboratory.study;
    let Some(record) = study.records.iter().position(Record::is_trained) else { return Ok(None) };
    let mut trials = trials(study, record, tracks);
    let mut separations = Vec::new();
    for trial in &trials {
        separations.push(separation(laboratory, best, rival, record, trial)?);
    }
    let now = separations.remove(0).unwrap_or(0.0);
    trials.remove(0);
    let mut tried: Vec<(String, f64)> =
        trials.into_iter().zip(separations).filter_map(|(trial, s)| Some((trial.says, s?))).collect();
    tried.sort_by(|a, b| b.1.total_cmp(&a.1));
    let Some((says, separation)) = tried.first().cloned() else { return Ok(None) };
    Ok(Some(Experiment { says, separation, separation_now: now, tried }))
}

/// The record as it was, then everything that could be done instead.
fn trials(study: &Study, record: usize, tracks: &[Track]) -> Vec<Trial> {
    let as_it_was = study.whole(record, false);
    let channels = &study.records[record].channels;
    let measured: Vec<(String, f64)> = channels.iter().map(|c| (c.output.clone(), c.noise)).collect();
    let trial = |says: String, window: Window, measured: &[(String, f64)]| Trial {
        says,
        window,
        measured: measured.to_vec(),
    };
    let mut list = vec![trial(String::new(), as_it_was.clone(), &measured)];
    for track in tracks.iter().filter(|t| is_new(study, &measured, &t.name)) {
        let noise = NEW_CHANNEL * spread(&track.values[record]);
        if noise > 0.0 {
            let with = [measured.as_slice(), &[(track.name.clone(), noise)]].concat();
            let says =
                format!("measure {} as well, to {:.0} % of its spread", track.name, 100.0 * NEW_CHANNEL);
            list.push(trial(says, as_it_was.clone(), &with));
        }
    }
    for (i, input) in study.spec.inputs.iter().enumerate() {
        for (factor, word) in [(HARDER, "twice"), (1.0 / HARDER, "half")] {
            let driven = with_input(&as_it_was, i, |signal| scaled(signal, factor));
            list.push(trial(
                format!("drive {} with {word} the swing about its mean", input.name),
                driven,
                &measured,
            ));
        }
        let held = with_input(&as_it_was, i, step_half_way);
        list.push(trial(format!("hold {} at its mean and step it half-way", input.name), held, &measured));
    }
    let longer = stretched(&as_it_was, study.setup.outputs.len());
    list.push(trial("record twice as long".to_owned(), longer, &measured));
    list
}

fn is_new(study: &Study, measured: &[(String, f64)], name: &str) -> bool {
    !measured.iter().any(|(known, _)| known == name) && !study.spec.inputs.iter().any(|q| q.name == name)
}

fn spread(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn with_input(window: &Window, input: usize, change: impl Fn(&Signal) -> Signal) -> Window {
    let mut changed = window.clone();
    changed.inputs[input] = change(&window.inputs[input]);
    changed
}

fn mean(signal: &Signal) -> f64 {
    signal.values.iter().sum::<f64>() / signal.values.len().max(1) as f64
}

fn scaled(signal: &Signal, factor: f64) -> Signal {
    let mean = mean(signal);
    let values = signal.values.iter().map(|v| mean + factor * (v - mean)).collect();
    Signal { times: signal.times.clone(), values }
}

/// The mean, then the mean plus the signal's spread.
fn step_half_way(signal: &Signal) -> Signal {
    let (mean, spread) = (mean(signal), spread(&signal.values));
    let half = signal.values.len() / 2;
    let values = (0..signal.values.len()).map(|i| if i < half { mean } else { mean + spread }).collect();
    Signal { times: signal.times.clone(), values }
}

/// Twice as many observations, inputs repeated.
fn stretched(window: &Window, n_obs: usize) -> Window {
    let last = window.times.last().copied().unwrap_or(window.start);
    let step =
        if window.times.len() > 1 { (last - window.start) / (window.times.len() - 1) as f64 } else { 1.0 };
    let span = last - window.start + step;
    let twice =
        |times: &[f64]| times.iter().copied().chain(times.iter().map(|t| t + span)).collect::<Vec<_>>();
    let inputs = window.inputs.iter().map(|signal| {
        let within = signal.times.partition_point(|t| *t < window.start + span);
        let (times, values) = (&signal.times[..within], &signal.values[..within]);
        Signal { times: twice(times), values: [values, values].concat() }
    });
    Window {
        start: window.start,
        times: twice(&window.times),
        observed: vec![f64::NAN; 2 * window.times.len() * n_obs],
        inputs: inputs.collect(),
    }
}

/// χ² between the two versions in a trial; nothing where one of them fails.
fn separation(
    laboratory: &mut Laboratory<'_>,
    best: &Judged<'_>,
    rival: &Judged<'_>,
    record: usize,
    trial: &Trial,
) -> Result<Option<f64>, ExplainError> {
    if !laboratory.affords(2) {
        return Ok(None);
    }
    let names: Vec<String> = trial.measured.iter().map(|(name, _)| name.clone()).collect();
    let mut outputs = Vec::new();
    for version in [best, rival] {
        let mut study = version.fit.version.study.clone();
        study.setup.outputs.clone_from(&names);
        let theta: DVector<f64> = version.fit.theta();
        let observed = vec![f64::NAN; names.len() * trial.window.times.len()];
        let window = Arc::new(Window { observed, ..trial.window.clone() });
        let theta = study.theta_for(record, theta.as_slice());
        let job = Job { particle: 0, record: record as u32, window, theta, state: None };
        outputs.push(laboratory.run_alone(&study, job)?);
    }
    let [Some(a), Some(b)] = outputs.as_slice() else { return Ok(None) };
    let noise = trial.measured.iter().map(|(_, noise)| *noise).cycle();
    Ok(Some(a.iter().zip(b).zip(noise).map(|((a, b), noise)| ((a - b) / noise).powi(2)).sum()))
}
