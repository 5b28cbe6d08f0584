//! How the prediction of each observed value answers to each parameter, with its sign.
//!
//! Next file to read: [`super::generalised`].

use starlings_study::identify::Identification;

use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{EQUALS, MUTED};
use crate::plot::scene::Scene;

/// The sensitivities of one output in one record.
struct Course {
    name: String,
    /// Rows of the sensitivities.
    rows: Vec<usize>,
}

/// One figure per parameter, all on the same axes: by how many noise sd a prediction changes when the parameter is one prior sd
/// larger.
pub(super) fn figures(found: &Identification) -> Vec<Figure> {
    let all = courses(found);
    let shown = &all[..all.len().min(EQUALS.len())];
    let times = shown.iter().flat_map(|course| course.rows.iter().map(|row| found.rows[*row].time));
    let x = Axis::tight(&with_unit("time", &found.time_unit), times);
    let n = found.parameters.len().min(found.whitened.ncols());
    let figure = |j: usize| {
        let parameter = &found.parameters[j];
        let value = |row: &usize| found.whitened[(*row, j)] * parameter.prior_sd;
        let values = || shown.iter().flat_map(|course| course.rows.iter().map(value));
        let y = Axis::around("change of the prediction [noise sd per prior sd]", values().chain([0.0]));
        let mut marks = vec![Mark::level((x.lo, x.hi), 0.0, MUTED)];
        for (course, colour) in shown.iter().zip(EQUALS) {
            let time: Vec<f64> = course.rows.iter().map(|row| found.rows[*row].time).collect();
            let change: Vec<f64> = course.rows.iter().map(value).collect();
            marks.extend(Mark::curve(&time, &change, colour, 1.75));
        }
        let extreme = values().fold(0.0_f64, |most, v| if v.abs() > most.abs() { v } else { most });
        let more = match all.len() - shown.len() {
            0 => String::new(),
            more => format!(" {more} courses more are in the table that --csv writes."),
        };
        let caption = format!(
            "At most {} noise sd for one prior sd. Where the curve is at zero, a datum says nothing of {}; two parameters whose \
             curves are alike, or mirror images, cannot be told apart.{more}",
            number::significant(extreme, 2),
            parameter.name
        );
        let title = format!("{}: sensitivity", parameter.name);
        let scene = Scene { title, description: caption.clone(), x: x.clone(), y, marks };
        let keys: Vec<(String, &str)> =
            shown.iter().zip(EQUALS).map(|(c, e)| (format!("line {}", e.name), c.name.as_str())).collect();
        Figure::new(&scene, &keys, caption)
    };
    (0..n).map(figure).collect()
}

/// The courses, in the order of the data; those that are the same output of several records are told by the record's name.
fn courses(found: &Identification) -> Vec<Course> {
    let mut courses: Vec<((usize, usize), Course)> = Vec::new();
    // The records that have rows, in their order.
    let mut records: Vec<usize> = Vec::new();
    for (k, row) in found.rows.iter().enumerate().take(found.whitened.nrows()) {
        let key = (row.record, row.output);
        if !records.contains(&row.record) {
            records.push(row.record);
        }
        if let Some((_, course)) = courses.iter_mut().find(|(known, _)| *known == key) {
            course.rows.push(k);
            continue;
        }
        let output = found.outputs.get(row.output).map_or("output", String::as_str);
        let record = found.records.get(records.len() - 1).map_or("", |record| record.record.as_str());
        let name = if found.records.len() < 2 { output.to_owned() } else { format!("{output}, {record}") };
        courses.push((key, Course { name, rows: vec![k] }));
    }
    courses.into_iter().map(|(_, course)| course).collect()
}
