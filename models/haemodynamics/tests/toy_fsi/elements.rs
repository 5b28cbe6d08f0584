//! `toy-fsi` by finite elements with a wall thicker in its middle, all of it or half of it observed.

use nalgebra::{Complex, DMatrix};
use serde_json::json;

use crate::kit::{Toy, close, close_relative, vibration};

/// The wall of the tables: 39 nodes, half as thick again in the middle.
fn varying() -> Toy {
    Toy::new("toy-fsi", json!({ "discretisation": "elements", "cells": [40, 8], "thickness_wave": 0.5 }), &[])
}

/// Nodes at x ≤ L/2 observed.
fn half() -> Toy {
    varying().observing(20)
}

fn first(toy: &Toy, n: usize) -> Vec<Complex<f64>> {
    toy.poles().into_iter().filter(|p| p.im > 0.0).take(n).collect()
}

#[test]
fn frequencies_and_shares_of_added_mass_are_those_of_the_table() {
    let toy = varying();
    let blocks = toy.blocks();
    let (omega, shapes) = vibration(&blocks.mass, &blocks.stiffness);
    let expected = [357.016_464_94, 665.366_298_34, 946.366_589_20, 1_204.154_193_11, 1_450.649_745_34];
    close(&omega, &expected, 5e-9, "omega");
    close(&first(&toy, 5).iter().map(|p| p.im).collect::<Vec<_>>(), &expected, 5e-9, "poles");
    let share: Vec<f64> =
        shapes.column_iter().map(|phi| (phi.transpose() * &blocks.added_mass * phi)[0]).collect();
    let table = [0.979_332_8, 0.932_380_97, 0.875_237_45, 0.820_193_39, 0.771_458_1];
    close(&share, &table, 5.1e-8, "share of the added mass");
}

#[test]
fn the_added_mass_converges_at_second_order_to_that_of_the_modes() {
    let tables = [
        ([20, 4], [10.437_257_99, 2.831_887_77, 1.414_727_34, 0.909_343_18, 0.666_406_36]),
        ([40, 8], [10.456_768_71, 2.851_382_51, 1.434_326_07, 0.929_299_74, 0.687_074_21]),
        ([80, 16], [10.461_651_02, 2.856_274_84, 1.439_267_84, 0.934_363_28, 0.692_356_04]),
    ];
    let mut errors = Vec::new();
    for (cells, table) in tables {
        let toy = Toy::new("toy-fsi", json!({ "discretisation": "elements", "cells": cells }), &[]);
        let (n, dx) = (cells[0] - 1, toy.theta[0] / cells[0] as f64);
        let wall = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => 2.0 * dx / 3.0,
            1 => dx / 6.0,
            _ => 0.0,
        });
        let (root, _) = vibration(&(wall * toy.theta[6]), &toy.blocks().added_mass);
        let mu: Vec<f64> = root.iter().rev().map(|root| root * root).collect();
        close(&mu, &table, 5e-9, "mu");
        errors.push(10.463_278_866 - mu[0]);
    }
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        // Second order up to the next term, a hundredth of the step squared.
        assert!((order - 2.0).abs() < 0.01, "{order}");
    }
}

#[test]
fn slopes_under_full_and_half_observation_are_those_of_the_table() {
    // Printed to eight digits behind the point; slopes of undamped poles are real.
    let holds = |toy: &Toy, kind: &str, table: [f64; 3]| {
        let slopes = toy.slopes(kind, &first(toy, 3));
        close(&slopes.iter().map(|s| s.re).collect::<Vec<_>>(), &table, 5.1e-9, kind);
        assert!(slopes.iter().all(|s| s.im.abs() < 1e-9), "{kind}: {slopes:?}");
    };
    let full = varying();
    holds(&full, "dvf", [-0.010_333_60, -0.033_809_51, -0.062_381_27]);
    holds(&full, "sdf-displacement", [-0.010_333_60, -0.033_809_51, -0.062_381_27]);
    holds(&full, "sdf", [-0.5; 3]);
    holds(&full, "dvf-am", [-0.5; 3]);
    let half = half();
    holds(&half, "dvf", [-0.005_328_27, -0.016_904_76, -0.032_194_74]);
    holds(&half, "dvf-am", [-0.166_655_75, -0.440_100_35, -0.252_697_40]);
    holds(&half, "sdf", [-0.292_509_48, -0.25, -0.287_622_27]);
    holds(&half, "sdf-displacement", [-0.006_049_13, -0.016_904_76, -0.035_982_07]);
}

#[test]
fn the_largest_real_parts_with_half_of_the_wall_observed_are_those_of_the_table() {
    let gains = [50.0, 100.0, 200.0, 400.0, 600.0, 1e3, 5e3, 2e4];
    let toy = half();
    for (kind, table) in [
        ("dvf", [-0.26641, -0.53283, -1.06566, -2.13137, -3.19716, -5.32919, -26.74549, -12.69533]),
        (
            "sdf-displacement",
            [-0.30246, -0.60491, -1.20984, -2.41981, -3.63001, -6.05158, -29.86813, -12.43215],
        ),
        ("sdf", [-12.47934, -24.83339, -48.62432, -87.73729, -84.92500, -60.15167, -24.67923, -8.43638]),
        ("dvf-am", [-8.33739, -16.70164, -33.59165, -66.81655, -72.62265, -46.13345, -15.25185, -4.68606]),
    ] {
        toy.holds_max_re(kind, &gains, &table, 5.1e-6);
    }
}

#[test]
fn the_largest_real_parts_with_all_of_the_wall_observed_are_those_of_the_table() {
    let gains = [10.0, 200.0, 600.0, 1e3, 5e3, 2e4, 1e5];
    let toy = varying();
    let velocity = [-0.10334, -2.06672, -6.20016, -10.33360, -51.66804, -206.67506, -63.61215];
    let energy = [-5.0, -100.0, -300.0, -149.94394, -25.62346, -6.37507, -1.27462];
    for (kind, table) in
        [("dvf", velocity), ("sdf-displacement", velocity), ("sdf", energy), ("dvf-am", energy)]
    {
        toy.holds_max_re(kind, &gains, &table, 5.1e-6);
    }
}

#[test]
fn with_half_of_the_wall_observed_displacement_feedback_reaches_most() {
    let toy = half();
    for (kind, gain, max_re) in [("sdf", 527.0, -101.9), ("dvf-am", 518.0, -77.1), ("dvf", 5547.0, -29.5)] {
        let best = toy.best(kind);
        // A corner of two modes, which the table found on a grid of gains: the bottom is a little lower, the gain near.
        assert!(best.max_re < max_re + 0.05 && best.max_re > 1.004 * max_re, "{kind}: {best:?}");
        close_relative(&[best.gain], &[gain], 0.01, kind);
    }
}
