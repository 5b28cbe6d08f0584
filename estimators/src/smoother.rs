//! Fixed-interval smoother as a product of transforms.
//!
//! Deliberately blind to what the particles hold: states, parameters or outputs, all are mixed by the same matrices.
//! Exact when the parameters do not drift; a drift composed into the transforms is smoothed as if it were noise-free.
//! Read next: `roukf.rs`, which makes the transforms.

use nalgebra::DMatrix;

/// Smoothed particles X_{k|K} = X_{k|k} T_{k+1} ... T_K (an ensemble form of Rauch, Tung & Striebel 1965).
///
/// `particles[k]` (n x r) are the particles after analysis k, `transforms[k]` (r x r) is the transform of analysis k:
/// the first transform is not used.
///
/// # Panics
/// When the two slices differ in length.
pub fn smooth(particles: &[DMatrix<f64>], transforms: &[DMatrix<f64>]) -> Vec<DMatrix<f64>> {
    assert_eq!(particles.len(), transforms.len(), "one transform per stored ensemble");
    let mut later: Option<DMatrix<f64>> = None;
    let mut smoothed: Vec<DMatrix<f64>> = particles
        .iter()
        .zip(transforms)
        .rev()
        .map(|(x, t)| {
            let at_k = later.as_ref().map_or_else(|| x.clone(), |g| x * g);
            later = Some(later.as_ref().map_or_else(|| t.clone(), |g| t * g));
            at_k
        })
        .collect();
    smoothed.reverse();
    smoothed
}
