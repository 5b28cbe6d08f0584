//! The profile of an axisymmetric wall: a line of points (z, r) along the axis.
//!
//! Both ends are open. Whether the line crosses itself is not looked at. Next file to read: [`super::mesh`].

use super::Foot;
use super::search::{Nearest, Search};
use super::vector::{dot, minus, norm, plus, times, unit};
use crate::SetupError;

/// Segments between neighbouring points, the axis on their right as z increases.
#[derive(Clone, Debug)]
pub struct Profile {
    points: Vec<[f64; 2]>,
    /// Outward unit normal of each segment.
    normals: Vec<[f64; 2]>,
    search: Search<2>,
}

impl Profile {
    /// A profile of points (z, r), inlet to outlet in the direction of increasing z.
    ///
    /// # Errors
    /// With fewer than two points, a point that is not finite, repeated, or not off the axis, or when the line runs against z, so
    /// that its normals point inward.
    pub fn new(points: Vec<[f64; 2]>) -> Result<Self, SetupError> {
        let refuse = |message: String| Err(SetupError::Invalid(message));
        if points.len() < 2 {
            return refuse(format!("a profile of {} points: give two or more", points.len()));
        }
        for (i, [z, r]) in points.iter().enumerate() {
            if !z.is_finite() || !r.is_finite() || *r <= 0.0 {
                return refuse(format!(
                    "point {i} of the profile is ({z}, {r}): give finite numbers, r above zero"
                ));
            }
        }
        if let Some(i) = points.windows(2).position(|pair| norm(&minus(&pair[1], &pair[0])) == 0.0) {
            return refuse(format!("points {i} and {} of the profile are the same: remove one", i + 1));
        }
        // ∫ r² dz, up to π the volume inside.
        let slice = |pair: &[[f64; 2]]| {
            let ([z0, r0], [z1, r1]) = (pair[0], pair[1]);
            (z1 - z0) * (r0 * r0 + r0 * r1 + r1 * r1) / 3.0
        };
        if points.windows(2).map(slice).sum::<f64>() <= 0.0 {
            return refuse(
                "the profile runs against z, so that its normals point inward: reverse the order of its points"
                    .to_owned(),
            );
        }
        let normal = |pair: &[[f64; 2]]| {
            let [dz, dr] = minus(&pair[1], &pair[0]);
            unit(&[-dr, dz])
        };
        let normals = points.windows(2).map(normal).collect();
        let search = Search::new(points.windows(2).map(|pair| [pair[0], pair[1]]))?;
        Ok(Self { points, normals, search })
    }

    /// The place nearest to a point (z, r); `None` when the point is not finite.
    pub fn foot(&self, x: [f64; 2]) -> Option<Foot<2>> {
        let Nearest { facet: segment, point, place: share, .. } =
            self.search.nearest(&x, |segment| self.closest(segment, &x))?;
        let own = self.normals[segment];
        // Between two segments both normals count; the sum sees every point on its right side.
        let (outward, open) = match share {
            s if s <= 0.0 && segment == 0 => (own, true),
            s if s >= 1.0 && segment + 1 == self.normals.len() => (own, true),
            s if s <= 0.0 => (unit(&plus(&own, &self.normals[segment - 1])), false),
            s if s >= 1.0 => (unit(&plus(&own, &self.normals[segment + 1])), false),
            _ => (own, false),
        };
        Some(Foot::new(&x, point, outward, segment, open))
    }

    /// The place of one segment that is nearest to `x`, and its share of the way along the segment.
    fn closest(&self, segment: usize, x: &[f64; 2]) -> ([f64; 2], f64) {
        let (start, end) = (&self.points[segment], &self.points[segment + 1]);
        let along = minus(end, start);
        let share = (dot(&minus(x, start), &along) / dot(&along, &along)).clamp(0.0, 1.0);
        (plus(start, &times(&along, share)), share)
    }
}
