//! From the store to what a report shows; the only way from a run to its pictures.
//!
//! A running or killed run can be read as well: what is not there yet stays empty. Next files to read: [`super::data`],
//! `reader/fleet.rs` for what the fleet did.

mod fleet;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use starlings_estimators::{autocorrelation, nis_band};
use starlings_study::ObserverCourse;
use starlings_study::posterior::Estimate;
use starlings_study::predicted;
use starlings_study::store::folder::{OBSERVER, PREDICTION_SD, StudyInfo};
use starlings_study::store::{Store, StoreError};
use starlings_study::summary::Summary;

use super::data::{
    Autocorrelation, ChannelPlot, Family, NisSeries, ObserverPlot, ObserverRow, ParameterRow, PassTrack,
    ReportData, Track,
};

/// Lags shown in an autocorrelation plot.
const MAX_LAG: usize = 60;

/// Everything a report shows, as far as the run has come.
///
/// # Errors
/// When the database refuses or its content is damaged.
pub fn report_data(store: &Store) -> Result<ReportData, StoreError> {
    let info = store.meta("info")?.unwrap_or_default();
    let info: StudyInfo = serde_json::from_str(&info).map_err(|e| store.damaged("study description", e))?;
    let summary: Option<Summary> = match store.meta("summary")? {
        Some(text) => Some(serde_json::from_str(&text).map_err(|e| store.damaged("summary", e))?),
        None => None,
    };
    let mut data = ReportData {
        tracks: tracks(store, &info, summary.as_ref())?,
        channels: channels(store, &info)?,
        predicted: predicted::read(store)?,
        nis: nis(store)?,
        fleet: fleet::table(store, summary.as_ref())?,
        x_label: if info.batch { "iteration".to_owned() } else { format!("time [{}]", info.time_unit) },
        study: info.name.clone(),
        says: info.says,
        model: info.model,
        estimator: info.estimator,
        seed: info.seed,
        time_unit: info.time_unit,
        started: Some(info.started).filter(|s| !s.is_empty()),
        command: info.command,
        version: info.version,
        ..ReportData::default()
    };
    data.autocorrelation = data.channels.iter().filter_map(residual_autocorrelation).collect();
    match summary {
        Some(summary) => {
            data.observer = observer(store, &summary)?;
            finished(&mut data, summary);
            data.families = families(&data.parameters, &info.stiffness);
        }
        None => data.warnings.push("the run is not finished: continue it with --resume".to_owned()),
    }
    Ok(data)
}

/// What the run with the observer showed, if there was one.
fn observer(store: &Store, summary: &Summary) -> Result<Option<ObserverRow>, StoreError> {
    let Some(fit) = &summary.observer else { return Ok(None) };
    let courses: Vec<ObserverCourse> = match store.meta(OBSERVER)? {
        Some(text) => serde_json::from_str(&text).map_err(|e| store.damaged("observer", e))?,
        None => Vec::new(),
    };
    let plot =
        |c: ObserverCourse| ObserverPlot { record: c.record, time: c.time, with: c.with, without: c.without };
    Ok(Some(ObserverRow {
        kind: fit.kind.clone(),
        gain: fit.gain,
        with: fit.innovation_rms_with,
        without: fit.innovation_rms_without,
        courses: courses.into_iter().map(plot).collect(),
    }))
}

/// Families of at least three parameters of one unit whose names are a stem and a number.
fn families(parameters: &[ParameterRow], stiffness: &[String]) -> Vec<Family> {
    let mut families: Vec<(Family, &str)> = Vec::new();
    for (index, row) in parameters.iter().enumerate() {
        let stem = row.name.trim_end_matches(|c: char| c.is_ascii_digit());
        let Ok(number) = row.name[stem.len()..].parse() else { continue };
        let known = families.iter().position(|(f, unit)| f.stem == stem && *unit == row.unit);
        let at = known.unwrap_or_else(|| {
            families.push((Family { stem: stem.to_owned(), ..Family::default() }, &row.unit));
            families.len() - 1
        });
        families[at].0.members.push((number, index));
    }
    let all_stiff = |f: &Family| f.members.iter().all(|(_, row)| stiffness.contains(&parameters[*row].name));
    let large = families.into_iter().map(|(f, _)| f).filter(|f| f.members.len() >= 3 && !f.stem.is_empty());
    large
        .map(|mut family| {
            family.members.sort_unstable();
            Family { stiffness: all_stiff(&family), ..family }
        })
        .collect()
}

fn finished(data: &mut ReportData, summary: Summary) {
    data.residuals_first = summary.residuals_first();
    data.warnings = summary.warnings;
    data.estimator = summary.estimator;
    data.hangs_on = summary.hangs_on;
    data.predictions = summary.predictions;
    data.wall_s = summary.wall_s;
    data.correlation = summary.correlation;
    data.nis_per_observation = Some(summary.fit.nis_per_observation);
    data.log_likelihood = Some(summary.fit.log_likelihood);
    data.conditional_on = summary.conditional_on;
    data.parameters = summary.parameters.into_iter().map(|p| parameter(p, data.residuals_first)).collect();
}

fn parameter(p: Estimate, residuals_first: bool) -> ParameterRow {
    let given = p.interval95_given_residuals.zip(p.sd_given_residuals);
    let ([lo, hi], sd, other) = match given {
        Some((ends, sd)) if residuals_first => (ends, sd, Some(p.interval95)),
        _ => (p.interval95, p.sd, p.interval95_given_residuals),
    };
    ParameterRow {
        name: p.name,
        unit: p.unit,
        estimate: p.estimate,
        sd,
        lo,
        hi,
        other,
        prior_median: p.prior_median,
        prior_lo: p.prior_interval95[0],
        prior_hi: p.prior_interval95[1],
    }
}

/// (name, pass, time, estimate, lo, hi) in the order of the run.
type EstimateAt = (String, usize, f64, f64, f64, f64);

fn tracks(store: &Store, info: &StudyInfo, summary: Option<&Summary>) -> Result<Vec<Track>, StoreError> {
    let rows: Vec<EstimateAt> = store.rows(
        "SELECT e.parameter, e.pass, a.time, e.estimate, e.lo, e.hi FROM estimates e
         JOIN analyses a ON a.pass = e.pass AND a.step = e.step ORDER BY e.pass, e.step, e.rowid",
        |r| Ok((r.get(0)?, r.get(1)?, r.get(2)?, r.get(3)?, r.get(4)?, r.get(5)?)),
    )?;
    let mut tracks: Vec<Track> = Vec::new();
    for (name, pass, time, estimate, lo, hi) in rows {
        let index = tracks.iter().position(|t| t.name == name).unwrap_or_else(|| {
            let of = summary.and_then(|s| s.parameters.iter().find(|p| p.name == name));
            tracks.push(Track {
                name: name.clone(),
                unit: of.map(|p| p.unit.clone()).unwrap_or_default(),
                prior_median: of.map_or(f64::NAN, |p| p.prior_median),
                log_axis: info.logarithmic.contains(&name),
                passes: Vec::new(),
            });
            tracks.len() - 1
        });
        let passes = &mut tracks[index].passes;
        if passes.last().is_none_or(|p| p.pass != pass) {
            passes.push(PassTrack { pass, ..PassTrack::default() });
        }
        if let Some(track) = passes.last_mut() {
            track.time.push(time);
            track.estimate.push(estimate);
            track.lo.push(lo);
            track.hi.push(hi);
        }
    }
    Ok(tracks)
}

/// (record, output, time, observed, predicted, use, noise) in the order of the run.
type PredictedAt = (String, String, f64, Option<f64>, f64, String, f64);

fn channels(store: &Store, info: &StudyInfo) -> Result<Vec<ChannelPlot>, StoreError> {
    let rows: Vec<PredictedAt> = store.rows(
        "SELECT record, output, time, observed, predicted, use, noise FROM predictions ORDER BY rowid",
        |r| Ok((r.get(0)?, r.get(1)?, r.get(2)?, r.get(3)?, r.get(4)?, r.get(5)?, r.get(6)?)),
    )?;
    let spread = spread(store, rows.len())?;
    let mut channels: Vec<(ChannelPlot, Misfit)> = Vec::new();
    for ((record, output, time, observed, predicted, usage, noise), spread) in rows.into_iter().zip(spread) {
        if channels.last().is_none_or(|(c, _)| c.record != record || c.channel != output) {
            let unit = info.outputs.iter().find(|(name, _)| *name == output).map(|(_, u)| u.clone());
            let train = info.records.iter().find(|(name, _)| *name == record).and_then(|(_, span)| *span);
            let plot = ChannelPlot {
                record,
                channel: output,
                unit: unit.unwrap_or_default(),
                noise,
                train: train.filter(|_| usage != "held-out-channel"),
                held_out_channel: usage == "held-out-channel",
                ..ChannelPlot::default()
            };
            channels.push((plot, Misfit::default()));
        }
        if let Some((plot, misfit)) = channels.last_mut() {
            plot.time.push(time);
            plot.observed.push(observed);
            plot.predicted.push(predicted);
            plot.spread.push(spread);
            misfit.add(usage == "train", observed.map(|o| o - predicted));
        }
    }
    Ok(channels.into_iter().map(|(plot, misfit)| misfit.fill(plot)).collect())
}

/// The standard deviation of each of so many predictions, where it is known.
fn spread(store: &Store, n: usize) -> Result<Vec<Option<f64>>, StoreError> {
    let Some(text) = store.meta(PREDICTION_SD)? else { return Ok(vec![None; n]) };
    let spread: Vec<Option<f64>> =
        serde_json::from_str(&text).map_err(|e| store.damaged("spread of the predictions", e))?;
    if spread.len() != n {
        return Err(store.damaged("spread of the predictions", "it is of another number of them"));
    }
    Ok(spread)
}

/// Sums of squares over the training and held-out parts of one channel.
#[derive(Default)]
struct Misfit {
    train: (f64, u32),
    held_out: (f64, u32),
}

impl Misfit {
    fn add(&mut self, train: bool, residual: Option<f64>) {
        let part = if train { &mut self.train } else { &mut self.held_out };
        if let Some(residual) = residual {
            part.0 += residual * residual;
            part.1 += 1;
        }
    }

    fn fill(&self, mut plot: ChannelPlot) -> ChannelPlot {
        let rmse = |(sum, n): (f64, u32)| (n > 0).then(|| (sum / f64::from(n)).sqrt());
        plot.train_rmse = rmse(self.train);
        plot.held_out_rmse = rmse(self.held_out);
        plot
    }
}

fn residual_autocorrelation(plot: &ChannelPlot) -> Option<Autocorrelation> {
    let inside = |t: f64| plot.train.is_none_or(|[from, to]| t >= from && t <= to);
    let (times, residuals): (Vec<f64>, Vec<f64>) = plot
        .time
        .iter()
        .zip(plot.observed.iter().zip(&plot.predicted))
        .filter(|(t, _)| inside(**t))
        .filter_map(|(t, (o, p))| o.map(|o| (*t, o - p)))
        .unzip();
    if residuals.len() < 3 {
        return None;
    }
    let value = autocorrelation(&residuals, MAX_LAG.min(residuals.len() - 1));
    let spacing = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
    Some(Autocorrelation {
        record: plot.record.clone(),
        channel: plot.channel.clone(),
        lag_time: (0..value.len()).map(|lag| lag as f64 * spacing).collect(),
        value,
        band: 1.96 / (residuals.len() as f64).sqrt(),
    })
}

fn nis(store: &Store) -> Result<Vec<NisSeries>, StoreError> {
    let rows: Vec<(usize, f64, f64, usize)> = store
        .rows("SELECT pass, time, nis, n_used FROM analyses WHERE n_used > 0 ORDER BY pass, step", |r| {
            Ok((r.get(0)?, r.get(1)?, r.get(2)?, r.get(3)?))
        })?;
    let mut series: Vec<NisSeries> = Vec::new();
    // A quantile of chi-square is a search; only a few numbers of values occur.
    let mut bands = BTreeMap::new();
    for (pass, time, nis, n_used) in rows {
        if series.last().is_none_or(|s| s.pass != pass) {
            series.push(NisSeries { pass, ..NisSeries::default() });
        }
        if let Some(s) = series.last_mut() {
            let (lo, hi) = *bands.entry(n_used).or_insert_with(|| nis_band(n_used, 0.95));
            s.time.push(time);
            s.nis_per_observation.push(nis / n_used as f64);
            s.lo.push(lo);
            s.hi.push(hi);
            s.n_used.push(n_used);
        }
    }
    Ok(series)
}
