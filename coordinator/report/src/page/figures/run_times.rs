//! How long the model runs took.

use crate::data::{ReportData, RunTimes};
use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::Figure;
use crate::plot::mark::Mark;
use crate::plot::palette::BLUE;
use crate::plot::scene::Scene;

/// One histogram of the run times; none without bins.
pub(super) fn figures(data: &ReportData) -> Vec<Figure> {
    data.fleet.time_per_run.as_ref().and_then(figure).into_iter().collect()
}

/// Draws the histogram of run times; `None` when it has no bins.
fn figure(times: &RunTimes) -> Option<Figure> {
    let bins: Vec<_> = times.bins.iter().filter(|b| b.from.is_finite() && b.to.is_finite()).collect();
    let (Some(first), Some(last)) = (bins.first(), bins.last()) else { return None };
    let (unit, factor) = match last.to {
        to if to < 1e-3 => ("µs", 1e6),
        to if to < 1.0 => ("ms", 1e3),
        _ => ("s", 1.0),
    };
    let edges = [factor * first.from, factor * last.to];
    let label = format!("time per run [{unit}]");
    let wide = first.from > 0.0 && last.to > 30.0 * first.from;
    let x = if wide { Axis::log_around(&label, edges) } else { Axis::tight(&label, edges) };
    let y = Axis::counts("model runs", bins.iter().map(|b| b.count as f64));
    let bars = bins.iter().map(|b| (factor * b.from, factor * b.to, b.count as f64)).collect();
    let caption = format!(
        "Median {}, 95th percentile {}, shortest {}, longest {}. A long tail on the right is a slow worker or a hard particle.",
        number::duration(times.median),
        number::duration(times.p95),
        number::duration(times.min),
        number::duration(times.max)
    );
    let title = "Time per model run".to_owned();
    let scene =
        Scene { title, description: caption.clone(), x, y, marks: vec![Mark::Bars { bars, colour: BLUE }] };
    Some(Figure::new(&scene, &[("area solid blue", "runs per bin")], caption))
}
