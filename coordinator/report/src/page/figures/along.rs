//! A family of parameters against its number: the stiffness of a vessel's regions along the vessel.

use crate::data::{Family, ParameterRow, ReportData};
use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, GREY, MUTED};
use crate::plot::scene::Scene;

/// Half the width that a parameter takes of the room between two numbers.
const HALF: f64 = 0.32;

/// One figure per family.
pub(super) fn figures(data: &ReportData) -> Vec<Figure> {
    data.families.iter().map(|family| figure(family, data)).collect()
}

/// Draws one family, its members in the order of their numbers.
fn figure(family: &Family, data: &ReportData) -> Figure {
    let rows: Vec<(f64, &ParameterRow)> = family
        .members
        .iter()
        .filter_map(|(number, row)| Some((f64::from(*number), data.parameters.get(*row)?)))
        .collect();
    let unit = rows.first().map_or("", |(_, row)| row.unit.as_str());
    // A prior that is much wider than the result may leave the figure; its median stays.
    let ends = rows.iter().flat_map(|(_, row)| {
        let [lo, hi] = two_sd(row);
        [lo, hi, row.estimate, row.prior_median]
    });
    let label = with_unit(&family.stem, unit);
    let log = rows.iter().all(|(_, row)| data.log_axis(&row.name));
    let y = if log { Axis::log_around(&label, ends) } else { Axis::around(&label, ends) };
    let name = if family.stiffness { "region" } else { "number" };
    let x = Axis::counted(name, rows.iter().map(|(number, _)| *number));
    let mut marks = Vec::new();
    for (at, row) in &rows {
        marks.extend(member(*at, row));
    }
    let curve = rows.iter().map(|(at, row)| (*at, row.estimate)).collect();
    marks.push(Mark::Line { points: curve, colour: BLUE, width: 1.25 });
    let (caption, title) = (caption(&rows), title(family));
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    let keys = [
        ("dot blue", "estimate"),
        ("area blue", "± 2 sd"),
        ("area grey", "prior 95\u{a0}% interval"),
        ("line muted", "prior median"),
    ];
    Figure::new(&scene, &keys, caption)
}

fn title(family: &Family) -> String {
    let ends = [family.members.first(), family.members.last()].map(|m| m.map_or(0, |(number, _)| *number));
    let names = format!("{0}{1} to {0}{2}", family.stem, ends[0], ends[1]);
    if family.stiffness { format!("{names} along the vessel") } else { names }
}

/// The band of two standard deviations, from the 95 % interval, which is symmetric in transformed units only.
fn two_sd(row: &ParameterRow) -> [f64; 2] {
    [row.lo, row.hi]
}

fn member(at: f64, row: &ParameterRow) -> Vec<Mark> {
    let ends = (at - HALF, at + HALF);
    let mut marks = Vec::new();
    if row.prior_lo.is_finite() && row.prior_hi.is_finite() {
        marks.push(Mark::flat_band(ends, (row.prior_lo, row.prior_hi), GREY, 0.22));
        marks.push(Mark::level(ends, row.prior_median, MUTED));
    }
    let [lo, hi] = two_sd(row);
    if lo.is_finite() && hi.is_finite() {
        marks.push(Mark::flat_band((at - 0.5 * HALF, at + 0.5 * HALF), (lo, hi), BLUE, 0.45));
    }
    marks.push(Mark::Dots { points: vec![(at, row.estimate)], colour: BLUE, radius: 3.5 });
    marks
}

/// The extremes in words, as ratios to the smallest.
fn caption(rows: &[(f64, &ParameterRow)]) -> String {
    let known = || rows.iter().map(|(_, row)| *row).filter(|row| row.estimate.is_finite());
    let highest = known().max_by(|a, b| a.estimate.total_cmp(&b.estimate));
    let lowest = known().min_by(|a, b| a.estimate.total_cmp(&b.estimate));
    let (Some(highest), Some(lowest)) = (highest, lowest) else { return String::new() };
    let value = |row: &ParameterRow| {
        format!("{} {}", number::with_sd(row.estimate, row.sd), row.unit).trim_end().to_owned()
    };
    let ratio = if lowest.estimate > 0.0 {
        format!(", {} times as much", number::significant(highest.estimate / lowest.estimate, 3))
    } else {
        String::new()
    };
    format!(
        "Lowest: {} with {}. Highest: {} with {}{ratio}. Blue bars are as wide as the data leave it open; where one is as \
         long as the grey one the data say nothing of that parameter.",
        lowest.name,
        value(lowest),
        highest.name,
        value(highest)
    )
}
