//! Normalised innovation squared against its chi-square band (Bar-Shalom, Li & Kirubarajan 2001, section 5.4).

use super::super::ReportError;
use super::super::data::NisSeries;
use super::super::number;
use super::axis::Axis;
use super::figure::Figure;
use super::fit::{drawn_as_dots, measured};
use super::mark::Mark;
use super::palette::{BLUE, GREEN, GREY, MUTED};
use super::scene::Scene;

/// Smallest value on the logarithmic axis: what is below stands on the axis.
const FLOOR: f64 = 1e-2;

/// Draws all passes; `None` when there is none.
///
/// # Errors
///
/// The figure cannot be drawn.
pub(crate) fn figure(passes: &[NisSeries], x_label: &str) -> Result<Option<Figure>, ReportError> {
    let Some(last) = passes.last() else { return Ok(None) };
    let x = Axis::tight(x_label, passes.iter().flat_map(|p| p.time.iter().copied()));
    let floored = |v: &f64| if v.is_nan() { f64::NAN } else { v.max(FLOOR) };
    let values = passes.iter().flat_map(|p| &p.nis_per_observation).map(floored);
    let y = Axis::log_around(
        "NIS per observation (1 expected)",
        values.chain([last.lo.max(FLOOR), last.hi, 1.0]),
    );
    let ends = (x.lo, x.hi);
    let mut marks = vec![
        Mark::flat_band(ends, (last.lo.max(FLOOR), last.hi), GREEN, 0.16),
        Mark::dashed_level(ends, 1.0, MUTED),
    ];
    for (k, pass) in passes.iter().enumerate() {
        let colour = if k + 1 == passes.len() { BLUE } else { GREY };
        let value: Vec<f64> = pass.nis_per_observation.iter().map(floored).collect();
        marks.extend(measured(&pass.time, &value, colour));
    }
    let known: Vec<f64> = last.nis_per_observation.iter().copied().filter(|v| v.is_finite()).collect();
    let inside = known.iter().filter(|v| (last.lo..=last.hi).contains(*v)).count();
    let used = if last.n_used == 1 {
        "1 observed value".to_owned()
    } else {
        format!("{} observed values", last.n_used)
    };
    let caption = format!(
        "{} of the last pass lies inside the 95\u{a0}% band of chi-square ({used} per analysis). Above the band the \
         model does not explain the data at this noise level, and the intervals are too narrow; below it the noise is \
         stated too large. Values below {FLOOR} stand at {FLOOR}.",
        number::percent(inside as f64 / known.len() as f64)
    );
    let few = drawn_as_dots(&last.time);
    let mut keys = vec![(if few { "dot blue" } else { "line blue" }, "last pass")];
    if passes.len() > 1 {
        keys.push((if few { "dot grey" } else { "line grey" }, "earlier passes"));
    }
    keys.extend([("area green", "95\u{a0}% band"), ("dash muted", "expected: 1")]);
    let title = "Normalised innovation squared per observation".to_owned();
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    Figure::new(&scene, &keys, caption).map(Some)
}
