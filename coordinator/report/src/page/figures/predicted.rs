//! The course of what was predicted and need not have been measured: median and band of the posterior.

use starlings_study::field::component_of;
use starlings_study::predicted::PredictedCourse;

use crate::data::ReportData;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::BLUE;
use crate::plot::scene::Scene;
use crate::plot::thin;

/// Figures at most.
const MOST: usize = 24;
/// Components up to which every one of a field is drawn.
const FEW: usize = 3;

/// One figure per output and record; of a field the first, the middle and the last component.
pub(super) fn figures(data: &ReportData) -> Vec<Figure> {
    let all = shown(data);
    let mut drawn: Vec<Figure> =
        all.iter().take(MOST).map(|course| figure(course, &data.time_unit)).collect();
    let left_out = all.len() - drawn.len();
    if left_out > 0
        && let Some(last) = drawn.pop()
    {
        drawn.push(last.saying(&format!("{left_out} courses more are in predicted.csv.")));
    }
    drawn
}

fn shown(data: &ReportData) -> Vec<&PredictedCourse> {
    let field = |c: &PredictedCourse| component_of(&c.output).map(|(field, _)| field.to_owned());
    let alike = |a: &PredictedCourse, b: &PredictedCourse| {
        a.record == b.record && field(a).is_some() && field(a) == field(b)
    };
    let mut list = Vec::new();
    for group in data.predicted.chunk_by(alike) {
        if group.len() > FEW {
            list.extend([0, group.len() / 2, group.len() - 1].map(|at| &group[at]));
        } else {
            list.extend(group);
        }
    }
    list
}

fn figure(course: &PredictedCourse, time_unit: &str) -> Figure {
    let x = Axis::tight(&with_unit("time", time_unit), course.time.iter().copied());
    let ends = course.lo.iter().chain(&course.hi).copied();
    let y = Axis::around(&with_unit(&course.output, &course.unit), ends);
    let parts = thin::parts(&course.time, &course.lo, &course.hi);
    let bands = parts.iter().map(|part| Mark::Band { points: thin::band(part), colour: BLUE, opacity: 0.25 });
    let mut marks: Vec<Mark> = bands.collect();
    marks.extend(Mark::curve(&course.time, &course.median, BLUE, 1.75));
    let caption = "The band holds 95\u{a0}% of runs with parameters drawn from the posterior, at each time by itself. Errors of a \
                   measurement are not in it."
        .to_owned();
    let title = format!("{}, record {}: predicted", course.output, course.record);
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    Figure::new(&scene, &[("line blue", "median"), ("area blue", "95\u{a0}% band")], caption)
}
