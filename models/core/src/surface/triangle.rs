//! The place of a triangle that is nearest to a point (Ericson 2005, Real-Time Collision Detection, §5.1.5).
//!
//! Next file to read: [`super::mesh`].

use super::vector::{cross, dot, minus, plus, times};

/// On which part of the triangle a place lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Inside.
    Face,
    /// On the edge from this corner to the next.
    Edge(usize),
    /// At this corner.
    Corner(usize),
}

/// The nearest place, and the part of the triangle that it lies on.
pub(super) fn closest([a, b, c]: &[[f64; 3]; 3], x: &[f64; 3]) -> ([f64; 3], Part) {
    let (ab, ac, bc) = (minus(b, a), minus(c, a), minus(c, b));
    let (from_a, from_b, from_c) = (minus(x, a), minus(x, b), minus(x, c));
    let (d1, d2) = (dot(&ab, &from_a), dot(&ac, &from_a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, Part::Corner(0));
    }
    let (d3, d4) = (dot(&ab, &from_b), dot(&ac, &from_b));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, Part::Corner(1));
    }
    let (d5, d6) = (dot(&ab, &from_c), dot(&ac, &from_c));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, Part::Corner(2));
    }
    // Areas opposite to c, b and a: negative beyond that edge.
    let (of_c, of_b, of_a) = (d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4);
    if of_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (plus(a, &times(&ab, d1 / (d1 - d3))), Part::Edge(0));
    }
    if of_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (plus(a, &times(&ac, d2 / (d2 - d6))), Part::Edge(2));
    }
    if of_a <= 0.0 && d4 >= d3 && d5 >= d6 {
        return (plus(b, &times(&bc, (d4 - d3) / ((d4 - d3) + (d5 - d6)))), Part::Edge(1));
    }
    let area = of_a + of_b + of_c;
    (plus(a, &plus(&times(&ab, of_b / area), &times(&ac, of_c / area))), Part::Face)
}

/// How far along a line from `x` a triangle is, in lengths of `way`; `None` where the line passes it by (Möller & Trumbore 1997).
pub(super) fn crossing([a, b, c]: &[[f64; 3]; 3], x: &[f64; 3], way: &[f64; 3]) -> Option<f64> {
    let (ab, ac, from_a) = (minus(b, a), minus(c, a), minus(x, a));
    let across = cross(way, &ac);
    let volume = dot(&ab, &across);
    let u = dot(&from_a, &across) / volume;
    let turned = cross(&from_a, &ab);
    let v = dot(way, &turned) / volume;
    // A line in the plane of the triangle has no numbers here.
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| dot(&ac, &turned) / volume)
}
