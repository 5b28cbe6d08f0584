//! How long the model runs took.

use crate::data::{ReportData, RunTimes};
use crate::plot::axis::Axis;
use crate::plot::figure::Figure;
use crate::plot::mark::Mark;
use crate::plot::palette::BLUE;
use crate::plot::scene::Scene;
use crate::{ReportError, number};

/// One histogram of the run times; none without bins.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn figures(data: &ReportData) -> Result<Vec<Figure>, ReportError> {
    let drawn = data.fleet.time_per_run.as_ref().map(figure).transpose()?;
    Ok(drawn.flatten().into_iter().collect())
}

/// Draws the histogram of run times; `None` when it has no bins.
fn figure(times: &RunTimes) -> Result<Option<Figure>, ReportError> {
    let bins: Vec<_> = times.bins.iter().filter(|b| b.from.is_finite() && b.to.is_finite()).collect();
    let (Some(first), Some(last)) = (bins.first(), bins.last()) else { return Ok(None) };
    let (unit, factor) = match last.to {
        to if to < 1e-3 => ("µs", 1e6),
        to if to < 1.0 => ("ms", 1e3),
        _ => ("s", 1.0),
    };
    let edges = [factor * first.from, factor * last.to];
    let label = format!("time per run [{unit}]");
    let wide = first.from > 0.0 && last.to > 30.0 * first.from;
    let x = if wide { Axis::log_around(&label, edges) } else { Axis::tight(&label, edges) };
    let highest = bins.iter().map(|b| b.count).max().unwrap_or(0) as f64;
    let y = Axis::tight("model runs", [0.0, 1.05 * highest.max(1.0)]);
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
    Figure::new(&scene, &[("area solid", "runs per bin")], caption).map(Some)
}
