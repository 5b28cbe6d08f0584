//! How fast the slowest error decays, against the gain.
//!
//! Next file to read: [`super::view`].

use plotters::style::RGBColor;
use starlings_models::spectrum::{Decay, ObserverSpectrum};

use super::gains::Ways;
use crate::ReportError;
use crate::plot::axis::Axis;
use crate::plot::mark::{Mark, Point};
use crate::plot::palette::MUTED;
use crate::plot::scene::{Scene, picture};

/// Width and height of the figure, in figure units.
const SIZE: (i32, i32) = (640, 300);

/// A drawing and the places on it that the script needs.
pub(super) struct DecayFigure {
    /// One SVG element.
    pub(super) svg: String,
    /// Horizontal place of each gain; nothing for gain zero, which a logarithmic axis does not have.
    pub(super) cursor: Vec<Option<i32>>,
    /// Upper and lower end of the figure's axes.
    pub(super) height: Option<(i32, i32)>,
}

/// Draws −max Re λ of every observer over the gains of the page, with its best point.
///
/// # Errors
///
/// The drawing library refuses a mark.
pub(super) fn draw(
    observers: &[ObserverSpectrum],
    ways: &[Ways],
    gains: &[f64],
    colours: &[RGBColor],
    (decay, unit): (Option<Decay>, &str),
) -> Result<DecayFigure, ReportError> {
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
        marks.push(Mark::dashed_level((x.lo, x.hi), rate, MUTED));
    }
    let n = curves.len();
    for (k, (curve, colour)) in curves.iter().zip(colours).enumerate() {
        let width = 1.8 + 1.3 * (n - 1 - k) as f64;
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
    let description =
        "Minus the largest real part of all poles against the gain. Dots are the best gains.".to_owned();
    let (lo, hi) = (y.lo, y.hi);
    let scene = Scene { title, description, x, y, marks };
    let svg = picture(SIZE, &scene.title, &scene.description, |surface| scene.draw(surface))?;
    let at = |gain: &f64| if *gain > 0.0 { (*gain, lo) } else { (f64::NAN, lo) };
    let cursor = scene.positions(SIZE, &gains.iter().map(at).collect::<Vec<_>>())?;
    let ends = scene.positions(SIZE, &[(scene.x.lo, hi), (scene.x.lo, lo)])?;
    Ok(DecayFigure {
        svg,
        cursor: cursor.into_iter().map(|place| place.map(|(x, _)| x)).collect(),
        height: ends[0].zip(ends[1]).map(|(upper, lower)| (upper.1, lower.1)),
    })
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
