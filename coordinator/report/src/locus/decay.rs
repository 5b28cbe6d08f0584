//! How fast the slowest error decays, against the gain.
//!
//! Next file to read: [`super::view`].

use starlings_models::spectrum::{Decay, ObserverSpectrum};

use super::gains::Ways;
use super::plane::width;
use crate::plot::axis::Axis;
use crate::plot::drawing::place;
use crate::plot::figure::Figure;
use crate::plot::mark::{Mark, Point};
use crate::plot::palette::{Colour, LIMIT};
use crate::plot::scene::Scene;

/// A figure and the places on it that the script needs.
pub(super) struct DecayFigure {
    pub(super) figure: Figure,
    /// Horizontal place of each gain; nothing for gain zero, which a logarithmic axis does not have.
    pub(super) cursor: Vec<Option<i32>>,
}

/// Draws −max Re λ of every observer over the gains of the page, with its best point.
pub(super) fn draw(
    observers: &[ObserverSpectrum],
    ways: &[Ways],
    gains: &[f64],
    (colours, names): (&[Colour], &[String]),
    (decay, unit): (Option<Decay>, &str),
) -> DecayFigure {
    let curves: Vec<Vec<Point>> = observers.iter().zip(ways).map(|(o, w)| curve(o, w, gains)).collect();
    let wanted = decay.map(|decay| -decay.max_re());
    let rates = || curves.iter().flatten().map(|point| point.1).chain(wanted);
    let largest = rates().fold(0.0, f64::max);
    // Rates that only rounding holds above zero would stretch the axis over many decades.
    let visible = |rate: &f64| *rate > 1e-7 * largest;
    let x = Axis::log_around(&format!("gain γ [{unit}]"), gains.iter().copied().filter(|gain| *gain > 0.0));
    let y = Axis::log_around(&format!("decay rate −max Re λ [{unit}]"), rates().filter(visible));
    let mut marks = Vec::new();
    if let Some(rate) = wanted {
        marks.push(Mark::dashed_level((x.lo, x.hi), rate, LIMIT));
    }
    let n = curves.len();
    for (k, (curve, colour)) in curves.iter().zip(colours).enumerate() {
        let width = width(k, n);
        for part in curve.split(|point| !visible(&point.1)).filter(|part| part.len() > 1) {
            marks.push(Mark::Line { points: part.to_vec(), colour: *colour, width });
        }
    }
    for (observer, colour) in observers.iter().zip(colours) {
        let best = (observer.best.gain, -observer.best.max_re);
        if best.0 >= x.lo && best.0 <= x.hi && visible(&best.1) {
            marks.push(Mark::Dots { points: vec![best], colour: *colour, radius: 4.5 });
        }
    }
    let title = "How fast the slowest error decays".to_owned();
    let caption = "Minus the largest real part of all poles against the gain. Dots: best gains. A curve that bends down has its best \
                   gain behind it.";
    let lo = y.lo;
    let scene = Scene { title, description: caption.to_owned(), x, y, marks };
    let at =
        |gain: &f64| place(&scene, (Some(*gain).filter(|g| *g > 0.0)?, lo)).map(|(x, _)| x.round() as i32);
    let mut keys: Vec<(String, &str)> =
        colours.iter().zip(names).map(|(c, name)| (format!("line {}", c.name), name.as_str())).collect();
    if wanted.is_some() {
        keys.push(("dash limit".to_owned(), "the wanted decay"));
    }
    let cursor = gains.iter().map(at).collect();
    DecayFigure { figure: Figure::new(&scene, &keys, caption.to_owned()), cursor }
}

/// (gain, rate) of an observer: the gains of the page, and its best one between them.
fn curve(observer: &ObserverSpectrum, ways: &Ways, gains: &[f64]) -> Vec<Point> {
    let mut points: Vec<Point> =
        gains.iter().copied().zip(ways.max_re.iter().map(|re| -re)).skip(1).collect();
    if (gains[1]..=gains[gains.len() - 1]).contains(&observer.best.gain) {
        points.push((observer.best.gain, -observer.best.max_re));
    }
    points.sort_by(|p, q| p.0.total_cmp(&q.0));
    points
}
