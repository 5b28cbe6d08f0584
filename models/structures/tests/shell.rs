//! Frequencies of the reference cone by two discretisations, and the response of the model.
#![allow(clippy::unwrap_used)]

mod shell_kit;

use shell_kit::collocation;
use starlings_models_core::Model;
use starlings_models_core::limits::Limits;
use starlings_models_core::segment::{Drive, Segment};
use starlings_structures::conical_shell::{Cone, ConicalShell, Layout, Ritz, ShellMode, Wall};

fn cone() -> Cone {
    Cone { half_angle: 20_f64.to_radians(), ends: [1.5, 3.0] }
}

const WALL: Wall = Wall { young: 110e9, poisson: 0.34, density: 4500.0, thickness: 0.002 };

/// Waves around; the four lowest frequencies in Hz without in-plane inertia; the two lowest with it.
const TABLE: [(usize, [f64; 4], [f64; 2]); 10] = [
    (2, [97.364, 485.339, 707.570, 748.133], [88.62, 438.84]),
    (3, [51.6570, 303.9436, 582.768, 697.361], [49.34, 287.00]),
    (4, [32.5836, 204.9984, 451.723, 609.679], [31.73, 198.27]),
    (5, [25.5117, 147.9076, 350.678, 515.089], [25.07, 144.82]),
    (6, [25.8819, 114.0859, 278.035, 432.327], [25.57, 112.46]),
    (7, [30.6938, 95.5817, 227.255, 365.511], [30.42, 94.60]),
    (8, [37.7679, 88.6299, 193.382, 314.096], [37.51, 87.94]),
    (9, [46.0574, 90.4002, 173.369, 276.584], [45.81, 89.85]),
    (10, [55.2794, 97.8536, 165.159, 251.658], [55.04, 97.38]),
    (12, [76.5091, 120.5486, 174.753, 235.270], [76.27, 120.14]),
];

fn ritz(waves: usize, terms: usize, in_plane: bool, count: usize) -> Vec<f64> {
    let modes = Ritz::new(cone(), waves, terms).modes(&WALL, in_plane, count).unwrap();
    modes.iter().map(ShellMode::frequency).collect()
}

#[test]
fn ritz_gives_every_frequency_of_the_table() {
    for (waves, without, with) in TABLE {
        for (found, expected) in ritz(waves, 30, false, 4).iter().zip(without) {
            // The reference is given to 1e-3 Hz, half a unit of which it may be off.
            assert!((found - expected).abs() < 1e-3, "{waves}: {found} for {expected}");
        }
        for (found, expected) in ritz(waves, 24, true, 2).iter().zip(with) {
            // Two decimals.
            assert!((found - expected).abs() < 6e-3, "{waves}: {found} for {expected}");
        }
    }
}

#[test]
fn collocation_in_other_unknowns_gives_the_same_frequencies() {
    for (waves, without, _) in TABLE {
        let found = collocation(&cone(), &WALL, waves, 48, 4);
        for (found, expected) in found.iter().zip(without) {
            // As above; roundings of fourth derivatives at 49 points are some 1e-4 Hz.
            assert!((found - expected).abs() < 1e-3, "{waves}: {found} for {expected}");
        }
        assert_eq!(found.len(), 4);
    }
}

#[test]
fn few_functions_give_frequencies_from_above() {
    for waves in [5, 8] {
        let (few, many) = (ritz(waves, 16, false, 2), ritz(waves, 30, false, 2));
        // Ritz's method converges from above; sixteen functions are what the model takes by itself.
        assert!(few.iter().zip(&many).all(|(few, many)| few - many > -1e-6), "{few:?}, {many:?}");
        assert!(few.iter().zip(&many).all(|(few, many)| few / many - 1.0 < 1e-3), "{few:?}, {many:?}");
    }
}

#[test]
fn a_wall_without_stiffness_or_mass_has_no_modes() {
    let ritz = Ritz::new(cone(), 5, 8);
    for wall in [
        Wall { young: 0.0, ..WALL },
        Wall { young: f64::NAN, ..WALL },
        Wall { thickness: -0.002, ..WALL },
        Wall { density: 0.0, ..WALL },
    ] {
        assert!(ritz.modes(&wall, false, 2).is_none(), "{wall:?}");
    }
}

#[test]
fn the_free_edge_yields_to_a_steady_load_as_the_stiffness_says() {
    struct NoHistory;
    impl starlings_models_core::segment::History for NoHistory {
        fn at(&self, _: usize, _: f64) -> f64 {
            f64::NAN
        }
    }
    let model = ConicalShell::new(&Layout {
        waves: vec![5],
        modes: 1,
        sensors: vec![[3.0, 0.0]],
        source: 3.0,
        ..Layout::default()
    })
    .unwrap();
    let theta = [110e9, 0.34, 4500.0, 0.002, 20.0];
    let mut x = vec![0.0; 2];
    let segment = Segment {
        t0: 0.0,
        t1: 5.0,
        u0: &[10.0],
        slope: &[0.0],
        history: &NoHistory,
        limits: &Limits::none(),
        noise: None,
    };
    model.advance(segment, &theta, &mut x).unwrap();
    let mut y = vec![0.0; 2];
    model.output(5.0, &x, &theta, Drive::NONE, &mut y);
    let ritz = Ritz::new(cone(), 5, 16);
    let mode = &ritz.modes(&WALL, false, 1).unwrap()[0];
    let edge = ritz.shape(mode, 3.0);
    // Half of the shell's mass: ρ h times π sin α (s2² − s1²)/2.
    let mass = 4500.0 * 0.002 * std::f64::consts::PI * 20_f64.to_radians().sin() * 0.5 * (9.0 - 2.25);
    let expected = 10.0 * edge * edge / (mass * mode.square);
    // e^(−100) of the oscillation is left; the rest is rounding.
    assert!((y[0] / expected - 1.0).abs() < 1e-12, "{} for {expected}", y[0]);
}
