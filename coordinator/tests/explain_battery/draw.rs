//! One draw of the truth: parameters, an effect of the wanted strength, and the data that it leaves.
//!
//! Next file to read: [`crate::information`].

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_models::{BuildSetup, EffectDef, Setup};

use crate::world::World;

/// Change of the observed outputs by the effect, in standard deviations of theirs.
pub const STRENGTH: f64 = 0.15;
/// How exactly that is met.
pub const STRENGTH_WITHIN: f64 = 5e-4;
/// Draws of the parameters inside a term until the wanted strength can be reached.
const TRIES: usize = 12;

/// What is true in one data set.
pub struct Draw {
    /// The model's parameters in physical units.
    pub theta: Vec<f64>,
    /// The effect and its parameters.
    pub effect: Option<(EffectDef, Vec<f64>)>,
    /// The one beside it.
    pub second: Option<(EffectDef, Vec<f64>)>,
    /// Outputs without noise, one column per channel.
    pub clean: Vec<Vec<f64>>,
    /// What the effect changed, in standard deviations of the outputs.
    pub change: f64,
}

/// The random numbers of one data set: seeds that differ in anything are independent.
pub fn random(parts: &[&str], seed: u64) -> ChaCha8Rng {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for byte in parts.join("\n").bytes().chain(seed.to_le_bytes()) {
        hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
    }
    ChaCha8Rng::seed_from_u64(hash)
}

/// Draws the parameters and, when one is named, an effect; `None` when the effect cannot reach the strength.
pub fn draw(world: &World<'_>, effect: Option<&str>, seed: u64) -> Option<Draw> {
    let mut rng = random(&[world.system.name, effect.unwrap_or("null")], seed);
    let (theta, base) = plain(world, &mut rng)?;
    let Some(name) = effect else {
        return Some(Draw { theta, effect: None, second: None, clean: base, change: 0.0 });
    };
    let effect = strong(world, name, (&theta, &base), &mut rng)?;
    let clean = together(world, &theta, &[&effect])?;
    let change = change_of(&base, &clean);
    Some(Draw { theta, effect: Some(effect), second: None, clean, change })
}

/// The same with two effects, each of the wanted strength by itself.
pub fn draw_pair(world: &World<'_>, names: [&str; 2], seed: u64) -> Option<Draw> {
    let mut rng = random(&[world.system.name, names[0], names[1]], seed);
    let (theta, base) = plain(world, &mut rng)?;
    let [first, second] = names.map(|name| strong(world, name, (&theta, &base), &mut rng));
    let (first, second) = (first?, second?);
    let clean = together(world, &theta, &[&first, &second])?;
    let change = change_of(&base, &clean);
    Some(Draw { theta, effect: Some(first), second: Some(second), clean, change })
}

/// Parameters that the finer model can be run with, nearly always the first ones, and what it gives without any effect.
fn plain(world: &World<'_>, rng: &mut ChaCha8Rng) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
    let plain = world.truth.build().unwrap();
    (0..TRIES).find_map(|_| {
        let theta = parameters(world, rng);
        world.run(plain.as_ref(), &theta).map(|base| (theta, base))
    })
}

/// An effect with values of its parameters at which it has the wanted strength.
fn strong(
    world: &World<'_>,
    name: &str,
    (theta, base): (&[f64], &[Vec<f64>]),
    rng: &mut ChaCha8Rng,
) -> Option<(EffectDef, Vec<f64>)> {
    let def = world.resolved(name, theta);
    let setup = with_effect(&world.truth, &def);
    let forward = setup.build().unwrap_or_else(|error| panic!("{} {name}: {error}", world.system.name));
    (0..TRIES).find_map(|_| {
        let inner = inner_values(&def, rng);
        let change = |amplitude: f64| {
            let own = theta.iter().copied().chain([amplitude]);
            let values: Vec<f64> = own.chain(inner.iter().copied()).collect();
            world.run(forward.as_ref(), &values).map(|with| change_of(base, &with))
        };
        let side = side(def.parameters[0].range, rng);
        let amplitude = amplitude(change, side)?;
        Some((def.clone(), std::iter::once(amplitude).chain(inner.iter().copied()).collect()))
    })
}

/// What the truth gives with these effects.
fn together(world: &World<'_>, theta: &[f64], effects: &[&(EffectDef, Vec<f64>)]) -> Option<Vec<Vec<f64>>> {
    let (mut setup, mut values) = (world.truth.clone(), theta.to_vec());
    for (def, own) in effects {
        setup = with_effect(&setup, def);
        values.extend(own);
    }
    world.run(setup.build().ok()?.as_ref(), &values)
}

/// The setup with an effect and its parameters behind the model's own.
pub fn with_effect(setup: &Setup, def: &EffectDef) -> Setup {
    let mut setup = setup.clone();
    setup.effects.push(def.clone());
    setup.parameters.extend(def.parameters.iter().map(|p| p.name.clone()));
    setup
}

/// Parameters at half the prior's standard deviation.
fn parameters(world: &World<'_>, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let value = |p: &starlings_coordinator::study::checked::StudyParameter| {
        let z: f64 = StandardNormal.sample(rng);
        p.transform.to_physical(p.prior_mean[0] + 0.5 * p.prior_sd * z)
    };
    world.study.parameters.iter().map(value).collect()
}

/// Values of the parameters inside the terms: within the span of their grids, off its points.
fn inner_values(def: &EffectDef, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let value = |p: &starlings_models::effect::EffectParameter| {
        let grid = if p.grid.is_empty() { &p.range[..] } else { &p.grid[..] };
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut lo, mut hi) = grid.iter().fold(ends, |(lo, hi), v| (lo.min(*v), hi.max(*v)));
        if grid.len() == 1 {
            (lo, hi) = ((lo / 1.6).max(p.range[0]), (hi * 1.6).min(p.range[1]));
        }
        assert!(lo.is_finite() && hi > lo, "`{}` of {} has no finite grid", p.name, def.name);
        loop {
            let value = rng.random_range(lo..hi);
            if grid.iter().all(|point| (value - point).abs() > 0.05 * (hi - lo)) {
                return value;
            }
        }
    };
    def.parameters.iter().skip(1).map(value).collect()
}

/// The sign of the amplitude and its largest size.
fn side(range: [f64; 2], rng: &mut ChaCha8Rng) -> (f64, f64) {
    let up = if range[1] <= 0.0 {
        false
    } else if range[0] >= 0.0 {
        true
    } else {
        rng.random_range(0.0..1.0) < 0.5
    };
    if up { (1.0, range[1]) } else { (-1.0, -range[0]) }
}

/// Root mean square difference, each channel in standard deviations of its course without the effect.
pub fn change_of(base: &[Vec<f64>], with: &[Vec<f64>]) -> f64 {
    let mean_square = |(a, b): (&Vec<f64>, &Vec<f64>)| {
        let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
        square / a.len() as f64 / sd(a).powi(2)
    };
    (base.iter().zip(with).map(mean_square).sum::<f64>() / base.len() as f64).sqrt()
}

/// Standard deviation.
pub fn sd(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// The amplitude on this side of zero at which the change has the wanted strength, by steps proportional to what is missing
/// and, once it is between two values, by bisection where such a step leaves them.
fn amplitude(change: impl Fn(f64) -> Option<f64>, (sign, limit): (f64, f64)) -> Option<f64> {
    let (mut low, mut high) = (0.0_f64, f64::INFINITY);
    let mut at = if limit.is_finite() { 0.1 * limit } else { 1.0 };
    for _ in 0..100 {
        let next = match change(sign * at) {
            Some(found) if (found - STRENGTH).abs() < STRENGTH_WITHIN => return Some(sign * at),
            Some(found) if found < STRENGTH => {
                low = at;
                at * (STRENGTH / found.max(1e-9)).min(10.0)
            }
            Some(found) => {
                high = at;
                at * (STRENGTH / found).max(0.05)
            }
            None => {
                high = at;
                0.2 * at
            }
        };
        at = if next > low && next < high { next } else { 0.5 * (low + high) };
        // Physics would refuse more; a little less than its limit, since the fit may not stand at it.
        if low >= 0.9 * limit {
            return None;
        }
        at = at.min(0.9 * limit);
        if !(at > 0.0 && at.is_finite()) {
            return None;
        }
    }
    None
}

/// The data of a draw: noise of `level` standard deviations of each channel; also returns its standard deviation.
pub fn noisy(draw: &Draw, level: f64, rho: f64, rng: &mut ChaCha8Rng) -> (Vec<Vec<f64>>, Noise) {
    let sd: Vec<f64> = draw.clean.iter().map(|values| level * sd(values)).collect();
    let mut add = |(values, sd): (&Vec<f64>, &f64)| -> Vec<f64> {
        let mut noise = 0.0;
        let with = |(i, v): (usize, &f64)| {
            let shock: f64 = StandardNormal.sample(rng);
            // The first value has the variance of all.
            noise = if i == 0 { shock } else { rho * noise + (1.0 - rho * rho).sqrt() * shock };
            v + sd * noise
        };
        values.iter().enumerate().map(with).collect()
    };
    let data = draw.clean.iter().zip(&sd).map(&mut add).collect();
    (data, Noise { sd, rho })
}

/// The noise of a data set: an autoregression of order one.
pub struct Noise {
    /// Standard deviation of each channel.
    pub sd: Vec<f64>,
    /// Correlation of neighbouring samples; 0 for white noise.
    pub rho: f64,
}
