//! The nearest facet of many, by a k-d tree of their centres.
//!
//! The nearest centre is not always of the nearest facet, so facets are tried in the order of their centres until no other
//! can reach the best one. Next file to read: [`super::profile`].

use kdtree::KdTree;
use kdtree::distance::squared_euclidean;

use super::vector::{mean, minus, norm};
use crate::SetupError;

/// The centres of all facets.
#[derive(Clone, Debug)]
pub(super) struct Search<const D: usize> {
    centres: KdTree<f64, usize, [f64; D]>,
    /// Largest distance of a facet's corner from its centre.
    reach: f64,
}

/// The nearest place of all facets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest<const D: usize, T> {
    distance: f64,
    pub(super) facet: usize,
    pub(super) point: [f64; D],
    /// Where on the facet.
    pub(super) place: T,
}

impl<const D: usize> Search<D> {
    /// Centres of facets, each given by its corners.
    ///
    /// # Errors
    /// When a corner is not finite.
    pub(super) fn new(facets: impl Iterator<Item = [[f64; D]; D]>) -> Result<Self, SetupError> {
        let mut centres = KdTree::new(D);
        let mut reach = 0.0_f64;
        for (facet, corners) in facets.enumerate() {
            let centre = mean(&corners);
            reach = corners.iter().map(|corner| norm(&minus(corner, &centre))).fold(reach, f64::max);
            centres.add(centre, facet).map_err(|_| {
                SetupError::Invalid(format!("facet {facet} of the surface has a corner that is not finite"))
            })?;
        }
        Ok(Self { centres, reach })
    }

    /// The facet that comes nearest to `x`, where `closest` finds a facet's nearest point and its place; `None` when `x` is
    /// not finite.
    pub(super) fn nearest<T: Copy>(
        &self,
        x: &[f64; D],
        closest: impl Fn(usize) -> ([f64; D], T),
    ) -> Option<Nearest<D, T>> {
        let mut best: Option<Nearest<D, T>> = None;
        for (square, &facet) in self.centres.iter_nearest(x, &squared_euclidean).ok()? {
            if best.is_some_and(|best| square.sqrt() - self.reach > best.distance) {
                break;
            }
            let (point, place) = closest(facet);
            let distance = norm(&minus(x, &point));
            if best.is_none_or(|best| distance < best.distance) {
                best = Some(Nearest { distance, facet, point, place });
            }
        }
        best
    }
}
