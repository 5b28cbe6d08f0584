//! The innovations with the observer beside those of a free run, over time.

use crate::data::{ObserverPlot, ObserverRow, ReportData};
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, MUTED, VERMILION};
use crate::plot::scene::Scene;
use crate::plot::thin;

/// One figure per record with innovations.
pub(super) fn figures(data: &ReportData) -> Vec<Figure> {
    let shown = data.observer.iter().flat_map(|row| row.courses.iter().map(move |course| (course, row)));
    let shown = shown.filter(|(course, _)| !course.time.is_empty());
    shown.map(|(course, row)| figure(course, row, &data.time_unit)).collect()
}

/// Draws one record.
fn figure(plot: &ObserverPlot, row: &ObserverRow, time_unit: &str) -> Figure {
    let x = Axis::tight(&with_unit("time", time_unit), plot.time.iter().copied());
    let values = plot.with.iter().chain(&plot.without).copied().chain([0.0, 1.0]);
    let y = Axis::around("root mean square innovation [noise sd]", values);
    let mut marks = vec![Mark::dashed_level((x.lo, x.hi), 1.0, MUTED)];
    for (series, colour, width) in [(&plot.without, VERMILION, 1.5), (&plot.with, BLUE, 2.0)] {
        let parts = thin::parts(&plot.time, series, series);
        marks.extend(parts.iter().map(|part| Mark::Line { points: thin::curve(part), colour, width }));
    }
    let caption = "At the estimate, over all channels. One noise sd is what is left when the state is right; what the free run \
                   misses beyond that is the error of its state, or of the model, which the observer holds down."
        .to_owned();
    let title = format!("Record {}: innovations with and without the observer {}", plot.record, row.kind);
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    let keys = [
        ("line blue", "with the observer"),
        ("line vermilion", "without it, free run"),
        ("dash muted", "one noise sd"),
    ];
    Figure::new(&scene, &keys, caption)
}
