//! The information that data carry about what is missing: the misfit of the wrong model to data without noise, after the best
//! refit, in units of the noise.
//!
//! The fit is Levenberg–Marquardt on the maximum of the posterior (Marquardt 1963), apart from the estimators of the project.
//! Next file to read: [`crate::world`].

use nalgebra::{DMatrix, DVector};
use starlings_coordinator::study::checked::StudyParameter;
use starlings_estimators::Transform;
use starlings_models::{BuildSetup, EffectDef, Forward};

use crate::draw::{Draw, Noise, with_effect};
use crate::world::World;

/// Iterations at most.
const ITERATIONS: usize = 60;

/// A parameter of a fit: its map, prior mean and standard deviation in transformed units.
struct Free {
    transform: Transform,
    mean: f64,
    sd: f64,
}

/// A fit to data without noise.
pub struct Refit {
    /// χ² of the training rows.
    pub misfit: f64,
    /// Residuals of the training rows over the noise, channel by channel.
    pub residual: DVector<f64>,
    /// Their derivatives by the parameters in prior standard deviations.
    pub jacobian: DMatrix<f64>,
    /// The parameters in physical units.
    pub theta: Vec<f64>,
}

struct Problem<'a> {
    world: &'a World<'a>,
    forward: Box<dyn Forward>,
    free: Vec<Free>,
    clean: &'a [Vec<f64>],
    noise: &'a Noise,
}

impl Problem<'_> {
    fn physical(&self, z: &DVector<f64>) -> Vec<f64> {
        let value = |(free, z): (&Free, &f64)| free.transform.to_physical(free.mean + free.sd * z);
        self.free.iter().zip(z.iter()).map(value).collect()
    }

    /// (simulated − true)/noise of the training rows, whitened.
    fn residual(&self, z: &DVector<f64>) -> Option<DVector<f64>> {
        let outputs = self.world.run(self.forward.as_ref(), &self.physical(z))?;
        Some(training(self.world, &outputs, self.clean, self.noise))
    }

    fn jacobian(&self, z: &DVector<f64>) -> Option<DMatrix<f64>> {
        let step = 1e-4;
        let mut columns = Vec::new();
        for i in 0..z.len() {
            let moved = |by: f64| {
                let mut z = z.clone();
                z[i] += by;
                self.residual(&z)
            };
            columns.push((moved(step)? - moved(-step)?) / (2.0 * step));
        }
        Some(DMatrix::from_columns(&columns))
    }

    fn solve(&self, start: DVector<f64>) -> Option<Refit> {
        let mut z = start;
        let mut r = self.residual(&z)?;
        let mut cost = r.norm_squared() + z.norm_squared();
        let mut damping = 1e-4;
        let mut j = self.jacobian(&z)?;
        for _ in 0..ITERATIONS {
            let normal = j.tr_mul(&j) + DMatrix::identity(z.len(), z.len());
            let gradient = j.tr_mul(&r) + &z;
            let mut damped = normal.clone();
            for i in 0..z.len() {
                damped[(i, i)] += damping * normal[(i, i)];
            }
            let step = damped.cholesky()?.solve(&gradient);
            let next = &z - &step;
            let tried = self.residual(&next).map(|r| (r.norm_squared() + next.norm_squared(), r));
            match tried {
                Some((new, residual)) if new < cost => {
                    let done = cost - new < 1e-7 * new + 1e-9;
                    (z, r, cost) = (next, residual, new);
                    damping = (damping * 0.2).max(1e-12);
                    j = self.jacobian(&z)?;
                    if done {
                        break;
                    }
                }
                _ if step.norm() < 1e-9 || damping > 1e8 => break,
                _ => damping *= 8.0,
            }
        }
        Some(Refit { misfit: r.norm_squared(), theta: self.physical(&z), residual: r, jacobian: j })
    }
}

/// Rows of the training span, (simulated − true)/noise, channel by channel; the innovations of that where the noise is correlated, so
/// that their squares add up to χ² in any case.
pub fn training(
    world: &World<'_>,
    simulated: &[Vec<f64>],
    clean: &[Vec<f64>],
    noise: &Noise,
) -> DVector<f64> {
    let n = world.n_train();
    let mut rows = Vec::with_capacity(n * clean.len());
    for ((simulated, clean), sd) in simulated.iter().zip(clean).zip(&noise.sd) {
        let mut before: Option<f64> = None;
        for (s, c) in simulated.iter().zip(clean).take(n) {
            let now = (s - c) / sd;
            let rho = noise.rho;
            rows.push(before.map_or(now, |before| (now - rho * before) / (1.0 - rho * rho).sqrt()));
            before = Some(now);
        }
    }
    DVector::from_vec(rows)
}

/// Fits the model, which lacks the effect, to a draw without noise; starts at the true parameters.
pub fn refit(world: &World<'_>, draw: &Draw, noise: &Noise) -> Option<Refit> {
    refit_with(world, draw, noise, &[])
}

/// The same with these effects in the model, from these values of their parameters, which no prior holds.
pub fn refit_with(
    world: &World<'_>,
    draw: &Draw,
    noise: &Noise,
    effects: &[(EffectDef, Vec<f64>)],
) -> Option<Refit> {
    let own = |p: &StudyParameter| Free { transform: p.transform, mean: p.prior_mean[0], sd: p.prior_sd };
    let mut free: Vec<Free> = world.study.parameters.iter().map(own).collect();
    let scaled = |(free, v): (&Free, &f64)| (free.transform.to_transformed(*v) - free.mean) / free.sd;
    let mut start: Vec<f64> = free.iter().zip(&draw.theta).map(scaled).collect();
    let mut setup = world.model.clone();
    for (def, values) in effects {
        setup = with_effect(&setup, def);
        free.extend(values.iter().map(|v| Free {
            transform: Transform::Linear,
            mean: *v,
            // Wide enough for its penalty not to count.
            sd: 3.0 * v.abs().max(1e-6),
        }));
        start.extend(values.iter().map(|_| 0.0));
    }
    let forward = setup.build().ok()?;
    Problem { world, forward, free, clean: &draw.clean, noise }.solve(DVector::from_vec(start))
}
