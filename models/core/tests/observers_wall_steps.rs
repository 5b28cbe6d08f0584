//! Corrections of a wall in small steps against the feedback matrices, on dense matrices.
#![allow(clippy::float_cmp, clippy::unwrap_used, reason = "exact comparisons and helpers of tests")]

mod dense_wall;

use dense_wall::{DenseWall, GAIN, N, STRUCTURAL, channels, ext, full, half, poles, random};
use nalgebra::{DMatrix, DVector};

/// The generator of a kind's correction steps: A − Γ, but for `sdf-displacement`, whose steps are written in the momentum
/// velocity.
fn generator(wall: &DenseWall, kind: &str, channels: &[String]) -> DMatrix<f64> {
    let feedback = wall.feedback(kind, GAIN, channels);
    if kind != "sdf-displacement" {
        return wall.rate() - feedback;
    }
    let (b, e) = (&wall.blocks, wall.trace());
    let ext = if channels.len() == 2 { DMatrix::identity(N, N) } else { ext(&b.stiffness) };
    let block = &e * b.mass.clone().try_inverse().unwrap() * e.transpose() * &b.solid_mass * ext * GAIN;
    let mut moved = DMatrix::zeros(feedback.nrows(), feedback.ncols());
    moved.view_mut((1, 1), (N, N)).copy_from(&block);
    wall.rate() - moved
}

#[test]
fn the_two_forms_of_the_solid_feedback_have_the_same_poles_only_with_nothing_damped() {
    let apart = |wall: &DenseWall| {
        let of_velocity = poles(&(wall.rate() - wall.feedback("sdf-displacement", GAIN, &half())));
        let of_steps = poles(&generator(wall, "sdf-displacement", &half()));
        let apart = |(p, q): (&(f64, f64), &(f64, f64))| (p.0 - q.0).abs() + (p.1 - q.1).abs();
        of_velocity.iter().zip(&of_steps).map(apart).fold(0.0, f64::max)
    };
    let (potential, viscous) = (apart(&DenseWall::potential()), apart(&DenseWall::viscous()));
    // Eigenvalues of order ten of matrices that are similar.
    assert!(potential < 1e-11, "{potential:e}");
    // Not a matter of rounding: some pole moves by a part of the gain.
    assert!(viscous > 0.1 * GAIN, "{viscous:e}");
}

#[test]
fn corrections_in_small_steps_follow_the_feedback_matrix() {
    for wall in [DenseWall::potential(), DenseWall::viscous()] {
        let outlet = channels(&["pressure"]);
        for (kind, channels) in STRUCTURAL.iter().flat_map(|kind| [(*kind, half()), (*kind, full())]) {
            follows(&wall, kind, &channels);
        }
        follows(&wall, "windkessel", &outlet);
    }
}

fn follows(wall: &DenseWall, kind: &str, channels: &[String]) {
    let start: Vec<f64> = random(1 + N + wall.blocks.mass.nrows(), 1, 7).as_slice().to_vec();
    let zero = vec![0.0; wall.show(channels, &start).len()];
    let want = (generator(wall, kind, channels) * 2.0).exp() * DVector::from_column_slice(&start);
    let observer = wall.observer(kind, GAIN, channels);
    let error = |n: u32| {
        let dt = 2.0 / f64::from(n);
        let advance = (wall.rate() * dt).exp();
        let mut x = start.clone();
        for _ in 0..n {
            x = (&advance * DVector::from_column_slice(&x)).as_slice().to_vec();
            x = wall.corrected(&*observer, dt, channels, &zero, &x);
        }
        (DVector::from_vec(x) - &want).amax()
    };
    let (coarse, fine) = (error(1000), error(2000));
    // Steps of first order: halved with the step, below 1 % at the finer one.
    assert!(fine < 1e-2 && (coarse / fine - 2.0).abs() < 0.05, "{kind}: {coarse:e} {fine:e}");
}
