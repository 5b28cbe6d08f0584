//! What was measured less what the model without a fault says, and what the likeliest scenario adds to it.

use starlings_diagnose::Diagnosed;
use starlings_diagnose::result::CourseFound;

use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, GREEN, INK, SHADE};
use crate::plot::scene::Scene;

/// One figure per course.
pub(super) fn figures(found: &Diagnosed) -> Vec<Figure> {
    found.courses.iter().map(|course| figure(found, course)).collect()
}

fn figure(found: &Diagnosed, course: &CourseFound) -> Figure {
    let less = |values: &[f64]| values.iter().zip(&course.healthy).map(|(v, h)| v - h).collect::<Vec<f64>>();
    let (measured, likeliest) = (less(&course.observed), less(&course.likeliest));
    let x = Axis::tight(&with_unit("time", &found.time_unit), course.times.iter().copied());
    let label = with_unit(&format!("{} less no fault", course.output), &course.unit);
    let y = Axis::around(&label, measured.iter().chain(&likeliest).copied());
    let seen = found
        .alarm
        .seen
        .as_ref()
        .filter(|seen| (&seen.record, &seen.output) == (&course.record, &course.output));
    let mut marks = Vec::new();
    marks.extend(seen.map(|seen| Mark::Span { from: seen.since, to: seen.until, colour: SHADE }));
    marks.push(Mark::flat_band((x.lo, x.hi), (-2.0 * course.noise, 2.0 * course.noise), GREEN, 0.16));
    marks.push(Mark::Dots {
        points: course.times.iter().copied().zip(measured).collect(),
        colour: INK,
        radius: 1.25,
    });
    marks.extend(Mark::curve(&course.times, &likeliest, BLUE, 1.75));
    let title = format!("{}, {}", course.output, course.record);
    let caption = match seen {
        Some(seen) => format!("The departure is seen at {} {}.", seen.until, found.time_unit),
        None => "Measured values less the model without a fault.".to_owned(),
    };
    let mut keys = vec![
        ("dot ink", "measured"),
        ("line blue", "likeliest scenario"),
        ("area green", "two standard deviations of the noise"),
    ];
    if seen.is_some() {
        keys.push(("area shade", "first departure"));
    }
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    Figure::new(&scene, &keys, caption)
}
