//! The tube's equations and its step, against dense matrices and conservation laws.
#![allow(clippy::float_cmp)]

mod fsi_tube_kit;

use fsi_tube_kit::{Dense, MM_HG, NoHistory, advance, outputs, tube, values};
use nalgebra::{DMatrix, SymmetricEigen};
use starlings_models_core::{Drive, Model};

/// A state of a tube of `n` cells that is no equilibrium.
fn rough(n: usize) -> Vec<f64> {
    let eta = (0..n).map(|j| 0.2 + 0.01 * (7.3 * j as f64).sin());
    let w = (0..n).map(|j| (3.1 * j as f64).cos());
    eta.chain(w).chain([1.2e5]).collect()
}

/// Panics unless a state is the dense one but for rounding.
fn assert_close(own: &[f64], dense: &[f64], what: &str) {
    let n = own.len() / 2;
    let worst = |from: usize, to: usize| (from..to).map(|i| (own[i] - dense[i]).abs()).fold(0.0, f64::max);
    // Rounding of flows of 100 and pressures of 1e5, most of it by the dense inverse of the mass.
    assert!(worst(0, n) < 1e-11, "{what}: displacement {:e}", worst(0, n));
    assert!(worst(n, 2 * n) < 1e-9, "{what}: velocity {:e}", worst(n, 2 * n));
    assert!(worst(2 * n, 2 * n + 1) < 1e-9 * 1.2e5, "{what}: pressure {:e}", worst(2 * n, 2 * n + 1));
}

#[test]
fn the_step_in_face_flows_is_the_dense_step() {
    for n in [5, 25, 60] {
        let model = tube(n, 1e-3);
        let theta = values(&model, &[("k_s", 1e5), ("c_s", 3e3)]);
        let mut x = rough(n);
        let dense = Dense::new(n, 1e5, 3e3).step(&x, [100.0, 110.0], 1e-3);
        advance(&model, &theta, [100.0, 110.0], 1e-3, &mut x);
        assert_close(&x, dense.as_slice(), &format!("{n} cells"));
    }
}

#[test]
fn every_step_of_a_beat_is_the_dense_step() {
    let (n, dt) = (25, 1e-3);
    let model = tube(n, dt);
    let theta = values(&model, &[]);
    let dense = Dense::new(n, 0.0, 0.0);
    let mut x = rough(n);
    for i in 0..400 {
        let q = [i, i + 1].map(|i| fsi_tube_kit::inflow(f64::from(i) * dt));
        let want = dense.step(&x, q, dt);
        advance(&model, &theta, q, dt, &mut x);
        assert_close(&x, want.as_slice(), &format!("step {i}"));
    }
}

#[test]
fn the_rate_is_that_of_the_dense_matrices() {
    for n in [5, 25] {
        let model = tube(n, 1e-3);
        let theta = values(&model, &[("k_s", 1e5), ("c_s", 3e3)]);
        let x = rough(n);
        let want = Dense::new(n, 1e5, 3e3).rate(&x, 100.0, 2e3);
        let mut got = vec![0.0; 2 * n + 1];
        let u = Drive { value: &[100.0], slope: &[2e3], history: &NoHistory };
        model.rhs(0.0, &x, &theta, u, &mut got);
        let scale = want.amax();
        for (i, (a, b)) in got.iter().zip(want.iter()).enumerate() {
            // Rounding relative to the largest rate.
            assert!((a - b).abs() < 1e-12 * scale, "{n}, {i}: {a} against {b}");
        }
    }
}

#[test]
fn the_blocks_are_those_of_the_rate() {
    let n = 25;
    let model = tube(n, 1e-3);
    let theta = values(&model, &[("k_s", 1e5), ("c_s", 3e3)]);
    let dense = Dense::new(n, 1e5, 3e3);
    let blocks = model.blocks(&theta).unwrap();
    let error = (&blocks.added_mass - &dense.added_mass).amax() / dense.added_mass.amax();
    assert!(error < 1e-14, "added mass {error:e}");
    // M ∂(dw/dt)/∂η = −K, and the Windkessel empties at 1/(R_d C).
    let coupling = &blocks.mass * dense.a.view((n, 0), (n, n));
    let error = (coupling + &blocks.stiffness).amax() / blocks.stiffness.amax();
    assert!(error < 1e-12, "stiffness {error:e}");
    let windkessel = blocks.windkessel.unwrap();
    assert_eq!((windkessel.state, blocks.displacement, blocks.velocity), (2 * n, 0, n));
    assert!((windkessel.rate + dense.a[(2 * n, 2 * n)]).abs() < 1e-15);
    assert_eq!(blocks.mass, &blocks.solid_mass + &blocks.added_mass);
}

#[test]
fn the_first_modes_move_almost_only_fluid() {
    let model = tube(25, 1e-3);
    let theta = values(&model, &[]);
    let blocks = model.blocks(&theta).unwrap();
    // K φ = ω² M φ by the Cholesky factor of M.
    let root = blocks.mass.clone().cholesky().unwrap().l().try_inverse().unwrap();
    let modes = SymmetricEigen::new(&root * &blocks.stiffness * root.transpose());
    let mut order: Vec<usize> = (0..25).collect();
    order.sort_by(|a, b| modes.eigenvalues[*a].total_cmp(&modes.eigenvalues[*b]));
    let want = [
        (48.532_094_83, 0.999_604_195_050),
        (129.331_591_11, 0.996_904_813_319),
        (193.932_931_78, 0.990_722_260_582),
    ];
    for (&i, (frequency, share)) in order.iter().zip(want) {
        let mode: DMatrix<f64> = root.transpose() * modes.eigenvectors.columns(i, 1);
        let own = (mode.transpose() * &blocks.added_mass * &mode)[(0, 0)];
        // The digits of the table.
        assert!((modes.eigenvalues[i].sqrt() - frequency).abs() < 1e-7, "{}", modes.eigenvalues[i].sqrt());
        assert!((own - share).abs() < 1e-11, "{own}");
    }
}

#[test]
fn what_flows_in_widens_the_wall_fills_the_windkessel_or_leaves() {
    let (n, dt) = (25, 1e-3);
    let model = tube(n, dt);
    let theta = values(&model, &[]);
    let mut x = rough(n);
    let area = 2.0 * std::f64::consts::PI;
    let volume = |x: &[f64]| area * x[..n].iter().sum::<f64>() + 1e-3 * x[2 * n];
    for i in 0..800 {
        let q = [i, i + 1].map(|i| fsi_tube_kit::inflow(f64::from(i) * dt));
        let before = x.clone();
        advance(&model, &theta, q, dt, &mut x);
        let mean = 0.5 * (x[2 * n] + before[2 * n]);
        let balance = dt * (0.5 * (q[0] + q[1]) - mean / 1850.0);
        let error = volume(&x) - volume(&before) - balance;
        // Rounding of a volume of about 150 cm³.
        assert!(error.abs() < 1e-12 * 150.0, "step {i}: {error:e}");
    }
}

#[test]
fn a_steady_flow_ends_in_the_resistances_pressures() {
    let n = 25;
    let model = tube(n, 0.05);
    let theta = values(&model, &[("k_s", 1e5)]);
    let mut x = vec![0.0; 2 * n + 1];
    for _ in 0..4000 {
        advance(&model, &theta, [80.0; 2], 0.05, &mut x);
    }
    let y = outputs(&model, &theta, 80.0, 0.0, &x);
    let (outlet, inlet) = (80.0 * 2000.0, 80.0 * 2000.0 + 80.0 * 8.0 * 0.035 * 25.0 / std::f64::consts::PI);
    // Two hundred seconds of relaxation at 0.46/s; what is left is rounding.
    assert!((x[2 * n] - 80.0 * 1850.0).abs() < 1e-6, "{}", x[2 * n]);
    assert!((y[2 * n] - outlet).abs() < 1e-6 && (y[2 * n + 1] - 80.0).abs() < 1e-10, "{:?}", &y[2 * n..]);
    assert!((y[2 * n + 2] - inlet).abs() < 1e-6, "{} against {inlet} (Poiseuille)", y[2 * n + 2]);
}

#[test]
fn a_run_starts_at_rest_in_equilibrium_with_its_pressure() {
    let n = 25;
    let model = tube(n, 1e-3);
    let theta = values(&model, &[("k_s", 1e5), ("p0", 90.0 * MM_HG)]);
    let mut x = vec![f64::NAN; 2 * n + 1];
    model.initial(&theta, &mut x);
    assert_eq!(x[n..2 * n], vec![0.0; n]);
    assert_eq!(x[2 * n], 90.0 * MM_HG);
    // Without flow nothing moves but by the emptying of the Windkessel, and through it alone.
    let mut rate = vec![0.0; 2 * n + 1];
    let u = Drive { value: &[0.0], slope: &[0.0], history: &NoHistory };
    model.rhs(0.0, &x, &theta, u, &mut rate);
    // Rounding of pressures of 1e5 over a mass of 0.165.
    assert!(rate[..2 * n].iter().all(|v| v.abs() < 1e-9), "{rate:?}");
    assert!((rate[2 * n] + 90.0 * MM_HG / 1.85).abs() < 1e-9 * rate[2 * n].abs());
}

#[test]
fn the_pressure_falls_along_the_tube_by_inertia_and_friction() {
    let n = 25;
    let model = tube(n, 1e-3);
    let theta = values(&model, &[("k_s", 1e5)]);
    let (x, q, slope) = (rough(n), 100.0, 2e3);
    let mut rate = vec![0.0; 2 * n + 1];
    model.rhs(0.0, &x, &theta, Drive { value: &[q], slope: &[slope], history: &NoHistory }, &mut rate);
    let y = outputs(&model, &theta, q, slope, &x);
    let (inertia, friction) = (1.06 / std::f64::consts::PI, 8.0 * 0.035 / std::f64::consts::PI);
    let area = 2.0 * std::f64::consts::PI;
    // Half a cell at the inlet, whole ones, half a cell at the outlet.
    let (mut flow, mut change) = (q, slope);
    let mut drop = 0.5 * (inertia * change + friction * flow);
    for k in 0..n {
        flow -= area * x[n + k];
        change -= area * rate[n + k];
        let weight = if k + 1 == n { 0.5 } else { 1.0 };
        drop += weight * (inertia * change + friction * flow);
    }
    // Rounding of pressures of 1e5.
    assert!(
        (y[2 * n + 2] - y[2 * n] - drop).abs() < 1e-9 * 1e5,
        "{} against {drop}",
        y[2 * n + 2] - y[2 * n]
    );
}
