//! The past of one quantity as a chain of cubics.
//!
//! Next file to read: [`super::stretch`].

use std::collections::VecDeque;

use crate::memory::{Memory, SAMPLES};

/// A cubic between two times, by its values and slopes there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) span: [f64; 2],
    pub(super) value: [f64; 2],
    pub(super) slope: [f64; 2],
}

impl Piece {
    /// Hermite's form; exact at both ends.
    fn at(&self, t: f64) -> f64 {
        let h = self.span[1] - self.span[0];
        let s = (t - self.span[0]) / h;
        let r = 1.0 - s;
        let values = r * r * (1.0 + 2.0 * s) * self.value[0] + s * s * (1.0 + 2.0 * r) * self.value[1];
        values + h * s * r * (r * self.slope[0] - s * self.slope[1])
    }

    /// Size of what the piece says, for tolerances.
    pub(super) fn scale(&self) -> f64 {
        let h = self.span[1] - self.span[0];
        self.value.iter().map(|v| v.abs()).sum::<f64>() + h * self.slope.iter().map(|d| d.abs()).sum::<f64>()
    }

    /// Largest change of what the piece says if it were `other`.
    pub(super) fn distance(&self, other: &Self) -> f64 {
        let h = self.span[1] - self.span[0];
        let values = self.value.iter().zip(&other.value).map(|(a, b)| (a - b).abs());
        let slopes = self.slope.iter().zip(&other.slope).map(|(a, b)| h * (a - b).abs());
        values.chain(slopes).sum()
    }
}

/// The chain, without gaps, the earliest piece first; never empty.
pub(super) struct Track {
    pub(super) memory: Memory,
    pieces: VecDeque<Piece>,
}

impl Track {
    /// A constant up to time `t`.
    pub(super) fn constant(memory: &Memory, t: f64, value: f64) -> Self {
        let from = t - SAMPLES as f64 * memory.spacing();
        let piece = Piece { span: [from, t], value: [value; 2], slope: [0.0; 2] };
        Self { memory: memory.clone(), pieces: VecDeque::from([piece]) }
    }

    /// The chain through the samples of a state at time `t`.
    pub(super) fn resumed(memory: &Memory, t: f64, samples: &[f64]) -> Self {
        let mut points: Vec<[f64; 2]> = memory.times(t).zip(samples).map(|(t, value)| [t, *value]).collect();
        points.reverse();
        let pieces = (1..points.len()).map(|i| between(&points, i)).collect();
        Self { memory: memory.clone(), pieces }
    }

    /// The samples of a state at time `t`.
    pub(super) fn samples(&self, t: f64) -> impl Iterator<Item = f64> {
        self.memory.times(t).map(|time| self.at(time))
    }

    /// The value at a time: NaN before the chain begins, the last piece's tangent behind its end.
    pub(super) fn at(&self, t: f64) -> f64 {
        let i = self.pieces.partition_point(|piece| piece.span[1] < t);
        match (self.pieces.get(i), self.pieces.back()) {
            (Some(piece), _) if t >= piece.span[0] => piece.at(t),
            (None, Some(last)) => last.value[1] + last.slope[1] * (t - last.span[1]),
            _ => f64::NAN,
        }
    }

    /// Up to when values are recorded.
    pub(super) fn end(&self) -> f64 {
        self.pieces.back().map_or(f64::NEG_INFINITY, |piece| piece.span[1])
    }

    /// Extends the chain, and forgets what no delay reaches any more.
    pub(super) fn push(&mut self, piece: Piece) {
        let reach = piece.span[1] - SAMPLES as f64 * self.memory.spacing();
        while self.pieces.len() > 1 && self.pieces[0].span[1] < reach {
            self.pieces.pop_front();
        }
        self.pieces.push_back(piece);
    }

    /// Takes the last piece back.
    pub(super) fn pop(&mut self) {
        self.pieces.pop_back();
    }
}

/// The cubic between points i − 1 and i through the four neighbours on which the data are smoothest, so that a kink at a
/// knot does not spread (Harten, Engquist, Osher & Chakravarthy 1987, who choose them one by one).
fn between(points: &[[f64; 2]], i: usize) -> Piece {
    let roughness = |first: &usize| {
        // On smooth data the stencil with the interval in its middle is the most exact.
        let weight = if first + 2 == i { 0.5 } else { 1.0 };
        weight * divided(&points[*first..first + 4]).abs()
    };
    let firsts = i.saturating_sub(3)..=(i - 1).min(points.len() - 4);
    let first = firsts.min_by(|a, b| roughness(a).total_cmp(&roughness(b))).unwrap_or_default();
    let [a, b] = [points[i - 1], points[i]];
    let slope = |t: f64| slope(&points[first..first + 4], t);
    Piece { span: [a[0], b[0]], value: [a[1], b[1]], slope: [slope(a[0]), slope(b[0])] }
}

/// Newton's divided difference over all of the points.
fn divided(points: &[[f64; 2]]) -> f64 {
    match points {
        [] => 0.0,
        [point] => point[1],
        [first, .., last] => {
            let n = points.len();
            (divided(&points[1..]) - divided(&points[..n - 1])) / (last[0] - first[0])
        }
    }
}

/// The derivative at `t` of the polynomial through the points, by Newton's form.
fn slope(points: &[[f64; 2]], t: f64) -> f64 {
    let (mut value, mut product, mut product_slope) = (0.0, 1.0, 0.0);
    for n in 1..=points.len() {
        value += divided(&points[..n]) * product_slope;
        product_slope = product_slope * (t - points[n - 1][0]) + product;
        product *= t - points[n - 1][0];
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory() -> Memory {
        Memory { of: "y".to_owned(), longest: 1.24 }
    }

    #[test]
    fn a_cubic_is_resumed_as_it_was() {
        let cubic = |t: f64| 1.0 - t + 2.0 * t * t - 0.5 * t * t * t;
        let now = 0.7213;
        let samples: Vec<f64> = memory().times(now).map(cubic).collect();
        let track = Track::resumed(&memory(), now, &samples);
        for t in [now, 0.72, 0.5003, 0.0, -0.5, now - 1.24] {
            // Rounding of divided differences, whose denominators are 1e-6.
            assert!((track.at(t) - cubic(t)).abs() < 1e-12, "{t}: {:e}", track.at(t) - cubic(t));
        }
        assert!(track.at(now - 2.0).is_nan(), "beyond the longest delay");
    }

    #[test]
    fn samples_come_back_to_the_last_bit() {
        let now = 12.345;
        let samples: Vec<f64> = memory().times(now).map(|t| (3.0 * t).sin()).collect();
        let back: Vec<f64> = Track::resumed(&memory(), now, &samples).samples(now).collect();
        assert!(samples.iter().zip(&back).all(|(a, b)| a.to_bits() == b.to_bits()));
    }

    #[test]
    fn a_kink_at_a_knot_does_not_spread() {
        let now = 0.5;
        for kinked in [|t: f64| t.max(0.0), |t: f64| 3.0 * t.max(0.0).powi(2) + t] {
            let samples: Vec<f64> = memory().times(now).map(kinked).collect();
            let track = Track::resumed(&memory(), now, &samples);
            for t in [-0.015, -0.005, 0.0, 0.003, 0.012] {
                // Rounding only.
                assert!((track.at(t) - kinked(t)).abs() < 1e-15, "{t}: {}", track.at(t));
            }
        }
    }
}
