//! What the template needs: texts already formatted and figures already drawn.
//!
//! The template (`locus.html`) only arranges, and its script only moves what is drawn.

use nalgebra::Complex;
use serde::Serialize;
use serde_json::json;
use starlings_models::spectrum::{Beyond, ObserverSpectrum, SpectrumError};
use starlings_study::field::observed_fields;

use super::Locus;
use super::gains::{Ways, frames, shown, ways};
use super::{decay, plane};
use crate::ReportError;
use crate::number::{ABSENT, significant};
use crate::plot::figure::Drawn;
use crate::plot::palette::{Colour, EQUALS};
use crate::plot::series;

/// Poles in the table of slopes.
const ROWS: usize = 10;

/// The page, ready to be arranged.
#[derive(Debug, Serialize)]
pub(super) struct View {
    script: &'static str,
    study: String,
    says: String,
    headline: String,
    facts: Vec<(&'static str, String)>,
    unit: String,
    observers: Vec<ObserverView>,
    refused: Vec<(String, String)>,
    plane: Drawn,
    decay: Drawn,
    /// What the script moves, as JSON.
    data: String,
    gains: Vec<String>,
    rates: Vec<(String, Vec<String>)>,
    slopes: Vec<(String, Vec<String>)>,
}

#[derive(Debug, Serialize)]
struct ObserverView {
    name: String,
    colour: String,
    best_gain: String,
    best: String,
    beyond: &'static str,
    gain_for_decay: String,
}

impl View {
    /// Follows the poles, draws and formats.
    ///
    /// # Errors
    ///
    /// A pole cannot be followed or a figure cannot be drawn.
    pub(super) fn new(locus: &Locus<'_>) -> Result<Self, ReportError> {
        let unit = format!("1/{}", locus.time_unit);
        let colours: Vec<Colour> = EQUALS.into_iter().cycle().take(locus.observers.len()).collect();
        let names: Vec<String> = locus.observers.iter().map(|o| o.name.clone()).collect();
        let shown = shown(locus.poles, locus.listed);
        let gains = frames(&shown, locus.observers);
        let ways = follow(locus.observers, &shown, &gains)?;
        let equals = (colours.as_slice(), names.as_slice());
        let plane = plane::draw(&shown, &ways, equals, &unit);
        let figure = decay::draw(locus.observers, &ways, &gains, equals, (locus.decay, &unit));
        let classes: Vec<&str> = colours.iter().map(|c| c.name).collect();
        let buckets = series::buckets(0);
        let data = json!({
            "gain": gains.iter().map(|gain| significant(*gain, 3)).collect::<Vec<_>>(),
            "colour": classes,
            "place": plane.positions,
            "rate": ways.iter().map(rates).collect::<Vec<_>>(),
            "cursor": figure.cursor,
        });
        Ok(Self {
            script: include_str!("locus.js"),
            study: locus.study.to_owned(),
            says: locus.says.to_owned(),
            headline: headline(locus, &unit),
            facts: facts(locus, &unit),
            observers: locus.observers.iter().zip(&classes).map(|(o, colour)| observer(o, colour)).collect(),
            refused: locus.refused.to_vec(),
            plane: plane.figure.drawn(buckets)?,
            decay: figure.figure.drawn(buckets)?,
            // Inside a script element no text may close it.
            data: data.to_string().replace('<', "\\u003c"),
            gains: locus
                .observers
                .first()
                .map_or_else(Vec::new, |o| o.gain.iter().map(|g| gain_text(*g)).collect()),
            rates: locus
                .observers
                .iter()
                .map(|o| (o.name.clone(), o.max_re.iter().map(|r| rate_text(*r)).collect()))
                .collect(),
            slopes: slopes(locus),
            unit,
        })
    }
}

/// The poles of every observer, followed at the same time.
fn follow(
    observers: &[ObserverSpectrum],
    shown: &[Complex<f64>],
    gains: &[f64],
) -> Result<Vec<Ways>, ReportError> {
    let results: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = observers.iter().map(|o| scope.spawn(move || ways(o, shown, gains))).collect();
        threads.into_iter().map(std::thread::ScopedJoinHandle::join).collect()
    });
    let result = |result: std::thread::Result<Result<Ways, SpectrumError>>| {
        let result =
            result.map_err(|_| ReportError::drawing("the poles of an observer could not be followed"))?;
        result.map_err(ReportError::drawing)
    };
    results.into_iter().map(result).collect()
}

fn facts(locus: &Locus<'_>, unit: &str) -> Vec<(&'static str, String)> {
    let mut facts = vec![("Model", locus.model.to_owned()), ("Observed", outputs(locus))];
    facts.push(("Poles", locus.poles.len().to_string()));
    let slowest = locus.poles.iter().map(|pole| pole.re).fold(f64::NEG_INFINITY, f64::max);
    facts.push(("max Re λ without observer", format!("{} {unit}", rate_text(slowest))));
    if let Some(decay) = locus.decay {
        let (factor, time) = (decay.factor(), decay.time());
        facts.push(("Wanted decay", format!("by {factor} in {time} {}", locus.time_unit)));
    }
    facts
}

/// The observed outputs, components of a field taken together.
fn outputs(locus: &Locus<'_>) -> String {
    observed_fields(locus.outputs).join(", ")
}

fn headline(locus: &Locus<'_>, unit: &str) -> String {
    let best = locus.observers.iter().min_by(|p, q| p.best.max_re.total_cmp(&q.best.max_re));
    match best {
        Some(o) if o.best.beyond != Beyond::NoGain => {
            // At critical damping a pole has half of the usual digits.
            let as_fast = |p: &&ObserverSpectrum| p.best.max_re <= (1.0 - 1e-4) * o.best.max_re;
            let names: Vec<&str> = locus.observers.iter().filter(as_fast).map(|p| p.name.as_str()).collect();
            format!(
                "With {} the slowest error decays fastest: at {} {unit}, with a gain of {} {unit}.",
                names.join(" or "),
                rate_text(-o.best.max_re),
                significant(o.best.gain, 3)
            )
        }
        Some(_) => "No observer makes the slowest error decay faster.".to_owned(),
        None => "The model can host none of the observers with the observed outputs.".to_owned(),
    }
}

fn observer(o: &ObserverSpectrum, colour: &str) -> ObserverView {
    ObserverView {
        name: o.name.clone(),
        colour: colour.to_owned(),
        best_gain: gain_text(o.best.gain),
        best: rate_text(o.best.max_re),
        beyond: match o.best.beyond {
            Beyond::Slower => "slower: over-damping",
            Beyond::Same => "no faster",
            Beyond::Faster => "still faster at the end of the scan",
            Beyond::NoGain => "no gain helps the slowest error",
        },
        gain_for_decay: o.gain_for_decay.map_or(ABSENT.to_owned(), gain_text),
    }
}

/// Per listed pole, upper half plane, its slope under every observer.
fn slopes(locus: &Locus<'_>) -> Vec<(String, Vec<String>)> {
    let upper =
        locus.poles.iter().enumerate().take(locus.listed).filter(|(_, pole)| pole.im >= 0.0).take(ROWS);
    let slope = |o: &ObserverSpectrum, i: usize| {
        let slope = o.slopes.get(i).and_then(|slope| slope.analytic);
        slope.map_or(ABSENT.to_owned(), |slope| rate_text(slope.re))
    };
    let row = |(i, pole): (usize, &Complex<f64>)| {
        let imaginary =
            if pole.im > 0.0 { format!(" ± {} i", significant(pole.im, 6)) } else { String::new() };
        let text = format!("{}{imaginary}", rate_text(pole.re));
        (text, locus.observers.iter().map(|o| slope(o, i)).collect())
    };
    upper.map(row).collect()
}

/// Decay rate at every gain, as text.
fn rates(ways: &Ways) -> Vec<String> {
    ways.max_re.iter().map(|re| rate_text(*re)).collect()
}

fn gain_text(gain: f64) -> String {
    if gain.abs() > 0.0 { significant(gain, 5) } else { "0".to_owned() }
}

/// A real part; what only rounding keeps from zero is zero.
fn rate_text(rate: f64) -> String {
    if rate.abs() < 1e-9 { "0".to_owned() } else { significant(rate, 5) }
}
