//! Walls that were measured as registered surfaces: what a predicted displacement is compared with.
//!
//! A channel of this kind has a node of the model's wall and one surface per time. Its observed value is zero, its predicted
//! one the signed distance of the displaced node to the surface of the time, positive outside (Moireau et al. 2013). Models,
//! workers and estimators get displacements and numbers only. How surfaces are read is in [`crate::record`]. Next file to read:
//! [`super::distances`], where predictions become distances.

use std::sync::Arc;

use starlings_models::surface::{Foot, Mesh, Profile};

/// Distance at which a node is on a surface, relative to one unit of length and to its displacement.
const CLOSE: f64 = 1e-12;

/// Steps after which the search along a node's line gives up.
const MOST_STEPS: usize = 50;

/// The surface of one time.
#[derive(Clone, Debug)]
pub enum Shape {
    /// The wall of an axisymmetric vessel, points (z, r).
    Profile(Profile),
    /// Triangles, points (x, y, z).
    Mesh(Mesh),
}

impl Shape {
    /// The nearest place. The third coordinate of a profile is zero.
    fn foot(&self, [a, b, c]: [f64; 3]) -> Option<Foot<3>> {
        match self {
            Self::Profile(profile) => profile.foot([a, b]).map(|foot| {
                let ([z, r], [nz, nr]) = (foot.point, foot.normal);
                let Foot { distance, facet, past_end, .. } = foot;
                Foot { distance, point: [z, r, 0.0], normal: [nz, nr, 0.0], facet, past_end }
            }),
            Self::Mesh(mesh) => mesh.foot([a, b, c]),
        }
    }
}

/// The surfaces of a channel, in the order of time.
#[derive(Clone, Debug, Default)]
pub struct Shapes {
    /// Times among those of the record.
    pub times: Vec<f64>,
    /// One surface for each.
    pub shapes: Vec<Shape>,
    /// Diagonal of the box around each.
    pub lengths: Vec<f64>,
    /// Every coordinate that they were read from, by which a change of the files is seen.
    pub numbers: Vec<f64>,
}

/// Diagonal of the box around points; zero for none.
pub(crate) fn length<const D: usize>(points: impl IntoIterator<Item = [f64; D]>) -> f64 {
    let mut around = [[f64::INFINITY, f64::NEG_INFINITY]; D];
    for point in points {
        around.iter_mut().zip(point).for_each(|([lo, hi], x)| (*lo, *hi) = (lo.min(x), hi.max(x)));
    }
    around.iter().map(|[lo, hi]| (hi - lo).max(0.0).powi(2)).sum::<f64>().sqrt()
}

impl Shapes {
    fn at(&self, time: f64) -> Option<&Shape> {
        self.shapes.get(self.times.binary_search_by(|t| t.total_cmp(&time)).ok()?)
    }
}

/// A node of the model's wall and the surfaces that it is compared with.
#[derive(Clone, Debug)]
pub struct Node {
    /// Where the node is without displacement: (z, r, 0) or (x, y, z).
    pub rest: [f64; 3],
    /// The unit vector along which it is displaced.
    pub normal: [f64; 3],
    /// The surfaces.
    pub seen: Arc<Shapes>,
}

impl PartialEq for Node {
    fn eq(&self, other: &Self) -> bool {
        let bits = |node: &Self| [node.rest, node.normal].map(|x| x.map(f64::to_bits));
        bits(self) == bits(other) && Arc::ptr_eq(&self.seen, &other.seen)
    }
}

impl Node {
    /// Whether the surface of this time shows the node: there is one, and the node at rest is not past an open end.
    ///
    /// The place at rest decides and not that of a particle, so that all particles are compared with the same data.
    pub(crate) fn is_shown(&self, time: f64) -> bool {
        self.foot(time, 0.0).is_some_and(|foot| foot.past_end <= 0.0)
    }

    /// Signed distance of the node, displaced, to the surface of this time; `None` without one.
    pub fn distance(&self, time: f64, displacement: f64) -> Option<f64> {
        self.foot(time, displacement).map(|foot| foot.distance)
    }

    /// The displacement with which the node is on the surface of this time, by Newton's method; `None` without one, and where
    /// its line does not meet the surface.
    pub fn crossing(&self, time: f64) -> Option<f64> {
        let mut displacement = 0.0;
        for _ in 0..MOST_STEPS {
            let foot = self.foot(time, displacement)?;
            if foot.distance.abs() <= CLOSE * (1.0 + f64::abs(displacement)) {
                return Some(displacement);
            }
            let slope: f64 = foot.normal.iter().zip(&self.normal).map(|(a, b)| a * b).sum();
            displacement -= foot.distance / slope;
        }
        None
    }

    /// Standard deviation of the distance to the surface of this time, whose points have the noise `across` along the node's
    /// direction and `along` at right angles to it; `None` without a surface, and where the node's line does not meet it.
    ///
    /// Where the surface has the normal n and the node the direction m, the variance is that of n · error: across² (n · m)² +
    /// along² (1 − (n · m)²). It depends on the data alone, so that it is the same for all particles.
    pub(crate) fn noise(&self, time: f64, across: f64, along: f64) -> Option<f64> {
        let foot = self.foot(time, self.crossing(time)?)?;
        let cosine: f64 = foot.normal.iter().zip(&self.normal).map(|(a, b)| a * b).sum();
        let share = cosine.powi(2).min(1.0);
        Some((across.powi(2) * share + along.powi(2) * (1.0 - share)).sqrt())
    }

    fn foot(&self, time: f64, displacement: f64) -> Option<Foot<3>> {
        let displaced = std::array::from_fn(|i| displacement.mul_add(self.normal[i], self.rest[i]));
        self.seen.at(time)?.foot(displaced)
    }
}
