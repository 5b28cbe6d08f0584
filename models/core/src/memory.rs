//! What a model remembers of itself: the past of a state or an output that its equations read through `delay`.
//!
//! A memory travels as part of the state, so that a run in windows equals one run. Its samples lie on knots at whole
//! multiples of a spacing, the same for every particle at the same time: a knot keeps its value to the last bit from window
//! to window, and a linear combination of states is one of pasts. What happens between two knots, such as a jump that an
//! observer makes, is remembered as the knots around it show it; a delay beyond the longest one reads NaN. Next file to read: `past.rs`, which fills it.

use crate::{Quantity, Spec};

/// Number of samples of one memory.
pub const SAMPLES: usize = 128;

/// Knots beyond the longest delay, so that its interpolation has neighbours.
const SPARE: usize = 3;

/// How far back a model reads one of its states or outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Memory {
    /// Name of the state or output.
    pub of: String,
    /// The longest delay, finite and above zero, in the study's time unit.
    pub longest: f64,
}

impl Memory {
    /// Distance between knots.
    pub fn spacing(&self) -> f64 {
        self.longest / (SAMPLES - 1 - SPARE) as f64
    }

    /// The memory as a state: [`SAMPLES`] values, the latest first. The first one is the value at the state's time, the
    /// others lie on the knots before it.
    fn quantity(&self, spec: &Spec) -> Quantity {
        let unit =
            spec.states.iter().chain(&spec.outputs).find(|q| q.name == self.of).map(|q| q.unit.as_str());
        let quantity = Quantity::new(&format!("delay:{}", self.of), unit.unwrap_or_default());
        Quantity {
            size: SAMPLES,
            ..quantity.says(&format!("The past of `{}`, the latest value first.", self.of))
        }
    }

    /// Times of the samples of a state at time `t`, the latest first.
    pub(crate) fn times(&self, t: f64) -> impl Iterator<Item = f64> {
        let spacing = self.spacing();
        let latest = (t / spacing - same_knot(t / spacing)).ceil() - 1.0;
        std::iter::once(t).chain((0..SAMPLES - 1).map(move |i| (latest - i as f64) * spacing))
    }

    /// The first knot after `t`.
    pub(crate) fn next_knot(&self, t: f64) -> f64 {
        let spacing = self.spacing();
        ((t / spacing + same_knot(t / spacing)).floor() + 1.0) * spacing
    }
}

/// Times closer to a knot than this part of the spacing are on it.
fn same_knot(position: f64) -> f64 {
    (4.0 * f64::EPSILON * position.abs()).max(1e-6)
}

/// Adds `longest` to what is remembered of a quantity and returns the memory's position.
pub(crate) fn note(list: &mut Vec<Memory>, of: &str, longest: f64) {
    match list.iter_mut().find(|memory| memory.of == of) {
        Some(memory) => memory.longest = memory.longest.max(longest),
        None => list.push(Memory { of: of.to_owned(), longest }),
    }
}

/// The specification with the memories behind the states.
pub fn with_memories(spec: &Spec, memories: &[Memory]) -> Spec {
    let mut with = spec.clone();
    with.states.extend(memories.iter().map(|memory| memory.quantity(spec)));
    with
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_samples_reach_back_beyond_the_longest_delay_at_any_time() {
        let memory = Memory { of: "y".to_owned(), longest: 0.37 };
        for t in [0.0, -5.3, 1e7 / 3.0, 0.37, 100.0 * memory.spacing()] {
            let times: Vec<f64> = memory.times(t).collect();
            assert_eq!(times.len(), SAMPLES);
            assert!(times.is_sorted_by(|a, b| a > b), "{t}");
            // Two knots beyond the delay, but for a knot that counts as now.
            assert!(times[SAMPLES - 1] <= t - memory.longest - 1.99 * memory.spacing(), "{t}");
            assert!(memory.next_knot(t) > t && memory.next_knot(t) <= t + 1.01 * memory.spacing(), "{t}");
        }
    }
}
