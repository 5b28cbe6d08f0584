//! The spectrum as tables for people and as JSON.

use serde_json::{Value, json};
use starlings_coordinator::study::Study;
use starlings_coordinator::study::field::observed_fields;
use starlings_models::spectrum::{Beyond, ObserverSpectrum};

use super::Found;
use crate::console::{line, number, table, text as print_text};
use crate::failure::Failure;

/// Poles in the table where no number is asked for, conjugate pairs as one.
pub(super) const ROWS: usize = 8;

/// The result, machine-readable; a slope that does not exist is null.
pub(super) fn as_json(found: &Found<'_>) -> Value {
    let poles = &found.spectrum.linearised.poles()[..found.spectrum.listed];
    let observers = found.spectrum.observers.iter().map(|o| {
        json!({
            "name": o.name,
            "note": o.note.map(|note| format!("poles {note}")),
            "gain": o.gain,
            "max_re": o.max_re,
            "slope": o.slopes.iter().map(|s| s.analytic.map(|s| s.re)).collect::<Vec<_>>(),
            "slope_imaginary": o.slopes.iter().map(|s| s.analytic.map(|s| s.im)).collect::<Vec<_>>(),
            "slope_numerical": o.slopes.iter().map(|s| s.numerical.map(|s| s.re)).collect::<Vec<_>>(),
            "best": { "gain": o.best.gain, "max_re": o.best.max_re, "beyond": beyond(o.best.beyond) },
            "gain_for_decay": o.gain_for_decay,
        })
    });
    json!({
        "study": found.study.name,
        "model": found.study.setup.model.kind,
        "time_unit": found.study.time_unit,
        "observed": found.study.setup.outputs,
        "n_poles": found.spectrum.linearised.poles().len(),
        "poles": poles.iter().map(|p| [p.re, p.im]).collect::<Vec<_>>(),
        "wanted_max_re": found.spectrum.decay.map(starlings_models::spectrum::Decay::max_re),
        "observers": observers.collect::<Vec<_>>(),
        "stable_share": found.spectrum.stable_share,
        "refused": found.spectrum.refused.iter().map(|(name, why)| json!({ "name": name, "reason": why })).collect::<Vec<_>>(),
    })
}

/// Tables: poles with their slopes, largest real parts, best gains.
pub(super) fn text(found: &Found<'_>) -> Result<(), Failure> {
    let study = found.study;
    let unit = format!("1/{}", study.time_unit);
    let outputs = observed_fields(&study.setup.outputs).join(", ");
    line(format_args!("{}: model {}, observed {outputs}", study.name, study.setup.model.kind))?;
    line(format_args!(
        "\n{} poles; the slowest [{unit}], and Re ∂λ/∂γ",
        found.spectrum.linearised.poles().len()
    ))?;
    print_text(table(&slopes(found), true))?;
    if let Some(error) = disagreement(&found.spectrum.observers) {
        line(format_args!("  from eigenvectors; differences of the poles agree to {error:.0e}"))?;
    }
    line(format_args!("\nmax Re λ [{unit}] against the gain [{unit}]"))?;
    print_text(table(&rates(found), true))?;
    let wanted = found.spectrum.decay.map_or(String::new(), |d| {
        format!(", and the gain for a decay by {} in {} {}", d.factor(), d.time(), study.time_unit)
    });
    line(format_args!("\nbest gain{wanted}"))?;
    print_text(table(&bests(found), true))?;
    for (o, note) in found.spectrum.observers.iter().filter_map(|o| Some((o, o.note?))) {
        line(format_args!("  {}: poles {note}", o.name))?;
    }
    if let Some(share) = found.spectrum.stable_share {
        line(unstable(study, share))?;
    }
    if !found.spectrum.refused.is_empty() {
        line("\nnot possible here")?;
    }
    refusals(&found.spectrum.refused)
        .iter()
        .try_for_each(|(names, why)| line(format_args!("  {}: {why}", names.join(", "))))
}

/// That the study's own observers are unstable together, and at which gains they are not.
fn unstable(study: &Study, share: f64) -> String {
    let own = &study.setup.observer;
    let gains = own.all().map(|def| number(def.gain, None)).collect::<Vec<_>>().join(", ");
    let remedy = if share > 0.0 {
        let stable = own.all().map(|def| number(share * def.gain, None)).collect::<Vec<_>>().join(", ");
        format!("the largest common factor on the gains that is stable is {share:.4} (gains {stable})")
    } else {
        "no common factor on the gains is stable".to_owned()
    };
    format!("  {}: unstable at the gains of the study ({gains} 1/{}); {remedy}", own.name(), study.time_unit)
}

/// Observers with the same reason together.
fn refusals(refused: &[(String, String)]) -> Vec<(Vec<&str>, String)> {
    let mut together: Vec<(Vec<&str>, String)> = Vec::new();
    for (name, why) in refused {
        let why = why.replace(&format!("the observer `{name}` "), "");
        match together.iter_mut().find(|(_, known)| *known == why) {
            Some((names, _)) => names.push(name),
            None => together.push((vec![name], why)),
        }
    }
    together
}

/// A pole and its slope under every observer; of a conjugate pair the upper one.
fn slopes(found: &Found<'_>) -> Vec<Vec<String>> {
    let mut rows = vec![heading("pole", found)];
    let poles = found.spectrum.linearised.poles()[..found.spectrum.listed].iter().enumerate();
    for (i, pole) in poles.filter(|(_, pole)| pole.im >= 0.0).take(found.rows) {
        let scale = pole.norm();
        let real = round_off(pole.re, scale);
        let imaginary =
            if pole.im > 0.0 { format!(" ± {} i", number(pole.im, None)) } else { String::new() };
        let slope = |o: &ObserverSpectrum| {
            o.slopes[i].analytic.map_or("none".to_owned(), |slope| number(round_off(slope.re, 1.0), None))
        };
        let mut row = vec![format!("{}{imaginary}", number(real, None))];
        row.extend(found.spectrum.observers.iter().map(slope));
        rows.push(row);
    }
    rows
}

fn rates(found: &Found<'_>) -> Vec<Vec<String>> {
    let mut rows = vec![heading("gain", found)];
    let Some(first) = found.spectrum.observers.first() else { return rows };
    let scale = found.spectrum.linearised.poles().iter().map(|pole| pole.norm()).fold(0.0, f64::max);
    for (k, gain) in first.gain.iter().enumerate() {
        let rate = |o: &ObserverSpectrum| number(round_off(o.max_re[k], scale), None);
        rows.push(
            std::iter::once(number(*gain, None)).chain(found.spectrum.observers.iter().map(rate)).collect(),
        );
    }
    rows
}

fn bests(found: &Found<'_>) -> Vec<Vec<String>> {
    let titles = ["observer", "max Re λ", "at gain", "more gain", "gain for decay"];
    let mut rows = vec![
        titles[..if found.spectrum.decay.is_some() { 5 } else { 4 }]
            .iter()
            .map(|t| (*t).to_owned())
            .collect(),
    ];
    let scale = found.spectrum.linearised.poles().iter().map(|pole| pole.norm()).fold(0.0, f64::max);
    for o in &found.spectrum.observers {
        let mut row = vec![
            o.name.clone(),
            number(round_off(o.best.max_re, scale), None),
            number(o.best.gain, None),
            beyond(o.best.beyond).to_owned(),
        ];
        if found.spectrum.decay.is_some() {
            row.push(o.gain_for_decay.map_or("never".to_owned(), |gain| number(gain, None)));
        }
        rows.push(row);
    }
    rows
}

fn heading(first: &str, found: &Found<'_>) -> Vec<String> {
    std::iter::once(first.to_owned()).chain(found.spectrum.observers.iter().map(|o| o.name.clone())).collect()
}

/// What more than the best gain does, in a word.
fn beyond(beyond: Beyond) -> &'static str {
    match beyond {
        Beyond::Slower => "slower",
        Beyond::Same => "no faster",
        Beyond::Faster => "faster",
        Beyond::NoGain => "no gain helps",
    }
}

/// A value that only rounding keeps from zero as zero.
fn round_off(value: f64, scale: f64) -> f64 {
    if value.abs() < 1e-11 * scale { 0.0 } else { value }
}

/// Largest difference between analytic and numerical slopes; `None` where there is nothing to compare.
fn disagreement(observers: &[ObserverSpectrum]) -> Option<f64> {
    let both = observers.iter().flat_map(|o| &o.slopes).filter_map(|s| s.analytic.zip(s.numerical));
    both.map(|(p, q)| (p - q).norm()).reduce(f64::max)
}
