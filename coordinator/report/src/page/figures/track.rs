//! How the estimate of one parameter moved, with its ± 2 sd band, pass by pass.

use crate::data::{PassTrack, ReportData, Track};
use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, GREY, MUTED};
use crate::plot::scene::Scene;
use crate::plot::thin;

/// One figure per parameter.
pub(super) fn figures(data: &ReportData) -> Vec<Figure> {
    data.tracks.iter().map(|track| figure(track, data.x_label())).collect()
}

/// Draws one parameter over time or iterations.
fn figure(track: &Track, x_label: &str) -> Figure {
    let x = Axis::over_run(x_label, track.passes.iter().flat_map(|p| p.time.iter().copied()));
    // The band of an earlier pass begins as wide as the prior and would flatten the result: it may leave the figure.
    let estimates = track.passes.iter().flat_map(|p| &p.estimate);
    let band = track.passes.last().into_iter().flat_map(|p| p.lo.iter().chain(&p.hi));
    let values: Vec<f64> = estimates.chain(band).copied().chain([track.prior_median]).collect();
    let label = with_unit(&track.name, &track.unit);
    let y = if track.log_axis { Axis::log_around(&label, values) } else { Axis::around(&label, values) };
    let mut marks = Vec::new();
    if track.prior_median.is_finite() {
        marks.push(Mark::dashed_level((x.lo, x.hi), track.prior_median, MUTED));
    }
    let last = track.passes.len().saturating_sub(1);
    for (k, pass) in track.passes.iter().enumerate() {
        marks.extend(pass_marks(pass, k == last));
    }
    let caption = caption(track);
    let title = format!("{}: estimate over the run", track.name);
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    let mut keys = vec![("line blue", "estimate, last pass"), ("area blue", "± 2 sd")];
    if track.passes.len() > 1 {
        keys.push(("line grey", "earlier passes"));
    }
    keys.push(("dash muted", "prior median"));
    Figure::new(&scene, &keys, caption)
}

fn pass_marks(pass: &PassTrack, last: bool) -> Vec<Mark> {
    let (colour, opacity, width) = if last { (BLUE, 0.18, 2.0) } else { (GREY, 0.18, 1.5) };
    let bands = thin::parts(&pass.time, &pass.lo, &pass.hi).into_iter();
    let bands = bands.map(|part| Mark::Band { points: thin::band(&part), colour, opacity });
    let curves = thin::parts(&pass.time, &pass.estimate, &pass.estimate).into_iter();
    let curves = curves.map(|part| Mark::Line { points: thin::curve(&part), colour, width });
    bands.chain(curves).collect()
}

fn caption(track: &Track) -> String {
    let end = track.passes.last().and_then(|p| Some((p.estimate.last()?, p.lo.last()?, p.hi.last()?)));
    let ends = end.map_or(String::new(), |(estimate, lo, hi)| {
        let sd = (hi - lo) / 4.0;
        let said = [lo, hi].map(|v| number::with_sd(*v, sd));
        format!("Ends at {} {} [{} to {}]. ", number::with_sd(*estimate, sd), track.unit, said[0], said[1])
    });
    format!(
        "{ends}The band should narrow and the curve settle; an estimate that still drifts is not yet determined by the data."
    )
}
