//! The experiment that would best tell two versions apart, tied ones or the nearest to what nothing explains: what to measure, how to
//! drive, how long to record.
//!
//! Every experiment is simulated with both versions as fitted; their difference in the noise of the channels is
//! how well it separates them. The model's own parameters would be fitted again in the new data, so the figure is an upper
//! bound, and so is the one for the data at hand that it is compared with. Next file to read: [`crate::judge::verdict`].

use std::sync::Arc;

use starlings_models::{Job, Signal, Window};
use starlings_study::{Record, Study};

use super::result::Experiment;
use crate::error::ExplainError;
use crate::fit::fitted_variant::FittedVariant;
use crate::locate::Track;
use crate::number::three;
use crate::rows::Rows;
use crate::run_cache::RunCache;

/// Noise of a quantity that was never measured, as a share of its spread.
const NEW_CHANNEL: f64 = 0.03;
/// Difference in χ² up to which a verdict can call two variants tied.
const SEPARATED: f64 = 12.0;
/// Difference in χ² beyond which its size says nothing: any two such versions are told apart, and one of them may have left where it holds.
const PLAIN: f64 = 1e6;
/// Difference of two courses that are one quantity, as a share of its spread.
const SAME: f64 = 1e-9;
/// Factor on the swing of an input, and its inverse.
const HARDER: f64 = 2.0;

/// One experiment.
struct Trial {
    says: String,
    window: Window,
    /// Names of what is measured, with noise sd.
    measured: Vec<(String, f64)>,
}

/// Simulates experiments with two versions; nothing when they differ nowhere.
///
/// # Errors
/// When the fleet fails.
pub(crate) fn propose(
    cache: &mut RunCache<'_>,
    versions: [&FittedVariant<'_>; 2],
    tracks: &[Track],
) -> Result<Option<Experiment>, ExplainError> {
    let study = cache.study;
    let Some(record) = study.records.iter().position(Record::is_trained) else { return Ok(None) };
    let trials = trials(study, &cache.rows, record, tracks);
    let mut separations = separations(cache, versions, record, &trials)?.into_iter();
    let now = separations.next().flatten().unwrap_or(0.0);
    let mut tried: Vec<(String, f64)> =
        trials.into_iter().skip(1).zip(separations).filter_map(|(trial, s)| Some((trial.says, s?))).collect();
    tried.sort_by(|a, b| b.1.total_cmp(&a.1));
    let Some((says, separation)) = tried.first().cloned() else { return Ok(None) };
    let between = versions.map(|fit| fit.variant.name()).to_vec();
    Ok(Some(Experiment { says, between, separation, separation_now: now, tried }))
}

impl Experiment {
    /// What the best of the simulated experiments is worth, in one sentence.
    pub fn sentence(&self) -> String {
        // Differences by rounding count as zero.
        let figure = |chi2: f64| match chi2 {
            _ if chi2 < 1e-3 => three(0.0),
            _ if chi2 > PLAIN => "more than a million".to_owned(),
            _ => three(chi2),
        };
        let (separation, now) = (figure(self.separation), figure(self.separation_now));
        let of = if self.between.is_empty() { "them".to_owned() } else { self.between.join(" and ") };
        if self.separation < SEPARATED {
            return format!(
                "none of the {} simulated experiments would separate {of}: the best, {}, gives a difference in χ² of {separation}, \
                 the data at hand {now}",
                self.tried.len(),
                self.says
            );
        }
        format!(
            "to separate {of}, {}: a difference in χ² of {separation} at most, where the data at hand give {now}",
            self.says
        )
    }
}

/// The record as it was, then the experiments that could be made instead.
fn trials(study: &Study, rows: &Rows, record: usize, tracks: &[Track]) -> Vec<Trial> {
    let as_it_was = study.whole(record, false);
    let channels = &study.records[record].channels;
    let measured = channels.iter().enumerate();
    let measured: Vec<(String, f64)> =
        measured.map(|(c, of)| (of.output.clone(), rows.noise_of(record, c).unwrap_or(of.noise))).collect();
    let trial = |says: String, window: Window, measured: &[(String, f64)]| Trial {
        says,
        window,
        measured: measured.to_vec(),
    };
    let mut list = vec![trial(String::new(), as_it_was.clone(), &measured)];
    let is_input = |track: &&Track| study.spec.inputs.iter().any(|input| input.name == track.name);
    let known: Vec<&Track> = tracks.iter().filter(|t| channels.iter().any(|c| c.output == t.name)).collect();
    for track in tracks.iter().filter(|t| !is_input(t) && !is_measured(t, &known, record)) {
        let noise = NEW_CHANNEL * spread(&track.values[record]);
        if noise > 0.0 {
            let with = [measured.as_slice(), &[(track.name.clone(), noise)]].concat();
            let says =
                format!("measure {} as well, to {:.0} % of its spread", track.name, 100.0 * NEW_CHANNEL);
            list.push(trial(says, as_it_was.clone(), &with));
        }
    }
    // A constant input has no swing.
    let moves = |i: usize| spread(&as_it_was.inputs[i].values) > 0.0;
    for (i, input) in study.spec.inputs.iter().enumerate().filter(|(i, _)| moves(*i)) {
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

/// Whether a record holds the course of a quantity: by its name, or as an output that is nothing but it.
fn is_measured(track: &Track, known: &[&Track], record: usize) -> bool {
    known.iter().any(|measured| {
        let (own, other) = (&track.values[record], &measured.values[record]);
        let apart = own.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        measured.name == track.name || apart <= SAME * spread(other)
    })
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

/// Twice as many observations, inputs repeated from the start of the window on; samples before it, which a delay reads, stay.
fn stretched(window: &Window, n_obs: usize) -> Window {
    let last = window.times.last().copied().unwrap_or(window.start);
    let step =
        if window.times.len() > 1 { (last - window.start) / (window.times.len() - 1) as f64 } else { 1.0 };
    let span = last - window.start + step;
    let later = |times: &[f64]| times.iter().map(|t| t + span).collect::<Vec<_>>();
    let inputs = window.inputs.iter().map(|signal| {
        let from = signal.times.partition_point(|t| *t < window.start);
        let to = signal.times.partition_point(|t| *t < window.start + span).max(1);
        let (mut times, mut values) = (signal.times[..to].to_vec(), signal.values[..to].to_vec());
        for (t, value) in later(&signal.times[..to]).into_iter().zip(&signal.values).skip(from) {
            // Late times may round to the same number; only the first of such samples is kept.
            if times.last().is_some_and(|last| *last < t) {
                times.push(t);
                values.push(*value);
            }
        }
        Signal { times, values }
    });
    let times = [window.times.as_slice(), &later(&window.times)].concat();
    Window::free(window.start, times, n_obs, inputs.collect())
}

/// χ² between two variants in each trial, all in one batch; nothing where one of them fails. The budget decides how many of the
/// trials there are.
fn separations(
    cache: &mut RunCache<'_>,
    versions: [&FittedVariant<'_>; 2],
    record: usize,
    trials: &[Trial],
) -> Result<Vec<Option<f64>>, ExplainError> {
    let afforded = (1..=trials.len()).take_while(|n| cache.affords_runs(2 * *n as u64)).count();
    let trials = &trials[..afforded];
    let mut runs = Vec::with_capacity(2 * afforded);
    for trial in trials {
        let observed = vec![f64::NAN; trial.measured.len() * trial.window.times.len()];
        let window = Arc::new(Window { observed, ..trial.window.clone() });
        for fit in versions {
            let mut study = fit.variant.study.clone();
            study.setup.outputs = trial.measured.iter().map(|(name, _)| name.clone()).collect();
            let theta = study.theta_for(record, fit.theta().as_slice());
            let (particle, record, window) = (runs.len() as u32, record as u32, Arc::clone(&window));
            runs.push((study, Job { particle, record, window, theta, state: None }));
        }
    }
    let outputs = cache.run_alone(runs.iter().map(|(study, job)| (study, job.clone())).collect())?;
    let apart = |(trial, pair): (&Trial, &[Option<Arc<Vec<f64>>>])| {
        let [Some(a), Some(b)] = pair else { return None };
        let noise = trial.measured.iter().map(|(_, noise)| *noise).cycle();
        Some(a.iter().zip(b.iter()).zip(noise).map(|((a, b), noise)| ((a - b) / noise).powi(2)).sum())
    };
    Ok(trials.iter().zip(outputs.chunks(2)).map(apart).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_beyond_every_doubt_is_not_told_to_its_last_power() {
        let says = |separation: f64| {
            let between = vec!["leak".to_owned(), "drag".to_owned()];
            let (says, tried) = ("record twice as long".to_owned(), Vec::new());
            Experiment { says, between, separation, separation_now: 3.0, tried }.sentence()
        };
        assert!(says(1.77e52).contains("χ² of more than a million at most"), "{}", says(1.77e52));
        assert!(says(2e5).contains("χ² of 200000 at most"), "{}", says(2e5));
    }

    #[test]
    fn a_state_that_an_output_shows_as_it_is_needs_no_channel_of_its_own() {
        let track = |name: &str, scale: f64| Track {
            name: name.to_owned(),
            unit: String::new(),
            values: vec![(0..5).map(|k| scale * f64::from(k)).collect()],
        };
        let (output, state, speed) = (track("position", 1.0), track("x", 1.0), track("v", 1.001));
        let found = |t: &Track| is_measured(t, &[&output], 0);
        assert!(found(&output) && found(&state) && !found(&speed));
    }

    #[test]
    fn a_record_twice_as_long_repeats_its_inputs_from_its_start_on_and_time_never_goes_back() {
        // A delay may ask for an input before the record starts: two samples lie there.
        let times: Vec<f64> = (0..12).map(|k| 0.5 * f64::from(k) - 1.0).collect();
        let values: Vec<f64> = (0..12).map(f64::from).collect();
        let window = Window::free(0.0, vec![0.0, 1.0, 2.0, 3.0], 2, vec![Signal { times, values }]);
        let longer = stretched(&window, 2);
        assert_eq!(longer.times, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        assert_eq!(longer.observed.len(), 16);
        let input = &longer.inputs[0];
        assert!(input.times.windows(2).all(|w| w[0] < w[1]), "{:?}", input.times);
        assert_eq!(input.times.len(), input.values.len());
        for t in [0.0, 0.25, 1.5, 3.5] {
            assert!((input.at(t) - window.inputs[0].at(t)).abs() < 1e-12, "as it was at {t}");
            assert!((input.at(t + 4.0) - window.inputs[0].at(t)).abs() < 1e-12, "again at {t}");
        }
        assert!((input.at(-1.0) - 0.0).abs() < 1e-12, "what was before the start stays");
    }
}
