//! The posterior of pairs of parameters: the regions that hold half and 95 % of it, from estimates, intervals and correlations.
//!
//! Gaussian in transformed units, as the estimate itself is; a parameter on a logarithmic axis has an ellipse there. Next file to
//! read: [`super::track`].

use crate::data::{ParameterRow, ReportData};
use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, GREY};
use crate::plot::scene::Scene;

/// Parameters in the matrix at most: those with the strongest correlations.
const MOST: usize = 6;
/// Points of an ellipse.
const POINTS: usize = 96;
/// Quantile of the standard normal distribution that ends a 95 % interval.
const END: f64 = 1.959_964;
/// Radii that hold half and 95 % of a Gaussian of two variables: sqrt(−2 ln(1 − p)).
const RADII: [f64; 2] = [1.177_41, 2.447_75];

/// One figure, a plot per pair; none with fewer than two parameters that have an interval.
pub(super) fn figures(data: &ReportData) -> Vec<Figure> {
    let shown = strongest(data);
    if shown.len() < 2 {
        return Vec::new();
    }
    let n = shown.len() - 1;
    let mut plots = Vec::new();
    for (row, &below) in shown.iter().enumerate().skip(1) {
        for (column, &beside) in shown.iter().enumerate().take(row) {
            plots.push((scene(data, beside, below), (row, column + 1)));
        }
    }
    let more = match data.parameters.len() - shown.len() {
        0 => String::new(),
        more => {
            format!(" The {} with the strongest correlations; {more} parameters are not drawn.", shown.len())
        }
    };
    let caption = format!(
        "Estimate, and the regions that hold half and 95\u{a0}% of the posterior, Gaussian in the units of the estimation. A long \
         narrow region is a combination that the data leave open.{more}"
    );
    let keys = [
        ("dot blue", "estimate"),
        ("line blue", "50 and 95\u{a0}% of the posterior"),
        ("dash grey", "prior median"),
    ];
    vec![Figure::matrix("Pairs of parameters", &plots, n, &keys, caption)]
}

/// The parameters with intervals whose largest correlation with another is strongest, in the order of the study.
fn strongest(data: &ReportData) -> Vec<usize> {
    let known = |row: &ParameterRow| row.lo.is_finite() && row.hi.is_finite() && row.hi > row.lo;
    let strength = |i: usize| {
        let row = data.correlation.get(i).map_or(&[][..], Vec::as_slice);
        row.iter()
            .enumerate()
            .filter(|(j, v)| *j != i && v.is_finite())
            .fold(0.0_f64, |most, (_, v)| most.max(v.abs()))
    };
    let mut shown: Vec<usize> = (0..data.parameters.len().min(data.correlation.len()))
        .filter(|i| known(&data.parameters[*i]))
        .collect();
    shown.sort_by(|i, j| strength(*j).total_cmp(&strength(*i)));
    shown.truncate(MOST);
    shown.sort_unstable();
    shown
}

/// Middle and standard deviation of a parameter on its axis' scale.
fn gaussian(row: &ParameterRow, log: bool) -> (f64, f64) {
    let at = |v: f64| if log { v.max(f64::MIN_POSITIVE).ln() } else { v };
    (at(row.estimate), (0.5 * at(row.hi) - 0.5 * at(row.lo)) / END)
}

fn scene(data: &ReportData, beside: usize, below: usize) -> Scene {
    let rows = [&data.parameters[beside], &data.parameters[below]];
    let log = rows.map(|row| data.log_axis(&row.name) && row.lo > 0.0);
    let [(x, sx), (y, sy)] = [gaussian(rows[0], log[0]), gaussian(rows[1], log[1])];
    let known = data.correlation[below].get(beside).copied().filter(|r| r.is_finite());
    let r = known.unwrap_or(0.0).clamp(-1.0, 1.0);
    let back = |v: f64, log: bool| if log { v.exp() } else { v };
    let ring = |radius: f64| -> Vec<(f64, f64)> {
        let point = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / POINTS as f64).sin_cos();
            let across = r * cos + (1.0 - r * r).sqrt() * sin;
            (back(x + radius * sx * cos, log[0]), back(y + radius * sy * across, log[1]))
        };
        (0..=POINTS).map(point).collect()
    };
    let rings = RADII.map(ring);
    let axis = |row: &ParameterRow, log: bool, values: Vec<f64>| {
        let label = with_unit(&row.name, &row.unit);
        if log { Axis::log_around(&label, values) } else { Axis::around(&label, values) }
    };
    let (xs, ys): (Vec<f64>, Vec<f64>) = rings[1].iter().copied().unzip();
    let (x_axis, y_axis) = (axis(rows[0], log[0], xs), axis(rows[1], log[1], ys));
    let mut marks = vec![
        Mark::Dashes { points: upright(rows[0].prior_median, &y_axis), colour: GREY },
        Mark::dashed_level((x_axis.lo, x_axis.hi), rows[1].prior_median, GREY),
    ];
    for (points, width) in rings.into_iter().zip([1.25, 2.0]) {
        marks.push(Mark::Line { points, colour: BLUE, width });
    }
    marks.push(Mark::Dots { points: vec![(rows[0].estimate, rows[1].estimate)], colour: BLUE, radius: 3.0 });
    let says = known.map_or_else(String::new, |r| format!(", correlation {}", number::with_sd(r, 0.1)));
    let title = format!("{} and {}{says}", rows[0].name, rows[1].name);
    Scene { description: title.clone(), title, x: x_axis, y: y_axis, marks }
}

/// A vertical line, where the value is on the page at all.
fn upright(x: f64, y: &Axis) -> Vec<(f64, f64)> {
    vec![(x, y.lo), (x, y.hi)]
}
