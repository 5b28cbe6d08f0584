//! The past of a run as its model reads it: the inputs' record, and what the run itself has recorded so far.
//!
//! Each remembered quantity is a chain of cubics, one per stretch of the run; the state that a run starts from brings the
//! chain's beginning. Next file to read: `past/track.rs` for the chain, then `past/stretch.rs` for how a run extends it.

mod stretch;
mod track;

use std::cell::Cell;

use crate::memory::SAMPLES;
use crate::segment::{Drive, History};
use crate::{Model, Window};
use track::Track;

/// The past of the inputs, followed by that of the model's memories.
pub(crate) struct Past<'a> {
    window: &'a Window,
    tracks: Vec<Track>,
    /// Whether a value later than the last recorded one was asked for.
    ahead: Cell<bool>,
}

impl History for Past<'_> {
    fn at(&self, index: usize, t: f64) -> f64 {
        let n_input = self.window.inputs.len();
        if index < n_input {
            return self.window.at(index, t);
        }
        let track = &self.tracks[index - n_input];
        self.ahead.set(self.ahead.get() || t > track.end());
        track.at(t)
    }
}

impl<'a> Past<'a> {
    /// Splits the memories off a state at the window's start.
    pub(crate) fn resumed(model: &dyn Model, window: &'a Window, x: &mut Vec<f64>) -> Self {
        let memories = model.memories();
        let samples = x.split_off(x.len() - memories.len() * SAMPLES);
        let tracks = memories.iter().zip(samples.chunks_exact(SAMPLES));
        let tracks = tracks.map(|(memory, samples)| Track::resumed(memory, window.start, samples)).collect();
        Self { window, tracks, ahead: Cell::new(false) }
    }

    /// The past of a run that begins: everything was always as it is at the window's start.
    pub(crate) fn constant(
        model: &dyn Model,
        window: &'a Window,
        u: Drive<'_>,
        theta: &[f64],
        x: &[f64],
    ) -> Self {
        let memories = model.memories();
        let mut values = vec![0.0; memories.len()];
        let mut past = Self { window, tracks: Vec::new(), ahead: Cell::new(false) };
        // A remembered output may itself read another memory: after as many rounds as memories, all agree.
        for _ in 0..=memories.len() {
            let tracks = memories.iter().zip(&values);
            past.tracks =
                tracks.map(|(memory, value)| Track::constant(memory, window.start, *value)).collect();
            model.remembered(window.start, x, theta, Drive { history: &past, ..u }, &mut values);
        }
        past
    }

    /// Appends the memories at time `t` to a state.
    pub(crate) fn store(&self, t: f64, x: &mut Vec<f64>) {
        for track in &self.tracks {
            x.extend(track.samples(t));
        }
    }
}
