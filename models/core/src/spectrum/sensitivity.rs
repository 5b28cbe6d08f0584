//! How fast a pole moves when an observer is switched on: ∂λ/∂γ at γ = 0.
//!
//! Analytic: −yᴴ Γ₁ x / yᴴ x with the left and right eigenvectors of A (Moireau, Chapelle & Le Tallec 2008, §3). Numerical:
//! differences of the pole itself. Their agreement is a check of both. Next file to read: [`super::gain`].

use std::collections::BTreeMap;

use nalgebra::Complex;

use super::SpectrumError;
use super::observed::{Block, ObservedSystem};
use super::vector::{Pair, Reduced};

/// ∂λ/∂γ of one pole without observer, dimensionless.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    /// From the eigenvectors; `None` where the pole is multiple and has no derivative.
    pub analytic: Option<Complex<f64>>,
    /// From differences of the pole; `None` where another pole stands too close to tell them apart.
    pub numerical: Option<Complex<f64>>,
}

/// yᴴ x of unit vectors below which a pole is taken as defective: rounding makes no eigenvector pair more orthogonal.
const DEFECTIVE: f64 = 1e-7;

/// Part of the way to the next pole by which a pole may move in a difference.
const NEAR: f64 = 0.01;

/// The slopes of the given poles, which are poles of the system at gain zero.
///
/// # Errors
/// As [`super::poles`].
pub fn slopes(system: &ObservedSystem, listed: &[Complex<f64>]) -> Result<Vec<Slope>, SpectrumError> {
    let zero = Some(Complex::new(0.0, 0.0));
    let mut found = vec![Slope { analytic: zero, numerical: zero }; listed.len()];
    // Pole by pole the nearest of all blocks; the blocks' poles are used up so that equal ones are not taken twice.
    let mut blocks = Vec::with_capacity(system.blocks.len());
    for block in &system.blocks {
        blocks.push(block.poles(0.0)?);
    }
    let mut members: Vec<Vec<(usize, usize)>> = vec![Vec::new(); blocks.len()];
    let mut taken: Vec<Vec<bool>> = blocks.iter().map(|poles| vec![false; poles.len()]).collect();
    let mut untouched = vec![false; system.untouched.len()];
    for (i, &pole) in listed.iter().enumerate() {
        let mut best = nearest_free(&system.untouched, &untouched, pole).map(|(j, d)| (None, j, d));
        for (b, poles) in blocks.iter().enumerate() {
            if let Some((j, d)) = nearest_free(poles, &taken[b], pole)
                && best.is_none_or(|(_, _, least)| d < least)
            {
                best = Some((Some(b), j, d));
            }
        }
        match best {
            Some((Some(b), j, _)) => {
                taken[b][j] = true;
                members[b].push((i, j));
            }
            Some((None, j, _)) => untouched[j] = true,
            None => {}
        }
    }
    for ((block, poles), members) in system.blocks.iter().zip(&blocks).zip(members) {
        if members.is_empty() {
            continue;
        }
        let reduced = Reduced::new(&block.a);
        let mut differences = Differences { block, cache: BTreeMap::new() };
        for (i, j) in members {
            found[i] = Slope {
                analytic: analytic(block, &reduced.vectors(poles[j])),
                numerical: differences.slope(poles, j)?,
            };
        }
    }
    Ok(found)
}

fn nearest_free(poles: &[Complex<f64>], taken: &[bool], pole: Complex<f64>) -> Option<(usize, f64)> {
    let free = poles.iter().enumerate().filter(|(j, _)| !taken[*j]);
    free.map(|(j, p)| (j, (p - pole).norm())).min_by(|p, q| p.1.total_cmp(&q.1))
}

/// −yᴴ Γ₁ x / yᴴ x.
fn analytic(block: &Block, pair: &Pair) -> Option<Complex<f64>> {
    let gamma = block.feedback.linear.map(|v| Complex::new(v, 0.0));
    let scale = pair.left.dotc(&pair.right);
    (scale.norm() > DEFECTIVE).then(|| -pair.left.dotc(&(gamma * &pair.right)) / scale)
}

/// Poles of a block at small gains of both signs, kept per step.
struct Differences<'a> {
    block: &'a Block,
    cache: BTreeMap<i32, [Vec<Complex<f64>>; 4]>,
}

impl Differences<'_> {
    /// The five-point difference of pole `j`, accurate to the fourth power of the step.
    fn slope(&mut self, poles: &[Complex<f64>], j: usize) -> Result<Option<Complex<f64>>, SpectrumError> {
        let pole = poles[j];
        let others = poles.iter().enumerate().filter(|(k, _)| *k != j);
        let apart = others.map(|(_, p)| (p - pole).norm()).fold(f64::INFINITY, f64::min);
        // The pole must move by far more than its rounding and by far less than the way to the next one.
        let own = if pole.norm() > 0.0 { 5e-3 * pole.norm() } else { f64::INFINITY };
        let step = own.min(NEAR * apart) / self.block.feedback.linear.amax();
        let rounding = 1e3 * f64::EPSILON * self.block.a.amax();
        if !step.is_finite() || NEAR * apart <= rounding {
            return Ok(None);
        }
        let exponent = step.log2().floor() as i32;
        let step = f64::from(exponent).exp2();
        if !self.cache.contains_key(&exponent) {
            let at = |gain: f64| self.block.poles(gain);
            let moved = [at(step)?, at(-step)?, at(2.0 * step)?, at(-2.0 * step)?];
            self.cache.insert(exponent, moved);
        }
        let near = |poles: &Vec<Complex<f64>>| {
            poles.iter().copied().min_by(|p, q| (p - pole).norm().total_cmp(&(q - pole).norm()))
        };
        let [up, down, up2, down2] = self.cache[&exponent].each_ref().map(near);
        let (Some(up), Some(down), Some(up2), Some(down2)) = (up, down, up2, down2) else { return Ok(None) };
        Ok(Some(((up - down) * 8.0 - (up2 - down2)) / (12.0 * step)))
    }
}
