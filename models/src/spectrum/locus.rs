//! The way of each pole through the complex plane as the gain grows: the root locus (Evans 1950).
//!
//! Poles are matched from one gain to the next by the smallest ways. Where a way is not short beside the distance to another
//! pole, the step is halved; where two poles meet, which of the two goes on is a convention. Nothing after this: the command
//! and the page of the laboratory use what is here.

use nalgebra::Complex;

use super::SpectrumError;
use super::observed::{Block, ObservedSystem};

/// Halvings of a step of the gain before the nearest poles are matched as they are.
const HALVINGS: usize = 5;

/// The first `listed` poles at every gain: `[pole][gain]`, in the order of [`ObservedSystem::poles`] at the first gain.
///
/// # Errors
/// As [`super::poles`].
pub fn follow(
    system: &ObservedSystem,
    gains: &[f64],
    listed: usize,
) -> Result<Vec<Vec<Complex<f64>>>, SpectrumError> {
    let Some(&first) = gains.first() else { return Ok(Vec::new()) };
    let start = system.poles(first)?;
    let Some(largest) = start[..listed.min(start.len())].last().map(|pole| pole.norm()) else { return Ok(Vec::new()) };
    let mut ways: Vec<Vec<Complex<f64>>> =
        system.untouched.iter().map(|&pole| vec![pole; gains.len()]).collect();
    for block in &system.blocks {
        let mut at = block.poles(first)?;
        // Rounding may differ from that of `start` in the last place only.
        if at.iter().all(|pole| pole.norm() > (1.0 + 1e-9) * largest) {
            continue;
        }
        let mut own: Vec<Vec<Complex<f64>>> = at.iter().map(|&pole| vec![pole]).collect();
        for pair in gains.windows(2) {
            at = advance(block, &at, pair[0], pair[1], HALVINGS)?;
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

/// The poles at the gain `to`, each in the place of the pole at `from` that it was.
fn advance(
    block: &Block,
    at: &[Complex<f64>],
    from: f64,
    to: f64,
    halvings: usize,
) -> Result<Vec<Complex<f64>>, SpectrumError> {
    let (moved, clear) = matched(at, &block.poles(to)?);
    if clear || halvings == 0 {
        return Ok(moved);
    }
    let middle = 0.5 * (from + to);
    let half = advance(block, at, from, middle, halvings - 1)?;
    advance(block, &half, middle, to, halvings - 1)
}

/// The new poles in the order of the old ones, shortest ways first, and whether no other match comes near.
fn matched(old: &[Complex<f64>], new: &[Complex<f64>]) -> (Vec<Complex<f64>>, bool) {
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
    let other = |&(way, i, j): &(f64, usize, usize)| place[i] != Some(j) && way < 2.0 * length[i];
    let clear = !ways.iter().any(other);
    (place.into_iter().zip(old).map(|(j, p)| j.map_or(*p, |j| new[j])).collect(), clear)
}
