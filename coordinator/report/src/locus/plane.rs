//! The complex plane: the locus of every shown pole under every observer, and where each pole is at each gain.
//!
//! Next file to read: [`super::decay`].

use nalgebra::Complex;

use super::gains::Ways;
use crate::plot::axis::Axis;
use crate::plot::drawing::place;
use crate::plot::figure::Figure;
use crate::plot::mark::{Mark, Point};
use crate::plot::palette::{Colour, INK, MUTED};
use crate::plot::scene::Scene;

/// A figure and the positions on it that the script needs.
pub(super) struct Plane {
    pub(super) figure: Figure,
    /// `[observer][pole]`.
    pub(super) positions: Vec<Vec<Positions>>,
}

/// Per gain, a position in the drawing; nothing outside the plane's edges.
pub(super) type Positions = Vec<Option<(i32, i32)>>;

/// Draws the loci of the shown poles, one colour per observer, and positions the poles at the frames.
pub(super) fn draw(
    shown: &[Complex<f64>],
    ways: &[Ways],
    (colours, names): (&[Colour], &[String]),
    unit: &str,
) -> Plane {
    let scale = shown.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
    let scale = if scale > 0.0 { scale } else { 1.0 };
    let right = shown.iter().map(|pole| pole.re).fold(0.0, f64::max);
    let top = shown.iter().map(|pole| pole.im).fold(0.2 * scale, f64::max);
    let x = Axis::tight(&format!("Re λ [{unit}]"), [-1.3 * scale, 1.2 * right + 0.06 * scale]);
    let y = Axis::tight(&format!("Im λ [{unit}]"), [0.0, 1.06 * top]);
    let inside =
        |pole: &Complex<f64>| (x.lo..=x.hi).contains(&pole.re) && (-1e-9 * scale..=y.hi).contains(&pole.im);
    let mut marks = vec![Mark::Line { points: vec![(0.0, y.lo), (0.0, y.hi)], colour: MUTED, width: 1.0 }];
    for (k, (observer, colour)) in ways.iter().zip(colours).enumerate() {
        let parts = observer.loci.iter().flat_map(|way| parts(way, inside));
        marks.extend(parts.map(|points| Mark::Line { points, colour: *colour, width: width(k, ways.len()) }));
    }
    let start: Vec<Point> = shown.iter().map(|pole| (pole.re, pole.im)).collect();
    marks.push(Mark::Dots { points: start, colour: INK, radius: 3.5 });
    let title = "Root locus: the poles as the gain grows".to_owned();
    let caption = "Upper half plane; the lower half is its mirror image. An error decays with the real part of its slowest pole: a \
                   pole that an observer hardly moves is an error that it hardly corrects, and one that comes back along the real \
                   axis is over-damped. Where loci of several observers are the same, they lie inside one another.";
    let scene = Scene { title, description: caption.to_owned(), x: x.clone(), y: y.clone(), marks };
    let at = |pole: &Complex<f64>| {
        let point = Some((pole.re, pole.im)).filter(|_| inside(pole))?;
        place(&scene, point).map(|(x, y)| (x.round() as i32, y.round() as i32))
    };
    let of_observer = |o: &Ways| o.poles.iter().map(|way| way.iter().map(at).collect()).collect();
    let positions = ways.iter().map(of_observer).collect();
    let mut keys: Vec<(String, &str)> =
        colours.iter().zip(names).map(|(c, name)| (format!("line {}", c.name), name.as_str())).collect();
    keys.push(("dot ink".to_owned(), "without observer"));
    Plane { figure: Figure::new(&scene, &keys, caption.to_owned()), positions }
}

/// Width of the curves of an observer: those of the same course lie inside one another, the first outermost.
pub(super) fn width(k: usize, n: usize) -> f64 {
    2.5f64.mul_add((n - 1 - k) as f64, 2.0)
}

/// The parts of a way that lie inside the plane.
fn parts(way: &[Complex<f64>], inside: impl Fn(&Complex<f64>) -> bool) -> Vec<Vec<Point>> {
    let mut parts = vec![Vec::new()];
    for pole in way {
        match parts.last_mut() {
            Some(last) if inside(pole) => last.push((pole.re, pole.im)),
            Some(last) if !last.is_empty() => parts.push(Vec::new()),
            _ => {}
        }
    }
    // A pole that does not move is a point.
    parts.retain(|part| part.len() > 1);
    parts
}
