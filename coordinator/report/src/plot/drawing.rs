//! The marks of a scene in a drawing of no size: it stretches with whatever holds it.
//!
//! Long series are drawn as envelopes, one bucket of the axis about a pixel wide. Next file to read: `series.rs`.

use std::fmt::Write as _;

use super::figure::Key;
use super::mark::{Mark, Point};
use super::palette::Colour;
use super::scene::Scene;
use super::svg::{rect, short};
use super::thin;

/// Width and height of a drawing in its own units.
pub(crate) const SIZE: (f64, f64) = (4000.0, 2000.0);
/// Buckets of an envelope: about one per pixel of a figure.
const BUCKETS: usize = 700;

/// Spans, grid lines and the other marks, in this order.
pub(crate) fn content(scene: &Scene, keys: &[Key]) -> String {
    let is_span = |mark: &&Mark| matches!(mark, Mark::Span { .. });
    let mut text = String::new();
    scene.marks.iter().filter(is_span).for_each(|mark| draw(&mut text, scene, mark, keys));
    let (lo, hi) = scene.y.ends();
    let lines = scene.y.ticks(5).into_iter().map(|tick| SIZE.1 * (1.0 - (tick.at - lo) / (hi - lo)));
    let grid = lines.map(|y| ["M0 ", &short(y), "H", &short(SIZE.0)].concat()).collect::<String>();
    let _ = write!(text, "<path class=\"grid\" d=\"{grid}\"/>");
    scene.marks.iter().filter(|mark| !is_span(mark)).for_each(|mark| draw(&mut text, scene, mark, keys));
    text
}

/// The key that a mark belongs to.
pub(crate) fn key_of(mark: &Mark, keys: &[Key]) -> Option<usize> {
    let (shape, colour) = (mark.shape()?, mark.colour().name);
    keys.iter().position(|key| {
        let fits = |word: &str| key.sample.split(' ').any(|own| own == word);
        (fits(shape) || (shape == "line" && fits("tick"))) && fits(colour)
    })
}

fn draw(text: &mut String, scene: &Scene, mark: &Mark, keys: &[Key]) {
    let shape = match mark {
        Mark::Span { from, to, .. } => box_of(scene, (*from, *to), (scene.y.lo, scene.y.hi), 1.0),
        Mark::Band { points, opacity, .. } => band(scene, points, *opacity),
        Mark::Line { points, width, .. } => {
            polyline(scene, points, &format!("style=\"stroke-width:{}\"", short(*width)))
        }
        Mark::Dashes { points, .. } => polyline(scene, points, "class=\"dashes\""),
        Mark::Dots { points, radius, .. } => {
            let dots = points.iter().filter_map(|p| place(scene, *p));
            let d = dots.map(|(x, y)| ["M", &short(x), " ", &short(y), "h0"].concat()).collect::<String>();
            format!("<path class=\"dots\" style=\"stroke-width:{}\" d=\"{d}\"/>", short(2.0 * radius))
        }
        Mark::Stems { points, width, .. } => {
            let stem = |p: &Point| Some((place(scene, *p)?, place(scene, (p.0, 0.0))?));
            let d: String = points
                .iter()
                .filter_map(stem)
                .map(|((x, y), (_, zero))| ["M", &short(x), " ", &short(zero), "V", &short(y)].concat())
                .collect();
            format!("<path class=\"line\" style=\"stroke-width:{}\" d=\"{d}\"/>", short(*width))
        }
        Mark::Bars { bars, .. } => bars
            .iter()
            .map(|&(left, right, top)| box_of(scene, (left, right), (scene.y.lo, top), 0.85))
            .collect(),
        // Words stand beside the drawing, where they do not stretch.
        Mark::Heading { .. } => return,
    };
    let key = key_of(mark, keys).map_or(String::new(), |key| format!(" data-key=\"{key}\""));
    let _ = write!(text, "<g class=\"c {}\"{key}>{shape}</g>", mark.colour().name);
}

/// A filled rectangle between two values of either axis.
fn box_of(scene: &Scene, x: (f64, f64), y: (f64, f64), opacity: f64) -> String {
    let (Some(a), Some(b)) = (place(scene, (x.0, y.0)), place(scene, (x.1, y.1))) else {
        return String::new();
    };
    let corner = (a.0.min(b.0), a.1.min(b.1));
    rect(corner, ((b.0 - a.0).abs(), (b.1 - a.1).abs()), "area", opacity)
}

fn polyline(scene: &Scene, points: &[Point], attribute: &str) -> String {
    let class = if attribute.starts_with("class") { "" } else { "class=\"line\" " };
    let at: String = if thin::is_long(points.len(), points.iter().map(|p| p.0)) {
        let samples = points.iter().map(|p| (p.0, p.1, p.1));
        let buckets = thin::envelope(samples, &scene.x, BUCKETS);
        buckets.iter().enumerate().filter_map(|(k, b)| b.map(|b| zigzag(scene, k, b))).collect()
    } else {
        points.iter().filter_map(|p| place(scene, *p)).map(pair).collect()
    };
    format!("<polyline {class}{attribute} points=\"{}\"/>", at.trim_end())
}

/// Both ends of a bucket, in turns, so that the curve touches them.
fn zigzag(scene: &Scene, k: usize, (lo, hi): (f64, f64)) -> String {
    let ends = if k.is_multiple_of(2) { [lo, hi] } else { [hi, lo] };
    let x = middle(k);
    ends.into_iter().map(|v| pair((x, height(scene, v)))).collect()
}

/// The middle of a bucket in the drawing.
fn middle(k: usize) -> f64 {
    (k as f64 + 0.5) / BUCKETS as f64 * SIZE.0
}

fn band(scene: &Scene, points: &[(f64, f64, f64)], opacity: f64) -> String {
    let edges: Vec<(f64, f64, f64)> = if thin::is_long(points.len(), points.iter().map(|p| p.0)) {
        let buckets = thin::envelope(points.iter().copied(), &scene.x, BUCKETS);
        let known = buckets.iter().enumerate().filter_map(|(k, b)| b.map(|(lo, hi)| (middle(k), lo, hi)));
        known.map(|(x, lo, hi)| (x, height(scene, lo), height(scene, hi))).collect()
    } else {
        let edge = |&(x, lo, hi): &(f64, f64, f64)| {
            let (lower, upper) = (place(scene, (x, lo))?, place(scene, (x, hi))?);
            Some((lower.0, lower.1, upper.1))
        };
        points.iter().filter_map(edge).collect()
    };
    if edges.len() < 2 {
        return String::new();
    }
    let upper = edges.iter().map(|e| pair((e.0, e.2)));
    let lower = edges.iter().rev().map(|e| pair((e.0, e.1)));
    let outline: String = upper.chain(lower).collect();
    let opacity = short(opacity);
    format!("<polygon class=\"area\" fill-opacity=\"{opacity}\" points=\"{}\"/>", outline.trim_end())
}

fn pair((x, y): Point) -> String {
    format!("{},{} ", x.round(), y.round())
}

/// Where a point stands in the drawing; points that are not finite have no place. What lies far outside is held near the
/// edge, so that curves leave the drawing and nothing overflows.
pub(crate) fn place(scene: &Scene, (x, y): Point) -> Option<Point> {
    if !(x.is_finite() && y.is_finite()) {
        return None;
    }
    let (lo, hi) = scene.x.ends();
    let share = ((scene.x.at(x) - lo) / (hi - lo)).clamp(-1.0, 2.0);
    Some((SIZE.0 * share, height(scene, y)))
}

fn height(scene: &Scene, y: f64) -> f64 {
    let (lo, hi) = scene.y.ends();
    // Halves, because the difference of the largest numbers overflows.
    let share = (0.5 * scene.y.at(y) - 0.5 * lo) / (0.5 * hi - 0.5 * lo);
    SIZE.1 * (1.0 - share.clamp(-1.0, 2.0))
}

/// The style of a colour's group where no page gives one.
pub(crate) fn standalone_style(colours: &[Colour]) -> String {
    let mut style = ".line,.dashes,.dots,.grid{fill:none;vector-effect:non-scaling-stroke}.grid{stroke:#dfe4e8}\
                     .dashes{stroke-dasharray:6 5;stroke-width:1.4}.dots{stroke-linecap:round}.line{stroke-linejoin:round}"
        .to_owned();
    for Colour { name, hex } in colours {
        let _ = write!(
            style,
            ".{name} .line,.{name} .dashes,.{name} .dots{{stroke:{hex}}}.{name} .area{{fill:{hex}}}"
        );
    }
    style
}
