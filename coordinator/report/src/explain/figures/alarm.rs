//! What the search finds where nothing is missing, beside what it found in the data.
//!
//! Next file to read: `course.rs`.

use starlings_explain::Figures;
use starlings_explain::result::Explanation;

use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::Figure;
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, GREEN, GREY, LIMIT};
use crate::plot::scene::Scene;

/// Bins over the whole axis.
const BINS: usize = 30;
/// Smallest gain on a logarithmic axis.
const LEAST: f64 = 0.1;
/// Gains that differ by more than this factor ask for a logarithmic axis, where none of them is a sliver.
const FAR: f64 = 12.0;

/// The gains of one search: falls of χ² in units of the effective noise.
#[derive(Debug, Clone, Copy)]
struct Gains<'a> {
    /// Largest gain in each simulation without a gap.
    null: &'a [f64],
    /// Gains of the decoys.
    decoys: &'a [f64],
    /// Gain of the best candidate in the data.
    best: f64,
    /// What a gain must exceed.
    threshold: f64,
}

/// One histogram; none without any simulation or decoy.
pub(super) fn figures(found: &Explanation, data: &Figures) -> Vec<Figure> {
    let gains = Gains {
        null: &data.null_gains,
        decoys: &data.decoy_gains,
        best: data.best_gain,
        threshold: found.false_alarm.threshold,
    };
    figure(&gains).into_iter().collect()
}

/// Draws the histogram; `None` without any simulation or decoy.
fn figure(gains: &Gains<'_>) -> Option<Figure> {
    let chance: Vec<f64> =
        gains.null.iter().chain(gains.decoys).copied().filter(|gain| gain.is_finite()).collect();
    if chance.is_empty() {
        return None;
    }
    let others = chance.iter().copied().chain([gains.threshold]).filter(|gain| gain.is_finite());
    let smallest = others.clone().fold(f64::INFINITY, f64::min).max(LEAST);
    let far = gains.best.max(others.clone().fold(LEAST, f64::max)) > FAR * smallest;
    let all = others.chain([gains.best]).filter(|gain| gain.is_finite());
    let label = "fall of χ², in units of the effective noise";
    let x = if far {
        Axis::log_around(label, all.map(|gain| gain.max(LEAST)))
    } else {
        Axis::around(label, all.chain([0.0]))
    };
    let (null, decoys) = (counts(gains.null, &x), counts(gains.decoys, &x));
    let y = Axis::counts("searches", null.iter().chain(&decoys).map(|n| *n as f64));
    let mut marks = vec![
        Mark::Bars { bars: bars(&null, &x, (0.05, 0.5)), colour: GREEN },
        Mark::Bars { bars: bars(&decoys, &x, (0.5, 0.95)), colour: GREY },
    ];
    let upright = |at: f64| vec![(at, y.lo), (at, y.hi)];
    if gains.threshold.is_finite() {
        marks.push(Mark::Dashes { points: upright(gains.threshold.max(x.lo)), colour: LIMIT });
    }
    if gains.best.is_finite() {
        marks.push(Mark::Line { points: upright(gains.best.max(x.lo)), colour: BLUE, width: 2.5 });
    }
    let edge = if far { " Gains below 0.1 stand at the left end." } else { "" };
    let caption = format!("{}{edge}", caption(gains));
    let title = "What chance would find".to_owned();
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    let keys = [
        ("area solid green", "simulations without a gap"),
        ("area solid grey", "decoys"),
        ("dash limit", "threshold"),
        ("line blue", "best candidate in the data"),
    ];
    Some(Figure::new(&scene, &keys, caption))
}

fn caption(gains: &Gains<'_>) -> String {
    let reached = |list: &[f64]| list.iter().filter(|gain| **gain >= gains.best).count();
    let digits = |value: f64| number::significant(value, 3);
    let verdict = if gains.best > gains.threshold {
        "It stands beyond the threshold: chance does not explain it."
    } else {
        "It does not pass the threshold: chance could have done it."
    };
    format!(
        "Best candidate: {}; threshold: {}. {} of {} simulations without a gap and {} of {} decoys reach the best candidate. \
         {verdict}",
        digits(gains.best),
        digits(gains.threshold),
        reached(gains.null),
        gains.null.len(),
        reached(gains.decoys),
        gains.decoys.len()
    )
}

fn counts(gains: &[f64], x: &Axis) -> Vec<usize> {
    let (lo, hi) = x.ends();
    let mut counts = vec![0; BINS];
    for gain in gains.iter().filter(|gain| gain.is_finite()) {
        let share = (x.at(gain.clamp(x.lo, x.hi)) - lo) / (hi - lo);
        counts[((share * BINS as f64) as usize).min(BINS - 1)] += 1;
    }
    counts
}

fn bars(counts: &[usize], x: &Axis, (from, to): (f64, f64)) -> Vec<(f64, f64, f64)> {
    let edge = |k: usize, part: f64| x.value_at((k as f64 + part) / BINS as f64);
    let bar = |(k, count): (usize, &usize)| (edge(k, from), edge(k, to), *count as f64);
    counts.iter().enumerate().filter(|(_, count)| **count > 0).map(bar).collect()
}
