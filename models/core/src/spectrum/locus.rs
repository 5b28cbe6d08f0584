//! The way of each pole through the complex plane as the gain grows: the root locus (Evans 1950).
//!
//! Poles are matched from one gain to the next by the smallest ways. Where a way is not short beside the distance to another
//! pole, the step is halved; where two poles meet, which of the two goes on is a convention. Next file to read:
//! [`super::gain`].

use std::collections::BTreeMap;

use nalgebra::Complex;

use super::SpectrumError;
use super::observed::{Block, ObservedSystem};

/// Halvings of a step of the gain before the nearest poles are matched as they are.
const HALVINGS: usize = 5;
/// Part of the gain below which a step is not halved.
const SHORT: f64 = 0.03;
/// Poles beyond this multiple of the largest listed one may be exchanged: nobody sees them.
const FAR: f64 = 3.0;

/// Follows the poles of one system, and remembers them for the next time.
#[derive(Clone, Debug)]
pub struct Follower<'a> {
    system: &'a ObservedSystem,
    /// Per block, the poles by the bits of the gain, in no particular order.
    known: Vec<BTreeMap<u64, Vec<Complex<f64>>>>,
}

impl<'a> Follower<'a> {
    /// Of a system, nothing known yet.
    pub fn new(system: &'a ObservedSystem) -> Self {
        Self { system, known: vec![BTreeMap::new(); system.blocks.len()] }
    }

    /// The first `listed` poles at every gain: `[pole][gain]`, in the order of [`ObservedSystem::poles`] at the first gain.
    ///
    /// # Errors
    /// As [`super::poles`].
    pub fn follow(&mut self, gains: &[f64], listed: usize) -> Result<Vec<Vec<Complex<f64>>>, SpectrumError> {
        let Some(&first) = gains.first() else { return Ok(Vec::new()) };
        let start = self.system.poles(first)?;
        let Some(largest) = start[..listed.min(start.len())].last().map(|pole| pole.norm()) else {
            return Ok(Vec::new());
        };
        let mut ways: Vec<Vec<Complex<f64>>> =
            self.system.untouched.iter().map(|&pole| vec![pole; gains.len()]).collect();
        for (block, known) in self.system.blocks.iter().zip(&mut self.known) {
            let mut steps = Steps { block, known, far: FAR * largest };
            let mut at = steps.poles(first)?;
            // Rounding may differ from that of `start` in the last place only.
            if at.iter().all(|pole| pole.norm() > (1.0 + 1e-9) * largest) {
                continue;
            }
            let mut own: Vec<Vec<Complex<f64>>> = at.iter().map(|&pole| vec![pole]).collect();
            for pair in gains.windows(2) {
                at = steps.advance(&at, (pair[0], pair[1]), HALVINGS)?;
                for (way, &pole) in own.iter_mut().zip(&at) {
                    way.push(pole);
                }
            }
            ways.extend(own);
        }
        ways.sort_by(|p, q| p[0].norm().total_cmp(&q[0].norm()).then(p[0].im.total_cmp(&q[0].im)));
        ways.truncate(listed);
        Ok(ways)
    }
}

/// Steps of the gain in one block.
struct Steps<'a> {
    block: &'a Block,
    known: &'a mut BTreeMap<u64, Vec<Complex<f64>>>,
    /// Modulus beyond which poles may be exchanged.
    far: f64,
}

impl Steps<'_> {
    fn poles(&mut self, gain: f64) -> Result<Vec<Complex<f64>>, SpectrumError> {
        if let Some(poles) = self.known.get(&gain.to_bits()) {
            return Ok(poles.clone());
        }
        let poles = self.block.poles(gain)?;
        self.known.insert(gain.to_bits(), poles.clone());
        Ok(poles)
    }

    /// The poles at the gain `to`, each in the place of the pole at `from` that it was.
    fn advance(
        &mut self,
        at: &[Complex<f64>],
        (from, to): (f64, f64),
        halvings: usize,
    ) -> Result<Vec<Complex<f64>>, SpectrumError> {
        let (moved, clear) = matched(at, &self.poles(to)?, self.far);
        if clear || halvings == 0 || to - from < SHORT * to {
            return Ok(moved);
        }
        let middle = 0.5 * (from + to);
        let half = self.advance(at, (from, middle), halvings - 1)?;
        self.advance(&half, (middle, to), halvings - 1)
    }
}

/// The new poles in the order of the old ones, shortest ways first, and whether no other match of a pole that is not `far`
/// comes near.
fn matched(old: &[Complex<f64>], new: &[Complex<f64>], far: f64) -> (Vec<Complex<f64>>, bool) {
    let n = old.len();
    let mut ways: Vec<(f64, usize, usize)> = Vec::with_capacity(n * n);
    for (i, p) in old.iter().enumerate() {
        ways.extend(new.iter().enumerate().map(|(j, q)| ((p - q).norm(), i, j)));
    }
    ways.sort_by(|p, q| p.0.total_cmp(&q.0));
    let (mut place, mut used, mut length) = (vec![None; n], vec![false; n], vec![0.0; n]);
    for &(way, i, j) in &ways {
        if place[i].is_none() && !used[j] {
            (place[i], used[j], length[i]) = (Some(j), true, way);
        }
    }
    let other = |&(way, i, j): &(f64, usize, usize)| {
        place[i] != Some(j) && way < 2.0 * length[i] && old[i].norm() < far
    };
    let clear = !ways.iter().any(other);
    (place.into_iter().zip(old).map(|(j, p)| j.map_or(*p, |j| new[j])).collect(), clear)
}
