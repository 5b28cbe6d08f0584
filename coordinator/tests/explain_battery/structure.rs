//! What a system can tell apart: for every effect that can be missing the information about it, and which candidates look like it.
//!
//! This is how the lists of truths, equals and absorbed effects were made; it looks only to first order.

use nalgebra::{DMatrix, DVector};
use starlings_models::BuildSetup;

use crate::draw::{Noise, draw, noisy, random, sd, with_effect};
use crate::information::{Refit, refit, training};
use crate::world::World;

/// Noise of the report.
const LEVEL: f64 = 0.03;

/// One line per effect and seed: λ, the change in the outputs, and the candidates most like the gap that it leaves.
pub fn lines(world: &World<'_>, effect: &str, seeds: std::ops::Range<u64>) -> Vec<String> {
    seeds.map(|seed| line(world, effect, seed)).collect()
}

fn line(world: &World<'_>, effect: &str, seed: u64) -> String {
    let name = format!("{:12} {effect:32} {seed}", world.system.name);
    let Some(draw) = draw(world, Some(effect), seed) else {
        return format!("{name} cannot reach the strength");
    };
    let (_, noise) = noisy(&draw, LEVEL, 0.0, &mut random(&["structure"], seed));
    let Some(fit) = refit(world, &draw, &noise) else { return format!("{name} cannot be refitted") };
    let values = draw.effect.as_ref().map_or(Vec::new(), |(_, values)| values.clone());
    let mut alike: Vec<(f64, f64, String)> = world
        .effects
        .iter()
        .filter_map(|def| {
            let (share, identifiable) = likeness(world, &fit, &noise, &def.name)?;
            Some((share, identifiable, def.name.clone()))
        })
        .collect();
    alike.sort_by(|a, b| b.0.total_cmp(&a.0));
    let first: Vec<String> =
        alike.iter().take(6).map(|(share, own, name)| format!("{name} {share:.4} ({own:.3})")).collect();
    format!("{name} λ {:9.1} values {values:.3?} | {}", fit.misfit, first.join(", "))
}

/// The share of the misfit that the candidate explains to first order, with the best of its inner values, and the part of its
/// influence that the parameters cannot imitate.
fn likeness(world: &World<'_>, fit: &Refit, noise: &Noise, name: &str) -> Option<(f64, f64)> {
    let def = world.resolved(name, &fit.theta);
    let setup = with_effect(&world.model, &def);
    let forward = setup.build().ok()?;
    let grids: Vec<Vec<f64>> = def
        .parameters
        .iter()
        .skip(1)
        .map(|p| if p.grid.is_empty() { vec![0.5 * (p.range[0] + p.range[1])] } else { p.grid.clone() })
        .collect();
    let points = grids.iter().fold(vec![Vec::new()], |points: Vec<Vec<f64>>, grid| {
        points.iter().flat_map(|p| grid.iter().map(move |v| [p.as_slice(), &[*v]].concat())).collect()
    });
    let run = |amplitude: f64, inner: &[f64]| {
        let theta: Vec<f64> = fit.theta.iter().chain([&amplitude]).chain(inner).copied().collect();
        world.run(forward.as_ref(), &theta)
    };
    let mut best: Option<(f64, f64)> = None;
    for inner in points {
        let Some(base) = run(0.0, &inner) else { continue };
        let Some(s) = sensitivity(world, &base, noise, |a| run(a, &inner)) else { continue };
        let perpendicular = &s - project(&fit.jacobian, &s);
        let norm = perpendicular.norm();
        let share = (perpendicular.dot(&fit.residual) / (norm * fit.residual.norm())).powi(2);
        if best.is_none_or(|(other, _)| share > other) {
            best = Some((share, norm / s.norm()));
        }
    }
    best
}

/// The influence of a small amplitude on the training rows.
fn sensitivity(
    world: &World<'_>,
    base: &[Vec<f64>],
    noise: &Noise,
    run: impl Fn(f64) -> Option<Vec<Vec<f64>>>,
) -> Option<DVector<f64>> {
    let mut amplitude = 1e-3;
    for _ in 0..12 {
        let s = training(world, &run(amplitude)?, base, noise);
        let size = s.norm() / (s.len() as f64).sqrt() / (sd(&base[0]) / noise.sd[0]);
        if (1e-4..1e-2).contains(&size) {
            return Some(s);
        }
        amplitude *= if size > 0.0 { 1e-3 / size } else { 100.0 };
    }
    None
}

/// J (JᵀJ + I)⁻¹ Jᵀ s: what the parameters, held by their priors, can imitate.
fn project(j: &DMatrix<f64>, s: &DVector<f64>) -> DVector<f64> {
    let normal = j.tr_mul(j) + DMatrix::identity(j.ncols(), j.ncols());
    normal.cholesky().map_or_else(|| DVector::zeros(s.len()), |root| j * root.solve(&j.tr_mul(s)))
}
