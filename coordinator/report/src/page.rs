//! What the page's template needs: texts already formatted and figures already drawn.
//!
//! The template (`report.html`) only arranges; every number is formatted here or in a figure. Next file to read:
//! [`figures`].

pub(crate) mod figures;
mod outputs;
mod predicted;

use serde::Serialize;

use super::data::{ObserverRow, ParameterRow, ReportData};
use super::hangs_on::{self, HangsOnView};
use super::plot::figure::Slots;
use super::plot::interval;
use super::{ReportError, correlation, headline, number};

/// At most this many events of the fleet are listed.
const EVENTS: usize = 60;

/// What the intervals are called.
const STATED: &str = "95\u{a0}% at the stated noise";
const GIVEN: &str = "95\u{a0}% given the residuals";

/// The page, ready to be arranged.
#[derive(Debug, Serialize)]
pub(crate) struct Page<'a> {
    data: &'a ReportData,
    headline: String,
    /// What the two intervals of every parameter are called, in their order.
    intervals: [&'static str; 2],
    facts: Vec<(&'static str, String)>,
    parameters: Vec<ParameterView>,
    figures: Slots,
    /// What the observer does, in a sentence.
    observer: Option<String>,
    hangs_on: Option<HangsOnView>,
    nis_mean: String,
    log_likelihood: String,
    correlation: Vec<Vec<correlation::Cell>>,
    /// Names of the parameters in the table of correlations.
    correlated: Vec<&'a str>,
    correlation_left_out: usize,
    /// The strongest correlation, in words.
    strongest: Option<String>,
    /// What was predicted besides, in numbers.
    predicted: Vec<predicted::PredictedView>,
    predicted_left_out: usize,
    /// Fits that are not drawn.
    fits_left_out: usize,
    fleet: FleetView,
}

#[derive(Debug, Serialize)]
struct ParameterView {
    name: String,
    unit: String,
    estimate: String,
    sd: String,
    interval: String,
    other: String,
    prior_median: String,
    strip: String,
}

#[derive(Debug, Serialize)]
struct FleetView {
    counts: Vec<(&'static str, String)>,
    workers: Vec<Vec<String>>,
    events: Vec<(String, String)>,
    events_left_out: usize,
}

impl<'a> Page<'a> {
    /// Draws and formats everything that `data` holds.
    ///
    /// # Errors
    ///
    /// A figure cannot be drawn.
    pub(crate) fn new(data: &'a ReportData) -> Result<Self, ReportError> {
        let optional = |value: Option<f64>| {
            value.map_or(number::ABSENT.to_owned(), |v| {
                number::with_sd(v, if v.abs() < 100.0 { 0.1 } else { 1.0 })
            })
        };
        Ok(Self {
            data,
            headline: headline::of(data),
            intervals: if data.residuals_first { [GIVEN, STATED] } else { [STATED, GIVEN] },
            facts: facts(data),
            parameters: data.parameters.iter().map(|row| parameter(row, data)).collect(),
            figures: figures::draw(data)?,
            observer: data.observer.as_ref().map(|row| observer(row, data)),
            hangs_on: hangs_on::view(data.hangs_on.as_ref()),
            nis_mean: optional(data.nis_per_observation),
            log_likelihood: optional(data.log_likelihood),
            correlation: data
                .correlation
                .iter()
                .take(correlation::MOST)
                .enumerate()
                .map(|(k, row)| correlation::row(k, &row[..row.len().min(correlation::MOST)]))
                .collect(),
            correlated: data.parameters.iter().take(correlation::MOST).map(|row| row.name.as_str()).collect(),
            correlation_left_out: data.parameters.len().saturating_sub(correlation::MOST),
            strongest: strongest(data),
            predicted: predicted::rows(data),
            predicted_left_out: predicted::left_out(data),
            fits_left_out: figures::fit::left_out(data),
            fleet: fleet(data),
        })
    }
}

/// The strongest correlation between two parameters, in words.
fn strongest(data: &ReportData) -> Option<String> {
    let rows = data.correlation.iter().enumerate();
    let pairs = rows.flat_map(|(i, row)| row.iter().enumerate().take(i).map(move |(j, r)| (i, j, *r)));
    let (i, j, r) = pairs.filter(|p| p.2.is_finite()).max_by(|p, q| p.2.abs().total_cmp(&q.2.abs()))?;
    let [beside, below] = [j, i].map(|at| data.parameters.get(at).map_or("", |row| row.name.as_str()));
    Some(format!("strongest: {beside} and {below}, {}", number::with_sd(r, 0.1)))
}

fn facts(data: &ReportData) -> Vec<(&'static str, String)> {
    let mut facts = vec![("Model", data.model.clone()), ("Estimator", data.estimator.clone())];
    if let Some(started) = &data.started {
        facts.push(("Started", number::date(started)));
    }
    // Of a run that is not finished it is not known.
    if data.wall_s > 0.0 {
        facts.push(("Wall time", number::duration(data.wall_s)));
    }
    facts.retain(|(_, text)| !text.is_empty());
    facts
}

fn observer(row: &ObserverRow, data: &ReportData) -> String {
    let digits = |value: f64| number::significant(value, 3);
    let per = if data.time_unit.is_empty() { String::new() } else { format!("\u{a0}1/{}", data.time_unit) };
    format!(
        "With the observer {} at a gain of {}{per} the model, at the estimate, misses the next observation by {} noise sd; a \
         run without it misses the same data by {}.",
        row.kind,
        digits(row.gain),
        digits(row.with),
        digits(row.without)
    )
}

fn parameter(row: &ParameterRow, data: &ReportData) -> ParameterView {
    let digits = |value| number::with_sd(value, row.sd);
    ParameterView {
        name: row.name.clone(),
        unit: row.unit.clone(),
        estimate: digits(row.estimate),
        sd: number::significant(row.sd, 2),
        interval: format!("{} to {}", digits(row.lo), digits(row.hi)),
        other: row.other.map_or_else(
            || number::ABSENT.to_owned(),
            |[lo, hi]| {
                // Its own length tells how many digits it deserves; an interval of 95 % is about four sd long.
                let of_other = |value| number::with_sd(value, 0.25 * (hi - lo));
                format!("{} to {}", of_other(lo), of_other(hi))
            },
        ),
        prior_median: number::significant(row.prior_median, 3),
        strip: interval::strip(row, data.log_axis(&row.name)),
    }
}

fn fleet(data: &ReportData) -> FleetView {
    let fleet = &data.fleet;
    let mut counts = vec![
        ("model runs", fleet.runs_total.to_string()),
        ("runs after the fit", fleet.runs_after.to_string()),
        ("failed attempts", fleet.failed.to_string()),
        ("retried", fleet.retried.to_string()),
        ("rescued", fleet.rescued.to_string()),
        ("workers", fleet.workers.len().to_string()),
    ];
    if let Some(times) = &fleet.time_per_run {
        counts.push(("median time per run", number::duration(times.median)));
    }
    let worker = |w: &super::data::WorkerRow| {
        vec![
            w.name.clone(),
            w.host.clone(),
            w.jobs.to_string(),
            w.failed.to_string(),
            number::duration(w.mean_s),
            w.busy_share.map_or(number::ABSENT.to_owned(), number::percent),
        ]
    };
    let listed = fleet.events.iter().take(EVENTS);
    FleetView {
        counts,
        workers: fleet.workers.iter().map(worker).collect(),
        events: listed.map(|e| (number::duration(e.time_s), e.text.clone())).collect(),
        events_left_out: fleet.events.len().saturating_sub(EVENTS),
    }
}
