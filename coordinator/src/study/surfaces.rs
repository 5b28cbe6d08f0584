//! Walls that were measured as registered surfaces: what a predicted displacement is compared with.
//!
//! A channel of this kind has a node of the model's wall and one surface per time. Its observed value is zero, its predicted
//! one the signed distance of the displaced node to the surface of the time, positive outside (Moireau et al. 2013). Models,
//! workers and estimators know displacements and numbers only: predictions are turned into distances where they come back
//! from the fleet, by [`Study::measure`], and a job carries no observed value of such a channel, by [`Study::sendable`]. How
//! surfaces are read is in [`crate::study::record`].

use std::sync::Arc;

use starlings_models::Window;
use starlings_models::surface::{Mesh, Profile};

use super::Study;
use super::checked::{Channel, Record};

/// The surface of one time.
#[derive(Clone, Debug)]
pub enum Shape {
    /// The wall of an axisymmetric vessel, points (z, r).
    Profile(Profile),
    /// Triangles, points (x, y, z).
    Mesh(Mesh),
}

impl Shape {
    /// Signed distance of a point, positive outside, and how far it lies past an open end. The third coordinate of a profile is
    /// not looked at.
    fn distance(&self, [a, b, c]: [f64; 3]) -> Option<[f64; 2]> {
        match self {
            Self::Profile(profile) => profile.foot([a, b]).map(|foot| [foot.distance, foot.past_end]),
            Self::Mesh(mesh) => mesh.foot([a, b, c]).map(|foot| [foot.distance, foot.past_end]),
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
    /// Every coordinate that they were read from, by which a change of the files is seen.
    pub numbers: Vec<f64>,
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
    pub fn is_shown(&self, time: f64) -> bool {
        let past_end = self.seen.at(time).and_then(|shape| shape.distance(self.rest)).map(|[_, past]| past);
        past_end.is_some_and(|past| past <= 0.0)
    }

    /// Signed distance of the node, displaced, to the surface of this time; `None` without one.
    pub fn distance(&self, time: f64, displacement: f64) -> Option<f64> {
        let displaced = std::array::from_fn(|i| displacement.mul_add(self.normal[i], self.rest[i]));
        self.seen.at(time)?.distance(displaced).map(|[distance, _]| distance)
    }
}

impl Record {
    /// The channels that were measured as surfaces.
    fn surfaces(&self) -> impl Iterator<Item = (&Channel, &Node)> {
        self.channels.iter().filter_map(|channel| Some((channel, channel.node.as_ref()?)))
    }
}

impl Study {
    /// Turns the outputs that a model predicted at these times of a record into what its channels measure, in place.
    pub fn measure(&self, record: usize, times: &[f64], outputs: &mut [f64]) {
        let n_obs = self.setup.outputs.len();
        for (channel, node) in self.records[record].surfaces() {
            for (values, &time) in outputs.chunks_mut(n_obs.max(1)).zip(times) {
                // A value that is none must stay none.
                if let Some(distance) = node.distance(time, values[channel.row]) {
                    values[channel.row] = distance;
                }
            }
        }
    }

    /// The window as a job carries it: a distance is no displacement that an observer could correct by.
    pub fn sendable(&self, record: usize, window: &Arc<Window>) -> Arc<Window> {
        let rows: Vec<usize> = self.records[record].surfaces().map(|(channel, _)| channel.row).collect();
        if rows.is_empty() {
            return Arc::clone(window);
        }
        let mut sent = Window::clone(window);
        for values in sent.observed.chunks_mut(self.setup.outputs.len().max(1)) {
            rows.iter().for_each(|row| values[*row] = f64::NAN);
        }
        Arc::new(sent)
    }
}
