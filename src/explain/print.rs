//! The answer on a terminal: the verdict first, then where, what, how much it helps, and what speaks against it.
//!
//! Lists are cut to what fits a screen; all of it is in the report and in explain.json. Next file to read: [`super`].

use std::path::Path;

use starlings_coordinator::explain::result::{Coefficient, NamedEffect, Rejected};
use starlings_coordinator::explain::{Explanation, Probabilities, Verdict};
use starlings_models::units::spaced;

use crate::console::{line, number, table, text};
use crate::failure::Failure;

/// Places and rejected candidates that are printed.
const FEW: usize = 3;
/// Rows of a table that are printed.
const ROWS: usize = 12;

/// An error is printed with the digits of an uncertainty of a twentieth: three.
const DIGITS: f64 = 20.0;

/// Prints an explanation. `states` are the names of the model's states: a term added to one is a rate of change.
pub(super) fn print(found: &Explanation, states: &[String], folder: &Path) -> Result<(), Failure> {
    for warning in &found.warnings {
        line(format_args!("warning: {warning}"))?;
    }
    line(format_args!("\n{}", found.headline))?;
    let probable = found.probabilities.as_ref().map(Probabilities::lines).unwrap_or_default();
    list("\nhow probable that is", probable.into_iter(), ROWS)?;
    list("\nwhere simulation and recordings disagree", found.places.iter().map(|p| p.sentence.clone()), FEW)?;
    for effect in &found.effects {
        line("")?;
        text(described(effect, states))?;
    }
    if !found.replaced.is_empty() {
        line(format_args!("  in the place of the model's own {}", found.replaced.join(", ")))?;
    }
    ties(found)?;
    if found.verdict == Verdict::Unexplained && !found.closest.is_empty() {
        line("\nwhat came nearest, and was not added")?;
        for effect in &found.closest {
            text(described(effect, states))?;
        }
    }
    gap(found)?;
    held_out(found)?;
    shifts(found)?;
    list("\nrefused", found.rejected.iter().map(refusal), FEW)?;
    rest(found)?;
    if let Some(study) = &found.explained_study {
        line(format_args!("the study with the effect in it: {}", folder.join(study).display()))?;
    }
    line(format_args!("report: {}", folder.join("report.html").display()))
}

/// A heading and the first of its lines; nothing without any.
fn list(heading: &str, lines: impl ExactSizeIterator<Item = String>, most: usize) -> Result<(), Failure> {
    let n = lines.len();
    if n == 0 {
        return Ok(());
    }
    line(heading)?;
    for entry in lines.take(most) {
        line(format_args!("  {entry}"))?;
    }
    if n > most { line(format_args!("  and {} more in the report", n - most)) } else { Ok(()) }
}

/// The sentence, the equations and the coefficients of an effect.
fn described(effect: &NamedEffect, states: &[String]) -> String {
    let mut lines = vec![format!("{}: {}", effect.name, effect.says)];
    lines.extend(effect.equations(states).iter().map(|equation| format!("  {equation}")));
    lines.extend(effect.parameters.iter().map(|p| format!("  {}", coefficient(p))));
    lines.join("\n") + "\n"
}

fn coefficient(value: &Coefficient) -> String {
    let unit = spaced(&value.unit);
    if value.sd > 0.0 {
        let sd = Some(value.sd);
        let [lo, hi] = value.interval95.map(|v| number(v, sd));
        let (estimate, spread) = (number(value.estimate, sd), number(value.sd, sd));
        format!("{} = {estimate} ± {spread}{unit} (95 %: {lo} … {hi})", value.name)
    } else {
        format!("{} = {}{unit}", value.name, number(value.estimate, None))
    }
}

fn ties(found: &Explanation) -> Result<(), Failure> {
    list("\nthe recordings cannot tell it from", found.ties().into_iter(), ROWS)?;
    match &found.experiment {
        Some(experiment) => line(format_args!("  experiments: {}", experiment.sentence())),
        None => Ok(()),
    }
}

fn gap(found: &Explanation) -> Result<(), Failure> {
    let after = match (found.effects.is_empty(), found.closest.is_empty()) {
        (false, _) => "after",
        (true, false) => "with what came nearest",
        (true, true) => return Ok(()),
    };
    line(format_args!("\nroot mean square error before and {after}"))?;
    let heading = ["record", "channel", "unit", "use", "before", "after", "noise"];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    for row in found.gap.iter().take(ROWS) {
        let figures = [row.before, row.after, row.noise].map(|v| number(v, Some(v / DIGITS)));
        let names = [&row.record, &row.channel, &row.unit, &row.usage].map(Clone::clone);
        rows.push(names.into_iter().chain(figures).collect());
    }
    text(table(&rows, false))?;
    let more = found.gap.len().saturating_sub(ROWS);
    if more > 0 { line(format_args!("  and {more} more in the report")) } else { Ok(()) }
}

/// What of the held-out data fails; of a version that was added the table before and after has the figures.
fn held_out(found: &Explanation) -> Result<(), Failure> {
    let several = found.held_out.iter().any(|h| h.record != found.held_out[0].record);
    let mut failing: Vec<_> = found.held_out.iter().filter(|h| h.fails).collect();
    failing.sort_by(|a, b| b.beyond.total_cmp(&a.beyond));
    list("\nheld out and failing", failing.into_iter().map(|h| h.says(several)), ROWS)
}

/// What the effects did to the model's own parameters, the largest shift first.
fn shifts(found: &Explanation) -> Result<(), Failure> {
    if found.parameter_shifts.is_empty() {
        return Ok(());
    }
    line("\nwhat that does to the model's own parameters")?;
    let heading = ["parameter", "unit", "before", "after", "sd"];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    let mut sorted: Vec<_> = found.parameter_shifts.iter().collect();
    let size =
        |s: &starlings_coordinator::explain::result::ParameterShift| ((s.after - s.before) / s.sd).abs();
    sorted.sort_by(|a, b| size(b).total_cmp(&size(a)));
    for shift in sorted.iter().take(ROWS) {
        let sd = Some(shift.sd);
        let figures = [shift.before, shift.after, shift.sd].map(|v| number(v, sd));
        rows.push([shift.name.clone(), shift.unit.clone()].into_iter().chain(figures).collect());
    }
    text(table(&rows, false))?;
    let more = sorted.len().saturating_sub(ROWS);
    if more > 0 { line(format_args!("  and {more} more in the report")) } else { Ok(()) }
}

fn refusal(rejected: &Rejected) -> String {
    format!("{} ({}): {}", rejected.name, rejected.gate, rejected.reason)
}

/// Kinds of physics of which nothing was tried: those that share a reason on one line.
fn not_tried(found: &Explanation) -> Result<(), Failure> {
    let mut by_reason: Vec<(&str, Vec<&str>)> = Vec::new();
    for kind in found.not_tried.iter().filter(|_| found.verdict == Verdict::Unexplained) {
        // What a family needs is for the report.
        let reason = kind.reason.split(';').next().unwrap_or_default();
        match by_reason.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, kinds)) => kinds.push(&kind.kind),
            None => by_reason.push((reason, vec![&kind.kind])),
        }
    }
    let lines = by_reason.iter().map(|(reason, kinds)| format!("{}: {reason}", kinds.join(", ")));
    list("\nnot tried", lines, ROWS)
}

/// What is left of the gap, how sure the verdict is, and what it cost.
fn rest(found: &Explanation) -> Result<(), Failure> {
    let version = match found.effects.len() {
        0 => "the model as it is",
        1 => "the effect",
        _ => "the effects",
    };
    line(format_args!("\non the training data, with {version}: {}", found.remaining.shape))?;
    let alarm = &found.false_alarm;
    if alarm.runs > 0 {
        line(format_args!(
            "false alarms: {} (at most {} with 95 % confidence); {}",
            percent(alarm.rate),
            percent(alarm.upper95),
            alarm.how
        ))?;
    }
    if let Some(nulls) = &alarm.nulls {
        line(format_args!(
            "measured: {} of {} simulated recordings without a gap got a name (at most {} with 95 % confidence)",
            nulls.names,
            nulls.of,
            percent(nulls.upper95)
        ))?;
    }
    not_tried(found)?;
    list("\nnot tried for want of budget", found.untried.iter().cloned(), FEW)?;
    let stages: Vec<String> =
        found.runs_by_stage.iter().map(|(stage, runs)| format!("{stage} {runs}")).collect();
    line(format_args!(
        "\n{} runs ({}) on {} worker{} in {:.2} s",
        found.runs,
        stages.join(", "),
        found.workers,
        if found.workers == 1 { "" } else { "s" },
        found.wall_s
    ))
}

fn percent(share: f64) -> String {
    format!("{} %", number(100.0 * share, Some(1.0)))
}
