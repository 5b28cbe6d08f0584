//! Observers of a wall against their formulas, on dense matrices and with a part of the wall observed.
#![allow(clippy::float_cmp, clippy::unwrap_used, reason = "exact comparisons and helpers of tests")]

mod dense_wall;

use dense_wall::{DenseWall, GAIN, N, STRUCTURAL, channels, ext, full, h, half, poles, random};
use nalgebra::{DMatrix, DVector};

/// Γ written out with inverses, H, Ext and E as matrices.
fn written_out(wall: &DenseWall, kind: &str) -> DMatrix<f64> {
    let (b, e, h) = (&wall.blocks, wall.trace(), h());
    let inverse = b.mass.clone().try_inverse().unwrap();
    let (n, ext) = (1 + N + b.mass.nrows(), ext(&b.stiffness));
    let (d, c) = (1, 1 + N);
    let ((row, column), block) = match kind {
        "dvf" => ((c, c), inverse * e.transpose() * (&h * &b.solid_mass * &h) * &e * GAIN),
        "dvf-am" => {
            ((c, c), inverse * e.transpose() * (&h * (&b.solid_mass + &b.added_mass) * &h) * &e * GAIN)
        }
        "sdf" => ((d, d), ext * GAIN),
        "sdf-displacement" => ((c, c), inverse * e.transpose() * &b.solid_mass * ext * &e * GAIN),
        _ => ((c, d), inverse * e.transpose() * (&h * &b.solid_mass * &h) * GAIN.powi(2)),
    };
    let mut feedback = DMatrix::zeros(n, n);
    feedback.view_mut((row, column), block.shape()).copy_from(&block);
    feedback
}

#[test]
fn feedback_matrices_are_the_formulas_with_half_the_wall_observed() {
    for wall in [DenseWall::potential(), DenseWall::viscous()] {
        for kind in STRUCTURAL {
            let difference = wall.feedback(kind, GAIN, &half()) - written_out(&wall, kind);
            // Entries of order ten through two solves with condition numbers below a hundred.
            assert!(difference.amax() < 1e-11, "{kind}: {}", difference.amax());
        }
    }
}

#[test]
fn the_extension_has_less_elastic_energy_than_any_other_with_the_same_observed_values() {
    let wall = DenseWall::potential();
    let k = &wall.blocks.stiffness;
    let energy = |d: &DVector<f64>| 0.5 * d.dot(&(k * d));
    // From rest, one step of an infinite gain moves the wall to the extension of the data.
    let (channels, observed) =
        (channels(&["displacement[0]", "displacement[2]", "displacement[5]"]), [0.4, -1.0, 2.0]);
    let sdf = wall.observer("sdf", 1e9, &channels);
    let x = wall.corrected(&*sdf, 1.0, &channels, &observed, &[0.0; 1 + 2 * N]);
    let d = DVector::from_column_slice(&x[1..=N]);
    assert_eq!([d[0], d[2], d[5]], observed);
    for seed in 0..20 {
        let other = (DMatrix::identity(N, N) - h()) * random(N, 1, seed + 100) * 0.1;
        let other = &d + other.column(0);
        assert!(energy(&other) > energy(&d), "{} above {}", energy(&other), energy(&d));
    }
}

#[test]
fn with_the_whole_wall_observed_the_fluid_that_follows_the_displacement_gives_velocity_feedback() {
    for wall in [DenseWall::potential(), DenseWall::viscous()] {
        let (sdf, dvf) =
            (wall.feedback("sdf-displacement", 30.0, &full()), wall.feedback("dvf", 30.0, &full()));
        // The same matrix by another order of products.
        assert!((sdf - &dvf).amax() < 1e-12 * dvf.amax());
    }
}

#[test]
fn added_mass_norm_and_displacement_feedback_damp_every_mode_with_half_the_gain() {
    let wall = DenseWall::potential();
    for kind in ["dvf-am", "sdf"] {
        let closed = wall.rate() - wall.feedback(kind, 0.2, &full());
        for (im, re) in poles(&closed) {
            // All but the Windkessel's own pole; the eigenvalues of a 13 × 13 matrix of order ten.
            assert!(im == 0.0 || (re + 0.1).abs() < 1e-11, "{kind}: {re} + {im}i");
        }
    }
}

#[test]
fn the_slope_of_each_pole_is_that_of_first_order_perturbation() {
    let wall = DenseWall::potential();
    let b = &wall.blocks;
    let root = b.mass.clone().cholesky().unwrap().l().try_inverse().unwrap();
    let modes = (&root * &b.stiffness * root.transpose()).symmetric_eigen();
    let (h, ext, small) = (h(), ext(&b.stiffness), 1e-4);
    for mode in 0..N {
        // Φᵀ M Φ = 1.
        let phi = root.tr_mul(&modes.eigenvectors.column(mode));
        let square = modes.eigenvalues[mode];
        let quadratic = |m: &DMatrix<f64>| phi.dot(&(m * &phi));
        let slopes = [
            ("dvf", -quadratic(&(&h * &b.solid_mass * &h)) / 2.0),
            ("dvf-am", -quadratic(&(&h * (&b.solid_mass + &b.added_mass) * &h)) / 2.0),
            ("sdf", -quadratic(&(&b.stiffness * &ext)) / (2.0 * square)),
            ("sdf-displacement", -quadratic(&(&b.solid_mass * &ext)) / 2.0),
        ];
        for (kind, slope) in slopes {
            let re = |gain: f64| {
                let poles = poles(&(wall.rate() - wall.feedback(kind, 1.0, &half()) * gain));
                let near = |p: &&(f64, f64), q: &&(f64, f64)| {
                    let distance = |p: &(f64, f64)| (p.0 - square.sqrt()).abs();
                    distance(p).total_cmp(&distance(q))
                };
                poles.iter().min_by(near).unwrap().1
            };
            let numerical = (re(small) - re(-small)) / (2.0 * small);
            // Even terms cancel in the central difference: error of order small², eigenvalues to 1e-14 over 1e-4.
            assert!((numerical - slope).abs() < 1e-8, "{kind}: {numerical} {slope}");
        }
    }
}

#[test]
fn the_penalised_stiffness_gives_the_extension_only_with_the_factor_mu() {
    let wall = DenseWall::potential();
    let (k, h) = (&wall.blocks.stiffness, h());
    let norm = &h * &wall.blocks.solid_mass * &h;
    let sdf = wall.feedback("sdf", 1.0, &half()).view((1, 1), (N, N)).into_owned();
    let mut previous = f64::INFINITY;
    for mu in [1e3, 1e5, 1e7] {
        let printed = (k + &norm * mu).lu().solve(&norm).unwrap();
        let error = (&printed * mu - &sdf).amax();
        // The error falls with 1/μ, the printed form itself vanishes with it.
        assert!(error < 2e-2 * previous.min(1.0) && printed.amax() < 2.0 / mu, "μ = {mu:e}: {error:e}");
        previous = error;
    }
    assert!(previous < 1e-5, "{previous:e}");
}

#[test]
fn a_missing_value_is_a_node_that_is_not_observed() {
    for wall in [DenseWall::potential(), DenseWall::viscous()] {
        let n = 1 + N + wall.blocks.mass.nrows();
        let x: Vec<f64> = random(n, 1, 5).as_slice().to_vec();
        let mut target: Vec<f64> = random(n, 1, 6).as_slice().to_vec();
        target[0] = x[0];
        for kind in STRUCTURAL {
            let part = wall.observer(kind, GAIN, &half());
            let want = wall.corrected(&*part, 0.3, &half(), &wall.show(&half(), &target), &x);
            let mut observed = wall.show(&full(), &target);
            for (row, value) in observed.iter_mut().enumerate() {
                if ![0, 2, 5].contains(&(row % N)) {
                    *value = f64::NAN;
                }
            }
            let whole = wall.observer(kind, GAIN, &full());
            assert_eq!(wall.corrected(&*whole, 0.3, &full(), &observed, &x), want, "{kind}");
            assert_ne!(want, x, "{kind}");
            observed.fill(f64::NAN);
            assert_eq!(wall.corrected(&*whole, 0.3, &full(), &observed, &x), x, "{kind}");
        }
    }
}

#[test]
fn what_is_as_predicted_moves_nothing() {
    let wall = DenseWall::viscous();
    let x: Vec<f64> = random(1 + N + 9, 1, 5).as_slice().to_vec();
    let channels = channels(&["displacement", "velocity", "pressure"]);
    for kind in [&STRUCTURAL[..], &["windkessel"]].concat() {
        let observer = wall.observer(kind, 1e6, &channels);
        // Bitwise: every innovation is exactly zero.
        assert_eq!(wall.corrected(&*observer, 0.1, &channels, &wall.show(&channels, &x), &x), x, "{kind}");
    }
}

#[test]
fn the_windkessel_observer_moves_the_stored_pressure_alone_at_the_gain_times_its_rate() {
    let wall = DenseWall::viscous();
    let channels = channels(&["displacement[1]", "pressure"]);
    let observer = wall.observer("windkessel", 3.0, &channels);
    let feedback = observer.feedback(&wall, &[]);
    // γ/(R_d C) ∂(π + R_p Q)/∂x in the row of π.
    let mut want = DMatrix::zeros(16, 16);
    want[(0, 0)] = 2.1;
    want.view_mut((0, 1 + N), (1, 9)).copy_from(&(&wall.outflow * 2.1));
    // Rounding of 3 × 0.7.
    assert!((feedback - want).amax() < 1e-14);
    let x: Vec<f64> = random(16, 1, 5).as_slice().to_vec();
    let (mut moved, predicted) = (x.clone(), wall.show(&channels, &x)[1]);
    moved[0] += (1.0 - (-0.5 * 2.1_f64).exp()) * (4.0 - predicted);
    let got = wall.corrected(&*observer, 0.5, &channels, &[9.0, 4.0], &x);
    // The same arithmetic but for 1 − e^(−a) in one piece.
    assert!((got[0] - moved[0]).abs() < 1e-14 && got[1..] == moved[1..], "{got:?}");
    assert_eq!(wall.corrected(&*observer, 0.5, &channels, &[9.0, f64::NAN], &x), x);
}

#[test]
fn rows_that_show_one_node_twice_count_with_their_mean() {
    let wall = DenseWall::potential();
    let (twice, once) = (channels(&["displacement[3]", "displacement"]), channels(&["displacement"]));
    let x = vec![0.0; 1 + 2 * N];
    let mut observed = vec![1.0, 0.5, 0.5, 0.5, 3.0, 0.5, 0.5];
    let got = wall.corrected(&*wall.observer("sdf", GAIN, &twice), 0.1, &twice, &observed, &x);
    observed.remove(0);
    observed[3] = 2.0;
    assert_eq!(got, wall.corrected(&*wall.observer("sdf", GAIN, &once), 0.1, &once, &observed, &x));
}

#[test]
fn a_mass_that_is_not_positive_spoils_the_state_for_the_run_to_report() {
    let mut wall = DenseWall::potential();
    wall.blocks.mass = -wall.blocks.mass.clone();
    wall.blocks.stiffness = -wall.blocks.stiffness.clone();
    let x: Vec<f64> = random(1 + 2 * N, 1, 5).as_slice().to_vec();
    for kind in STRUCTURAL {
        let observer = wall.observer(kind, 0.001, &half());
        let got = wall.corrected(&*observer, 0.1, &half(), &[0.0; 6], &x);
        assert!(got.iter().any(|v| v.is_nan()), "{kind}: {got:?}");
    }
}

#[test]
fn an_observer_without_its_channel_is_refused_with_the_output_to_observe() {
    let wall = DenseWall::potential();
    let refusal = |kind: &str, names: &[&str]| match wall.try_observer(kind, 1.0, &channels(names)) {
        Ok(_) => panic!("{kind} on {names:?} was accepted"),
        Err(error) => error.to_string(),
    };
    for kind in ["dvf", "dvf-am"] {
        let error = refusal(kind, &["displacement", "pressure"]);
        assert!(error.contains("needs the output `velocity` observed"), "{error}");
        assert!(error.contains("differentiated") && error.contains("`sdf`"), "{error}");
    }
    for kind in ["sdf", "sdf-displacement", "image-force"] {
        let error = refusal(kind, &["velocity[3]"]);
        assert!(error.contains("needs the output `displacement` observed"), "{error}");
    }
    let error = refusal("windkessel", &["velocity", "displacement"]);
    assert!(error.contains("needs the output `pressure` observed"), "{error}");
}
