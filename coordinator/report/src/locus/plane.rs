//! The complex plane: the locus of every shown pole under every observer, and where each pole is at each gain.
//!
//! Next file to read: [`super::decay`].

use nalgebra::Complex;
use plotters::style::RGBColor;

use super::gains::Ways;
use crate::ReportError;
use crate::plot::axis::Axis;
use crate::plot::mark::{Mark, Point};
use crate::plot::palette::{INK, MUTED};
use crate::plot::scene::{Scene, picture};

/// Width and height of the plane, in figure units.
const SIZE: (i32, i32) = (640, 400);

/// A drawing and the positions on it that the script needs.
pub(super) struct Plane {
    /// One SVG element.
    pub(super) svg: String,
    /// `[observer][pole]`.
    pub(super) positions: Vec<Vec<Positions>>,
}

/// Per gain, a position in drawing units; nothing outside the plane's edges.
pub(super) type Positions = Vec<Option<(i32, i32)>>;

/// Draws the loci of the shown poles, one colour per observer, and positions the poles at the frames.
///
/// # Errors
///
/// The drawing library refuses a mark.
pub(super) fn draw(
    shown: &[Complex<f64>],
    ways: &[Ways],
    colours: &[RGBColor],
    unit: &str,
) -> Result<Plane, ReportError> {
    let scale = shown.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
    let scale = if scale > 0.0 { scale } else { 1.0 };
    let right = shown.iter().map(|pole| pole.re).fold(0.0, f64::max);
    let top = shown.iter().map(|pole| pole.im).fold(0.2 * scale, f64::max);
    let x = Axis::tight(&format!("Re λ [{unit}]"), [-1.3 * scale, 1.2 * right + 0.06 * scale]);
    let y = Axis::tight(&format!("Im λ [{unit}]"), [0.0, 1.06 * top]);
    let inside =
        |pole: &Complex<f64>| (x.lo..=x.hi).contains(&pole.re) && (-1e-9 * scale..=y.hi).contains(&pole.im);
    let mut marks = vec![Mark::Line { points: vec![(0.0, y.lo), (0.0, y.hi)], colour: MUTED, width: 1.0 }];
    let n = ways.len();
    for (k, (observer, colour)) in ways.iter().zip(colours).enumerate() {
        // Observers with the same locus lie on top of each other: the first stays visible as a rim.
        let width = 1.8 + 1.3 * (n - 1 - k) as f64;
        for part in observer.loci.iter().flat_map(|way| parts(way, inside)) {
            marks.push(Mark::Line { points: part, colour: *colour, width });
        }
    }
    let start: Vec<Point> = shown.iter().map(|pole| (pole.re, pole.im)).collect();
    marks.push(Mark::Dots { points: start, colour: INK, radius: 3.5 });
    let title = "Root locus: the poles as the gain grows".to_owned();
    let description = "The upper half of the complex plane; the lower half is its mirror image. Dark dots are the poles \
                       without observer.";
    let scene = Scene { title, description: description.to_owned(), x: x.clone(), y: y.clone(), marks };
    let svg = picture(SIZE, &scene.title, &scene.description, |surface| scene.draw(surface))?;
    let mut positions = Vec::with_capacity(n);
    for observer in ways {
        let mut of_observer = Vec::with_capacity(observer.poles.len());
        for way in &observer.poles {
            let at =
                |pole: &Complex<f64>| if inside(pole) { (pole.re, pole.im) } else { (f64::NAN, f64::NAN) };
            let points: Vec<Point> = way.iter().map(at).collect();
            of_observer.push(scene.positions(SIZE, &points)?);
        }
        positions.push(of_observer);
    }
    Ok(Plane { svg, positions })
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
