//! The classic Runge–Kutta method in equal steps (Kutta 1901).
//!
//! It estimates no error and locates no switching points: its cost is known in advance. Next file to read: [`super::dopri5`].

use super::stepper::MAX_STEPS;
use super::system::{System, not_finite};
use crate::failure::ModelFailure;

/// Number and length of equal steps over a span that are no longer than `step`.
///
/// # Errors
/// When the span needs too many.
pub(super) fn equal_steps<S: System>(
    system: &S,
    [start, end]: [f64; 2],
    step: f64,
) -> Result<(u64, f64), ModelFailure> {
    // A step that divides the span but for rounding must not be cut in two.
    let count = ((end - start) / step - 1e-9).ceil().max(1.0);
    let limit = system.limits().in_one_span(MAX_STEPS);
    if count > limit as f64 || count.is_nan() {
        return Err(ModelFailure::TooManySteps { time: start, limit });
    }
    let h = (end - start) / count;
    system.limits().foresee(h, start)?;
    Ok((count as u64, h))
}

/// Advances `x` over the span in equal steps no longer than `step`.
///
/// # Errors
/// When the span needs too many steps or the state stops being finite.
pub(super) fn advance<S: System>(
    system: &mut S,
    [start, end]: [f64; 2],
    x: &mut [f64],
    step: f64,
) -> Result<(), ModelFailure> {
    let n = x.len();
    let (count, h) = equal_steps(system, [start, end], step)?;
    let mut work = vec![0.0; 3 * n];
    let (k, rest) = work.split_at_mut(n);
    let (sum, stage) = rest.split_at_mut(n);
    for i in 0..count {
        let t = start + i as f64 * h;
        system.limits().take(1, t)?;
        sum.fill(0.0);
        for (c, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            // The first stage has c = 0, so that what k holds from the step before does not enter.
            for ((s, x), k) in stage.iter_mut().zip(x.iter()).zip(k.iter()) {
                *s = x + c * h * k;
            }
            system.rhs(t + c * h, stage, k);
            for (sum, k) in sum.iter_mut().zip(k.iter()) {
                *sum += weight * k;
            }
        }
        for (x, sum) in x.iter_mut().zip(sum.iter()) {
            *x += h / 6.0 * sum;
        }
        if !x.iter().all(|v| v.is_finite()) {
            return Err(not_finite(system, t + h, x));
        }
    }
    Ok(())
}
