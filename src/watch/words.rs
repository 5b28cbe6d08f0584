//! What `starlings watch` writes of a view.

use std::fmt::Write as _;
use std::time::Duration;

use indicatif::HumanDuration;
use starlings_coordinator::live::{State, View};

use crate::console::{number, table};

/// Parameters and workers that are shown at most.
const ROWS: usize = 12;
/// Events that are shown.
const EVENTS: usize = 4;
/// Places of the bar.
const BAR: usize = 40;

/// A line: how far it is.
pub(super) fn standing(view: &View) -> String {
    let standing = &view.standing;
    let mut says: Vec<String> = Vec::new();
    let stage = [&standing.stage, &standing.says].into_iter().filter(|part| !part.is_empty());
    let stage = stage.map(String::as_str).collect::<Vec<_>>().join(": ");
    says.push(if stage.is_empty() { "no analysis yet".to_owned() } else { stage });
    says.push(format!("{} {}", standing.runs, standing.counted));
    says.push(format!("{} workers", standing.workers));
    says.extend(standing.share.map(|share| format!("{:.0} %", 100.0 * share)));
    says.push(format!("{} so far", duration(view.elapsed_s)));
    says.extend(standing.left_s.map(|left| format!("about {} left", duration(left))));
    says.join(", ")
}

/// The screen of a run that goes on.
pub(super) fn screen(view: &View) -> String {
    let mut text = head(view);
    if let Some(share) = view.standing.share {
        let full = ((share * BAR as f64) as usize).min(BAR);
        let _ = writeln!(text, "[{}{}]", "#".repeat(full), "-".repeat(BAR - full));
    }
    let _ = writeln!(text, "{}\n", standing(view));
    text.push_str(&parameters(view));
    if let Some(fleet) = view.fleet {
        let _ = writeln!(
            text,
            "\n{} workers, {} of {} slots busy, {} runs queued, {} lost",
            fleet.workers, fleet.busy, fleet.slots, fleet.queued, fleet.losses
        );
    }
    let rows: Vec<Vec<String>> = view
        .workers
        .iter()
        .take(ROWS)
        .map(|w| vec![w.name.clone(), w.state.clone(), format!("{}/{}", w.jobs, w.slots), w.why.clone()])
        .collect();
    text.push_str(&table(&rows, false));
    for (kind, n) in &view.failures {
        let _ = writeln!(text, "  {n} runs failed: {kind}");
    }
    for event in view.events.iter().take(EVENTS) {
        let _ = writeln!(text, "  {} {}", duration(event.at_s), event.text);
    }
    text
}

/// What is said last.
pub(super) fn end(view: &View) -> String {
    let how = match view.state {
        State::Finished => "finished".to_owned(),
        State::Running => format!("running, {}", view.ended),
        State::Ended => format!("ended before it was done: {}", view.ended),
    };
    let stands = if view.state == State::Finished { String::new() } else { standing(view) + "\n" };
    format!("{}{how}\n{stands}{}", head(view), parameters(view))
}

fn head(view: &View) -> String {
    format!("{}: starlings {}, model {}\n", view.head.study, view.head.command, view.head.model)
}

/// The parameters with their bands.
fn parameters(view: &View) -> String {
    if view.parameters.is_empty() {
        return String::new();
    }
    let mut rows = vec![["parameter", "estimate", "- 2 sd", "+ 2 sd"].map(str::to_owned).to_vec()];
    for p in view.parameters.iter().take(ROWS) {
        let sd = Some((p.hi - p.lo) / 4.0).filter(|sd| *sd > 0.0 && sd.is_finite());
        rows.push(vec![p.name.clone(), number(p.estimate, sd), number(p.lo, sd), number(p.hi, sd)]);
    }
    let left = view.parameters.len().saturating_sub(ROWS);
    let more = if left > 0 { format!("  and {left} more\n") } else { String::new() };
    let nis = view.nis.filter(|(_, n)| *n > 0).map(|(nis, n)| {
        format!("  NIS {:.2} per observation in analysis {}\n", nis / n as f64, view.analyses)
    });
    table(&rows, true) + &more + &nis.unwrap_or_default()
}

fn duration(seconds: f64) -> String {
    let whole = if seconds.is_finite() { seconds.clamp(0.0, 1e9).round() } else { 0.0 };
    HumanDuration(Duration::from_secs_f64(whole)).to_string()
}
