//! Surfaces registered in images, and the signed distance of a point to them.
//!
//! A surface shows where a wall is, not which of its points is which: what slid along the surface cannot be seen. The
//! signed distance of a predicted point compares what can (Moireau et al. 2013, sequential identification of boundary
//! support parameters in a fluid–structure vascular model using patient image data): zero is observed, the distance of the
//! predicted point is the prediction. [`Profile`] is the wall of an axisymmetric vessel, [`Mesh`] any triangulated
//! surface. How a surface is segmented, and smooth interpolation between two of them in time, are not here. Next file to
//! read: [`profile`].

mod mesh;
mod profile;
mod search;
mod topology;
mod triangle;
mod vector;

pub use mesh::Mesh;
pub use profile::Profile;

/// The place of a surface that is nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot<const D: usize> {
    /// Signed distance of the point: positive outside. Past an open end it is counted along the normal there, so that
    /// sliding out of the image does not count.
    pub distance: f64,
    /// The place.
    pub point: [f64; D],
    /// Slope of the distance when the point moves: a unit vector, outward.
    pub normal: [f64; D],
    /// The segment or triangle of the place.
    pub facet: usize,
    /// How far the point lies past an open end, along the surface; zero elsewhere. Nothing was measured there.
    pub past_end: f64,
}

impl<const D: usize> Foot<D> {
    /// The foot of `x` at the place `point`, where the outward normal is `outward`.
    fn new(x: &[f64; D], point: [f64; D], outward: [f64; D], facet: usize, open: bool) -> Self {
        let way = vector::minus(x, &point);
        let along = vector::dot(&way, &outward);
        let length = vector::norm(&way);
        if open {
            let past = vector::norm(&vector::minus(&way, &vector::times(&outward, along)));
            return Self { distance: along, point, normal: outward, facet, past_end: past };
        }
        let distance = length.copysign(along);
        // On the surface the slope is the normal itself.
        let normal = if length > 0.0 { vector::times(&way, 1.0 / distance) } else { outward };
        Self { distance, point, normal, facet, past_end: 0.0 }
    }
}
