//! The generalised sensitivity function of each parameter: the share of its information that has arrived by a time.

use starlings_study::identify::Identification;

use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, GREY, MUTED};
use crate::plot::scene::Scene;

/// One figure per parameter with a generalised sensitivity function, the others behind it.
pub(super) fn figures(found: &Identification) -> Vec<Figure> {
    let series = &found.gsf;
    // Times of several records overlap: then the observation times are counted.
    let one = found.records.len() < 2;
    let x_values: Vec<f64> =
        if one { series.time.clone() } else { (1..=series.time.len()).map(|k| k as f64).collect() };
    let x_label = if one {
        with_unit("time", &found.time_unit)
    } else {
        "observation time, counted through the records".to_owned()
    };
    let known: Vec<(&String, &Vec<f64>)> =
        series.curves.iter().filter_map(|(name, curve)| Some((name, curve.as_ref()?))).collect();
    let figure = |(name, curve): &(&String, &Vec<f64>)| {
        let x = Axis::tight(&x_label, x_values.iter().copied());
        let y = Axis::around("generalised sensitivity", curve.iter().copied().chain([0.0, 1.0]));
        let ends = (x.lo, x.hi);
        let mut marks = vec![Mark::level(ends, 0.0, MUTED), Mark::dashed_level(ends, 1.0, MUTED)];
        for (_, other) in known.iter().filter(|(other, _)| other != name) {
            marks.extend(Mark::curve(&x_values, other, GREY, 1.0));
        }
        marks.extend(Mark::curve(&x_values, curve, BLUE, 2.0));
        let half = curve.iter().position(|v| *v >= 0.5).map(|k| x_values[k]);
        let caption = format!(
            "{}The data bear on {name} where the curve rises; where it falls, they bear on parameters that are \
             correlated with it.",
            half.map_or_else(String::new, |t| format!(
                "Half of it is reached at {}. ",
                number::significant(t, 3)
            ))
        );
        let title = format!("{name}: generalised sensitivity");
        let scene = Scene { title, description: caption.clone(), x, y, marks };
        Figure::new(&scene, &[("line blue", "this parameter"), ("line grey", "the others")], caption)
    };
    known.iter().map(figure).collect()
}
