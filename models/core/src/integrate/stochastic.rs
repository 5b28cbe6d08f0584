//! Stochastic equations dx = f dt + b dW in equal steps.
//!
//! Heun's predictor and corrector share one increment of the noise and converge to the solution in the sense of Stratonovich, the
//! method of Euler and Maruyama to that in the sense of Itô (Kloeden and Platen 1992, "Numerical Solution of Stochastic Differential
//! Equations", sections 4.9 and 10.2). Without noise they are the methods of Heun and Euler. Next file to read: [`super::fixed`].

use super::fixed::equal_steps;
use super::system::{System, not_finite};
use crate::failure::ModelFailure;

/// In which sense the noise is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sense {
    Stratonovich,
    Ito,
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
    sense: Sense,
) -> Result<(), ModelFailure> {
    let (count, h) = equal_steps(system, [start, end], step)?;
    let (n, m) = (x.len(), system.n_noise());
    let mut work = vec![0.0; 3 * n + n * m + m];
    let (first, rest) = work.split_at_mut(n);
    let (second, rest) = rest.split_at_mut(n);
    let (moved, rest) = rest.split_at_mut(n);
    let (b, dw) = rest.split_at_mut(n * m);
    for i in 0..count {
        let t = start + i as f64 * h;
        system.limits().take(1, t)?;
        system.draw(dw);
        for dw in dw.iter_mut() {
            *dw *= h.sqrt();
        }
        change(system, t, x, (h, dw), b, first);
        if sense == Sense::Stratonovich {
            for ((moved, x), first) in moved.iter_mut().zip(x.iter()).zip(first.iter()) {
                *moved = x + first;
            }
            change(system, t + h, moved, (h, dw), b, second);
            for (first, second) in first.iter_mut().zip(second.iter()) {
                *first = 0.5 * (*first + second);
            }
        }
        for (x, change) in x.iter_mut().zip(first.iter()) {
            *x += change;
        }
        if !x.iter().all(|v| v.is_finite()) {
            return Err(not_finite(system, t + h, x));
        }
    }
    Ok(())
}

/// Writes f(t, x) h + b(t, x) ΔW; `b` is scratch.
fn change<S: System>(
    system: &mut S,
    t: f64,
    x: &[f64],
    (h, dw): (f64, &[f64]),
    b: &mut [f64],
    change: &mut [f64],
) {
    system.rhs(t, x, change);
    for change in change.iter_mut() {
        *change *= h;
    }
    if dw.is_empty() {
        return;
    }
    system.noise(t, x, b);
    for (dw, b) in dw.iter().zip(b.chunks_exact(x.len())) {
        for (change, b) in change.iter_mut().zip(b) {
            *change += b * dw;
        }
    }
}
