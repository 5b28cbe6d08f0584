//! The unknown input of one equation: against time, and against the state of that equation.
//!
//! Points along one curve over the state mean that the input depends on that state; a cloud means that it does not. Next
//! file to read: `spectrum.rs`.

use starlings_explain::Figures;
use starlings_explain::locate::UnknownInput;
use starlings_explain::result::Explanation;

use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, MUTED, VERMILION};
use crate::plot::scene::Scene;
use crate::plot::thin;

/// Unknown inputs drawn at most.
const FORCES: usize = 8;
/// Dots against the state at most.
const DOTS: usize = 240;

/// The inputs that gain most, each against time and against its state.
pub(super) fn figures(_: &Explanation, data: &Figures) -> Vec<Figure> {
    let mut order: Vec<&UnknownInput> = data.before.forces.iter().filter(|f| !f.time.is_empty()).collect();
    order.sort_by(|a, b| b.log_likelihood_gain.total_cmp(&a.log_likelihood_gain));
    let mut figures = Vec::new();
    for input in order.into_iter().take(FORCES) {
        figures.push(over_time(input, &data.time_unit));
        figures.push(over_state(input));
    }
    figures
}

/// Draws the input against time.
fn over_time(input: &UnknownInput, time_unit: &str) -> Figure {
    let side = |sign: f64| -> Vec<f64> {
        let sd = |k: usize| input.sd.get(k).copied().filter(|sd| sd.is_finite()).unwrap_or(0.0);
        input.value.iter().enumerate().map(|(k, v)| v + sign * 2.0 * sd(k)).collect()
    };
    let (lo, hi) = (side(-1.0), side(1.0));
    let x = Axis::tight(&with_unit("time", time_unit), input.time.iter().copied());
    let y = Axis::around(&label(input), lo.iter().chain(&hi).copied().chain([0.0]));
    let parts = thin::parts(&input.time, &lo, &hi);
    let mut marks: Vec<Mark> = parts
        .iter()
        .map(|part| Mark::Band { points: thin::band(part), colour: BLUE, opacity: 0.2 })
        .collect();
    marks.push(Mark::level((x.lo, x.hi), 0.0, MUTED));
    marks.extend(Mark::curve(&input.time, &input.value, BLUE, 1.75));
    let is_drawn = input.proposed.len() == input.time.len();
    if is_drawn {
        marks.extend(Mark::curve(&input.time, &input.proposed, VERMILION, 1.75));
    }
    let known: Vec<_> = lo.iter().zip(&hi).filter(|(lo, hi)| lo.is_finite() && hi.is_finite()).collect();
    let off = known.iter().filter(|(lo, hi)| **lo > 0.0 || **hi < 0.0).count();
    let share = number::percent(off as f64 / known.len() as f64);
    let caption = format!(
        "What would have to be added to the equation of {} to follow the data. Zero is outside the band at {share} of the \
         times; the log-likelihood grows by {}.",
        input.state,
        number::significant(input.log_likelihood_gain, 3)
    );
    let title = format!("Unknown input of {}, record {}: over time", input.state, input.record);
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    let legend = [
        ("line blue", "estimate"),
        ("area blue", "± 2 sd"),
        ("line vermilion", "what was added, along the same run"),
    ];
    Figure::new(&scene, &legend[..2 + usize::from(is_drawn)], caption)
}

/// Draws the input against the state.
fn over_state(input: &UnknownInput) -> Figure {
    let points: Vec<(f64, f64)> = input.at.iter().copied().zip(input.value.iter().copied()).collect();
    let points: Vec<_> = points.into_iter().filter(|p| p.0.is_finite() && p.1.is_finite()).collect();
    let stride = points.len().div_ceil(DOTS).max(1);
    let shown: Vec<_> = points.into_iter().step_by(stride).collect();
    let x = Axis::around(&input.state, shown.iter().map(|p| p.0));
    let y = Axis::around(&label(input), shown.iter().map(|p| p.1).chain([0.0]));
    let marks =
        vec![Mark::level((x.lo, x.hi), 0.0, MUTED), Mark::Dots { points: shown, colour: BLUE, radius: 2.25 }];
    let caption = format!(
        "Dots along one curve: the missing term depends on {0}. A step at zero is dry friction, a slope is a linear term. A \
         cloud: it depends on something else than {0}.",
        input.state
    );
    let title = format!("Unknown input of {}, record {}: over {}", input.state, input.record, input.state);
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    Figure::new(&scene, &[("dot blue", "estimate at one time")], caption)
}

fn label(input: &UnknownInput) -> String {
    with_unit(&format!("added to d {}/dt", input.state), &input.unit)
}
