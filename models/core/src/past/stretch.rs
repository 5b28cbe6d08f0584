//! Advancing a model that reads its own past, by the method of steps (Bellman 1961): a stretch at a time, short enough that
//! what it reads is already recorded.
//!
//! A stretch ends at the next knot of any memory. Where a delay is shorter than that, the stretch reads itself: it is run
//! repeatedly until what it reads is what it records. Next file to read: [`crate::memory`].

use super::Past;
use super::track::{Piece, Track};
use crate::segment::{Drive, Segment};
use crate::{Model, ModelFailure};

/// Most runs of one stretch that reads itself, before it is halved.
const MAX_ROUNDS: u32 = 25;
/// What a stretch reads of itself agrees with what it records to this part of its size.
const AGREED: f64 = 1e-9;
/// Most halvings of a stretch.
const MAX_HALVINGS: i32 = 20;

/// What moves during a segment of the inputs.
struct Motion<'a> {
    model: &'a dyn Model,
    segment: Segment<'a>,
    theta: &'a [f64],
}

impl Motion<'_> {
    fn inputs(&self, t: f64) -> Vec<f64> {
        let past = t - self.segment.t0;
        self.segment.u0.iter().zip(self.segment.slope).map(|(u, slope)| u + slope * past).collect()
    }

    /// Value and slope of each memory at `(t, x)`, the slope by a difference of length `step` along the motion.
    fn memories(&self, past: &Past<'_>, t: f64, x: &[f64], step: f64) -> Vec<[f64; 2]> {
        let near = t + step;
        // As it is after rounding.
        let step = near - t;
        let (u, u_near) = (self.inputs(t), self.inputs(near));
        let drive = Drive { value: &u, slope: self.segment.slope, history: past };
        let mut rate = vec![0.0; x.len()];
        self.model.rhs(t, x, self.theta, drive, &mut rate);
        let x_near: Vec<f64> = x.iter().zip(&rate).map(|(x, rate)| x + step * rate).collect();
        let mut y = vec![0.0; past.tracks.len()];
        let mut y_near = y.clone();
        self.model.remembered(t, x, self.theta, drive, &mut y);
        self.model.remembered(near, &x_near, self.theta, Drive { value: &u_near, ..drive }, &mut y_near);
        y.iter().zip(&y_near).map(|(y, near)| [*y, (near - y) / step]).collect()
    }
}

impl Past<'_> {
    /// Advances `x` over a segment of the inputs and records what the model remembers.
    ///
    /// # Errors
    /// When the integrator fails, or a stretch that reads itself does not settle however short it is.
    pub(crate) fn advance(
        &mut self,
        model: &dyn Model,
        segment: Segment<'_>,
        theta: &[f64],
        x: &mut [f64],
    ) -> Result<(), ModelFailure> {
        let motion = Motion { model, segment, theta };
        let spacing = self.tracks.iter().map(|track| track.memory.spacing()).fold(f64::INFINITY, f64::min);
        segment.limits.foresee(spacing, segment.t0)?;
        let mut t = segment.t0;
        while t < segment.t1 {
            segment.limits.take(1, t)?;
            let knot = self.tracks.iter().map(|track| track.memory.next_knot(t)).fold(segment.t1, f64::min);
            let shortest = (knot - t) * 0.5_f64.powi(MAX_HALVINGS);
            let mut end = knot;
            while !self.stretch(&motion, [t, end], x)? {
                end = t + 0.5 * (end - t);
                if end - t < shortest {
                    return Err(ModelFailure::StepTooSmall { time: t, step: end - t });
                }
            }
            t = end;
        }
        Ok(())
    }

    /// Advances `x` over one stretch and records it, or leaves both as they were; says whether it did.
    fn stretch(&mut self, motion: &Motion<'_>, span: [f64; 2], x: &mut [f64]) -> Result<bool, ModelFailure> {
        let start = x.to_vec();
        self.ahead.set(false);
        let mut pieces = self.attempt(motion, span, x)?;
        self.record(&pieces);
        if !self.ahead.get() {
            return Ok(true);
        }
        for _ in 0..MAX_ROUNDS {
            x.copy_from_slice(&start);
            let again = self.attempt(motion, span, x)?;
            let settled = alike(&pieces, &again);
            self.tracks.iter_mut().for_each(Track::pop);
            self.record(&again);
            if settled {
                return Ok(true);
            }
            pieces = again;
        }
        self.tracks.iter_mut().for_each(Track::pop);
        x.copy_from_slice(&start);
        Ok(false)
    }

    fn record(&mut self, pieces: &[Piece]) {
        for (track, piece) in self.tracks.iter_mut().zip(pieces) {
            track.push(*piece);
        }
    }

    /// Advances `x` over one stretch by what is recorded so far; returns what there is to record.
    fn attempt(
        &self,
        motion: &Motion<'_>,
        [t0, t1]: [f64; 2],
        x: &mut [f64],
    ) -> Result<Vec<Piece>, ModelFailure> {
        let step = self.difference_step(t1);
        let before = motion.memories(self, t0, x, step);
        let u0 = motion.inputs(t0);
        let stretch = Segment { t0, t1, u0: &u0, history: self, ..motion.segment };
        motion.model.advance(stretch, motion.theta, x)?;
        let after = motion.memories(self, t1, x, -step);
        let ends = before.into_iter().zip(after);
        let pieces: Vec<Piece> =
            ends.map(|(a, b)| Piece { span: [t0, t1], value: [a[0], b[0]], slope: [a[1], b[1]] }).collect();
        match pieces.iter().position(|piece| !piece.scale().is_finite()) {
            Some(i) => {
                let what = format!("the delayed `{}`", self.tracks[i].memory.of);
                Err(ModelFailure::NotFinite { what, time: t1 })
            }
            None => Ok(pieces),
        }
    }

    /// A step for differences in time: far below the knots' spacing, far above rounding.
    fn difference_step(&self, t: f64) -> f64 {
        let spacing = self.tracks.iter().map(|track| track.memory.spacing()).fold(f64::INFINITY, f64::min);
        (1e-6 * spacing).max(64.0 * f64::EPSILON * t.abs())
    }
}

/// Whether two versions of a stretch say the same.
fn alike(a: &[Piece], b: &[Piece]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.distance(b) <= AGREED * b.scale().max(f64::MIN_POSITIVE))
}
