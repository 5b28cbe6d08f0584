//! `toy-fsi-stokes`: damped waves, and vortices that no observer of the wall reaches.

use nalgebra::{Complex, DMatrix};
use serde_json::json;
use starlings_models_core::spectrum::poles;

use crate::kit::{Toy, close, nearest, vibration};

/// Mode i of the vessel alone: the first mode of a vessel of length L/i.
fn mode(i: usize, polynomials: usize) -> Toy {
    Toy::new("toy-fsi-stokes", json!({ "modes": 1, "polynomials": polynomials }), &[("L", 10.0 / i as f64)])
}

/// Poles of the first 40 modes under an observer, by modulus.
fn all(observer: Option<(&str, f64)>) -> Vec<Complex<f64>> {
    let of_mode = |i: usize| {
        let toy = mode(i, 14);
        match observer {
            Some((kind, gain)) => toy.system(kind).poles(gain).unwrap(),
            None => toy.poles(),
        }
    };
    let mut all: Vec<Complex<f64>> = (1..=40).flat_map(of_mode).collect();
    all.sort_by(|p, q| p.norm().total_cmp(&q.norm()));
    all
}

/// The hundred slowest, which must be real, from the slowest on.
fn hundred(poles: &[Complex<f64>]) -> Vec<f64> {
    assert!(poles[..100].iter().all(|p| p.im.abs() < 1e-6), "an oscillation among the hundred slowest");
    let mut real: Vec<f64> = poles[..100].iter().map(|p| p.re).collect();
    real.sort_by(|a, b| b.total_cmp(a));
    real
}

/// Largest relative difference.
fn change(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn the_poles_of_the_first_mode_are_those_of_the_table() {
    let real = [-0.667_777_56, -1.971_653_98, -3.927_051_24, -6.534_173_18];
    // 14 profiles do for the slow poles, up to a unit of the last digit; the boundary layer of the wave takes 30.
    for (polynomials, wave, tolerance) in
        [(14, (-1.146_241_72, 299.972_477_12), 1e-8), (40, (-1.143_224_33, 299.976_348_71), 1e-8)]
    {
        let poles = mode(1, polynomials).poles();
        let slow: Vec<f64> = poles.iter().filter(|p| p.im.abs() < 1e-6).map(|p| p.re).collect();
        close(&slow, &real, tolerance, "slow poles");
        let found = nearest(&poles, Complex::new(-1.0, 300.0));
        close(&[found.re, found.im], &[wave.0, wave.1], tolerance, "wave");
    }
}

#[test]
fn the_slowest_poles_are_vortices_that_no_observer_of_the_wall_reaches() {
    let free = hundred(&all(None));
    close(
        &free,
        &[-0.667_777_56, -0.671_269_96, -0.677_672_62, -0.687_737_60, -0.702_319_35],
        1e-8,
        "slowest",
    );
    for (kind, gain, printed) in
        [("dvf", 1e3, 2e-8), ("dvf-am", 200.0, 3e-8), ("sdf-displacement", 200.0, 9e-9)]
    {
        let moved = change(&hundred(&all(Some((kind, gain)))), &free);
        // What the table printed is the rounding of poles between −0.7 and −1e5.
        assert!(moved < printed, "{kind}: {moved:e}");
    }
    // Displacement feedback moves the wall under the vortices, by half the four printed digits' last.
    let moved = change(&hundred(&all(Some(("sdf", 200.0)))), &free);
    assert!((moved - 1.494e-4).abs() < 5e-8, "{moved:e}");
}

#[test]
fn the_slow_poles_are_those_of_a_channel_with_rigid_walls() {
    let mut rigid = Vec::new();
    for i in 1..=40 {
        let toy = mode(i, 14);
        let mass = toy.blocks().mass;
        let dissipation = -&mass * toy.linearisation().view((1, 1), (14, 14));
        // A wall at rest holds the first coefficient at zero.
        let inner = |matrix: DMatrix<f64>| matrix.view((1, 1), (13, 13)).into_owned();
        let (root, _) = vibration(&inner(mass), &inner(dissipation));
        rigid.extend(root.iter().map(|root| -root * root));
    }
    rigid.sort_by(|a, b| b.total_cmp(a));
    let difference = change(&hundred(&all(None)), &rigid);
    // The table bounds it by 6.4e-6; in well-scaled coordinates it is less than half of that.
    assert!((difference - 2.909_143e-6).abs() < 1e-10, "{difference:e}");
}

#[test]
fn waves_are_damped_as_in_a_potential_flow() {
    for (kind, re) in [("sdf", -101.40), ("dvf-am", -100.47), ("sdf-displacement", -2.60)] {
        let poles = mode(1, 40).system(kind).poles(200.0).unwrap();
        let wave = nearest(&poles, Complex::new(re, 290.0));
        close(&[wave.re], &[re], 5e-3, kind);
    }
}

#[test]
fn the_modes_of_a_vessel_are_independent_and_each_that_of_a_shorter_vessel() {
    let (n, n_b) = (6, 5);
    let toy = Toy::new("toy-fsi-stokes", json!({ "modes": n, "polynomials": n_b }), &[]);
    let mut modal = DMatrix::zeros(n * (n_b + 1), n * (n_b + 1));
    for i in 0..n {
        // Unknowns of mode i: its sine at the nodes, then its coefficients.
        let wave = std::f64::consts::PI * (i + 1) as f64 / (n + 1) as f64;
        (0..n).for_each(|j| modal[(j, i * (n_b + 1))] = (wave * (j + 1) as f64).sin());
        (0..n_b).for_each(|j| modal[(n + i * n_b + j, i * (n_b + 1) + 1 + j)] = 1.0);
    }
    let decoupled = modal.clone().try_inverse().unwrap() * toy.linearisation() * modal;
    for i in 0..n {
        let at = |k: usize| (i * (n_b + 1), k * (n_b + 1));
        let own = decoupled.view(at(i), (n_b + 1, n_b + 1));
        let alone = mode(i + 1, n_b).linearisation();
        // Sums of a few dozen rounded products.
        assert!((own - &alone).amax() < 1e-11 * alone.amax(), "mode {i}");
        for k in (0..n).filter(|&k| k != i) {
            assert!(decoupled.view(at(k), (n_b + 1, n_b + 1)).amax() < 1e-11 * alone.amax(), "{i} and {k}");
        }
    }
}

#[test]
fn energy_coordinates_hold_for_the_whole_vessel_too() {
    let toy = Toy::new("toy-fsi-stokes", json!({ "modes": 3, "polynomials": 14 }), &[]);
    let whole = poles(&toy.natural(&toy.linearisation())).unwrap();
    for i in 1..=3 {
        for pole in mode(i, 14).poles() {
            let found = nearest(&whole, pole);
            // Rounding of a matrix whose largest eigenvalue is 1e4.
            assert!((found - pole).norm() < 1e-8 * pole.norm().max(1.0), "mode {i}: {found} for {pole}");
        }
    }
}
