//! Predicted displacements turned into the distances to surfaces that were measured, and back for an observer.
//!
//! Predictions are turned into distances where they come back from the fleet, by [`Study::measure`], and a job carries for an
//! observer the displacement with which the node would be on the surface, by [`Study::sendable`]. Next file to read:
//! [`super::surfaces`] for nodes and surfaces.

use std::sync::Arc;

use starlings_models::Window;

use super::Study;
use super::checked::{Channel, Record};
use super::surfaces::Node;

impl Record {
    /// The channels that were measured as surfaces.
    pub(crate) fn surfaces(&self) -> impl Iterator<Item = (&Channel, &Node)> {
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

    /// The window as a job carries it, for an observer that knows displacements only: in the place of an observed distance, the
    /// displacement that has none.
    pub(crate) fn sendable(&self, record: usize, window: &Arc<Window>) -> Arc<Window> {
        if self.observer_is_off() || self.records[record].surfaces().next().is_none() {
            return Arc::clone(window);
        }
        let mut sent = Window::clone(window);
        let n_obs = self.setup.outputs.len();
        for (channel, node) in self.records[record].surfaces() {
            for (values, &time) in sent.observed.chunks_mut(n_obs.max(1)).zip(&window.times) {
                if values[channel.row].is_finite() {
                    values[channel.row] = node.crossing(time).unwrap_or(f64::NAN);
                }
            }
        }
        Arc::new(sent)
    }
}
