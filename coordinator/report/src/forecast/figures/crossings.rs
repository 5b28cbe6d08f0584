//! When the members cross a level: the share that has, against time, and how many do in each interval.

use starlings_study::forecast::Forecast;
use starlings_study::forecast::result::LevelForecast;

use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, GREY, LIMIT, MUTED};
use crate::plot::scene::Scene;

/// Intervals of the histogram.
const BINS: usize = 24;

/// One figure per level that is crossed.
pub(super) fn figures(found: &Forecast) -> Vec<Figure> {
    found.levels.iter().filter(|level| !level.times.is_empty()).map(|level| figure(found, level)).collect()
}

fn figure(found: &Forecast, level: &LevelForecast) -> Figure {
    let n = (level.crossed + level.never) as f64;
    let (first, last) = (level.times[0], level.times[level.times.len() - 1]);
    let margin = 0.05 * (last - first).max(1e-3 * (found.until - found.from));
    let (lo, hi) = ((first - margin).max(found.from), (last + margin).min(found.until));
    let x = Axis::tight(&with_unit("time", &found.time_unit), [lo, hi]);
    let y = Axis::around("share of the members", [0.0, 1.0]);
    let width = (hi - lo) / BINS as f64;
    let bar = |k: usize| {
        let (from, to) = (lo + width * k as f64, lo + width * (k + 1) as f64);
        let count =
            level.times.iter().filter(|t| (from..to).contains(*t) || (k + 1 == BINS && **t >= to)).count();
        (from, to, count as f64 / n)
    };
    let mut steps = vec![(lo, 0.0)];
    for (k, t) in level.times.iter().enumerate() {
        steps.extend([(*t, k as f64 / n), (*t, (k + 1) as f64 / n)]);
    }
    steps.push((hi, level.probability));
    let mut marks = vec![Mark::Bars { bars: (0..BINS).map(bar).collect(), colour: GREY }];
    marks.push(Mark::Line { points: steps, colour: BLUE, width: 2.0 });
    marks.push(Mark::dashed_level((x.lo, x.hi), 0.5, MUTED));
    if let Some(horizon) = level.horizon.filter(|t| (lo..=hi).contains(t)) {
        marks.push(Mark::Dashes { points: vec![(horizon, 0.0), (horizon, 1.0)], colour: LIMIT });
    }
    let caption = format!("{}.", level.says);
    let title = format!("{}: when", level.says.split(':').next().unwrap_or_default());
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    let keys = [
        ("line blue", "share that has crossed"),
        ("area solid grey", "share per interval"),
        ("dash limit", "horizon"),
    ];
    let n_key = if level.horizon.is_some() { 3 } else { 2 };
    Figure::new(&scene, &keys[..n_key], caption)
}
