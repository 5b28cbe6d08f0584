//! Spectra under observers against closed forms: modes under every observer, slopes, best gains, a Windkessel.

#![allow(clippy::float_cmp)]

#[path = "spectrum/check.rs"]
mod check;
#[path = "spectrum/structure.rs"]
mod structure;

use check::{close, names};
use nalgebra::{Complex, DMatrix, DVector};
use starlings_models::observer::{self, Wiring};
use starlings_models::spectrum::{
    Beyond, Decay, Energy, Feedback, Follower, GainCurve, ObservedSystem, SpectrumError, linearisation,
    observed, poles, slopes,
};
use starlings_models::{Model, ModelDef, ObserverDef, catalogue};
use structure::{Structure, artery_modes, artery_windkessel, chain};

/// An observer of a model whose outputs are observed as named.
fn build(model: &dyn Model, outputs: &[String], kind: &str, gain: f64) -> Box<dyn observer::Observer> {
    let def = ObserverDef { kind: kind.to_owned(), gain, ..ObserverDef::default() };
    observer::build(
        &def,
        Wiring { spec: model.spec(), outputs, model, theta: &[], native: catalogue::NATIVE },
    )
    .expect("hosted")
}

/// The error of a structure under one observer, in energy coordinates.
fn under(model: &Structure, kind: &str, outputs: &[String]) -> (DMatrix<f64>, ObservedSystem) {
    let energy = Energy::new(&model.blocks(&[]).expect("blocks")).expect("positive definite");
    let a = energy.of(&linearisation(model, &[]).expect("linear"));
    let at =
        |gain| Ok::<_, SpectrumError>(energy.of(&build(model, outputs, kind, gain).feedback(model, &[])));
    let feedback = Feedback::of(at).expect("feedback").expect("a polynomial in the gain");
    let system = ObservedSystem::new(&a, &feedback, 0.0).expect("poles");
    (a, system)
}

fn all() -> Vec<String> {
    names(&["displacement", "velocity", "pressure"])
}

#[test]
fn poles_without_observer_are_the_frequencies_of_the_modes() {
    let model = artery_modes(40);
    let (a, _) = under(&model, "sdf", &all());
    let found = poles(&a).expect("poles");
    // Sine modes of an artery of 10 cm: printed to ten digits.
    let omega = [301.110_657_51, 582.062_647_96, 836.798_907_92, 1_071.648_023_95, 1_296.465_591_14];
    for (pair, omega) in found.chunks(2).zip(omega) {
        for (pole, sign) in pair.iter().zip([-1.0, 1.0]) {
            close(pole.re, 0.0, 1e-9, "real part");
            close(pole.im, sign * omega, 5e-9, "frequency");
        }
    }
    assert_eq!(found.len(), 80);
}

#[test]
fn the_energy_coordinates_and_the_states_own_have_the_same_poles() {
    let model = chain(7);
    let own = poles(&linearisation(&model, &[]).expect("linear")).expect("poles");
    let (a, _) = under(&model, "sdf", &all());
    for (p, q) in own.iter().zip(poles(&a).expect("poles")) {
        // Rounding of the badly scaled matrix.
        assert!((p - q).norm() < 1e-9 * q.norm(), "{p} {q}");
    }
}

#[test]
fn max_re_of_every_observer_of_an_artery_is_the_closed_form() {
    let model = artery_modes(40);
    let gains = [50.0, 100.0, 200.0, 600.0, 1e3, 2e3, 1e4, 5e4, 1e5];
    let slow =
        [-0.36647, -0.73294, -1.46588, -4.39763, -7.32938, -14.65875, -73.29375, -138.62181, -64.70868];
    let fast = [-25.0, -50.0, -100.0, -300.0, -100.83541, -46.41079, -9.07500, -1.81342, -0.90668];
    let table = [("dvf", slow), ("sdf-displacement", slow), ("sdf", fast), ("dvf-am", fast)];
    for (kind, expected) in table {
        let (_, system) = under(&model, kind, &all());
        for (gain, expected) in gains.into_iter().zip(expected) {
            // Printed to five decimals.
            close(system.max_re(gain).expect("poles"), expected, 6e-6, &format!("{kind} at {gain}"));
        }
    }
    let (_, image) = under(&model, "image-force", &all());
    for gain in gains {
        // A spring moves poles along the imaginary axis only; rounding of poles up to 1e5.
        close(image.max_re(gain).expect("poles"), 0.0, 1e-7, "image force");
    }
}

#[test]
fn the_slopes_of_modes_are_half_the_observed_part_of_the_mass() {
    let model = artery_modes(40);
    let part = [-7.329_375_081e-3, -2.582_659_418e-2, -4.874_809_185e-2, -7.129_147_689e-2, -9.158_788_82e-2];
    for (kind, factor) in
        [("dvf", None), ("sdf-displacement", None), ("sdf", Some(-0.5)), ("dvf-am", Some(-0.5))]
    {
        let (a, system) = under(&model, kind, &all());
        let found = slopes(&system, &poles(&a).expect("poles")[..10]).expect("slopes");
        for (i, slope) in found.iter().enumerate() {
            let expected = factor.unwrap_or(part[i / 2]);
            let analytic = slope.analytic.expect("simple pole");
            let numerical = slope.numerical.expect("simple pole");
            // Printed to ten digits; the difference loses some of them to the step.
            close(analytic.re, expected, 2e-11, kind);
            close(numerical.re, expected, 1e-9, kind);
        }
    }
}

#[test]
fn best_gains_saturation_and_the_gain_for_a_decay_of_an_artery() {
    let model = artery_modes(40);
    let (_, sdf) = under(&model, "sdf", &all());
    let curve = GainCurve::scan(&sdf).expect("scan");
    let best = curve.best(&sdf).expect("best");
    // Critical damping of the first mode: 2 ω₁ and −ω₁. The pole has a branch point there, so that its accuracy is the root of
    // that of the gain.
    close(best.gain, 602.221_315, 1e-3, "best gain");
    close(best.max_re, -301.110_66, 1e-1, "best decay");
    assert_eq!(best.beyond, Beyond::Slower);
    close(curve.gain_for(&sdf, best, -25.0).expect("poles").expect("reached"), 50.0, 1e-7, "gain for -25");
    assert_eq!(curve.gain_for(&sdf, best, -302.0).expect("poles"), None, "saturated");

    let (_, dvf) = under(&model, "dvf", &all());
    let curve = GainCurve::scan(&dvf).expect("scan");
    let best = curve.best(&dvf).expect("best");
    // Where the first mode's damping meets the slow root of a later one.
    close(best.max_re, -236.692_58, 1e-4, "best decay");
    close(best.gain, 3.229_37e4, 1.0, "best gain");
    close(
        curve.gain_for(&dvf, best, -25.0).expect("poles").expect("reached"),
        3_410.93,
        0.005,
        "gain for -25",
    );
}

#[test]
fn a_wanted_decay_by_ten_in_a_tenth_of_a_second_is_a_real_part_of_minus_23() {
    close(Decay::new(10.0, 0.1).expect("a decay").max_re(), -23.025_850_929_940_457, 1e-14, "ln 10 / 0.1");
}

#[test]
fn slopes_of_a_coupled_chain_half_observed_are_the_quotients_of_its_modes() {
    let model = chain(8);
    let seen: Vec<usize> = (0..4).collect();
    let outputs: Vec<String> =
        seen.iter().flat_map(|i| [format!("displacement[{i}]"), format!("velocity[{i}]")]).collect();
    let modes = model.modes();
    for kind in ["dvf", "dvf-am", "sdf", "sdf-displacement"] {
        let (a, system) = under(&model, kind, &outputs);
        let listed = poles(&a).expect("poles");
        let found = slopes(&system, &listed).expect("slopes");
        for (i, (omega, mode)) in modes.iter().enumerate() {
            close(listed[2 * i + 1].im, *omega, 1e-9 * omega, "frequency");
            let expected = model.slope(kind, *omega, mode, &seen);
            for slope in &found[2 * i..2 * i + 2] {
                // Rounding of a well scaled matrix, and of differences of its poles.
                close(slope.analytic.expect("simple").re, expected, 1e-11, kind);
                close(slope.numerical.expect("simple").re, expected, 1e-8, kind);
            }
        }
    }
}

#[test]
fn a_windkessel_keeps_its_own_slow_pole_unless_the_wall_itself_is_pulled() {
    let model = artery_windkessel(20);
    let (a, sdf) = under(&model, "sdf", &all());
    let listed = poles(&a).expect("poles");
    let expected = [
        Complex::new(-0.509_840_3, 0.0),
        Complex::new(-120.586_880_3, 144.535_573_6),
        Complex::new(-99.084_830_6, 413.453_237_5),
        Complex::new(-70.917_593_7, 678.650_434_4),
        Complex::new(-51.196_627_1, 927.150_363_3),
    ];
    let upper: Vec<Complex<f64>> = listed.iter().copied().filter(|p| p.im >= 0.0).collect();
    for (found, expected) in upper.iter().zip(expected) {
        assert!((found - expected).norm() < 1e-7, "{found} {expected}");
    }
    let table = [
        ("sdf", [-0.566_428, -1.037_833, -2.540_716, -3.656_797, -4.842_114, -5.840_993, -6.694_876]),
        ("dvf", [-0.509_840, -0.509_840, -0.509_840, -0.509_840, -0.509_840, -0.509_839, -0.509_838]),
        (
            "sdf-displacement",
            [-0.509_840, -0.509_840, -0.509_840, -0.509_840, -0.509_840, -0.509_839, -0.509_838],
        ),
        ("dvf-am", [-0.509_840, -0.509_835, -0.509_813, -0.509_785, -0.509_730, -0.509_618, -0.509_279]),
    ];
    for (kind, expected) in table {
        let (_, system) = under(&model, kind, &all());
        for (gain, expected) in [1.0, 10.0, 50.0, 100.0, 200.0, 400.0, 1e3].into_iter().zip(expected) {
            // Printed to six decimals.
            close(system.max_re(gain).expect("poles"), expected, 6e-7, &format!("{kind} at {gain}"));
        }
    }
    let (_, pi) = under(&model, "windkessel", &all());
    for (gain, expected) in [(1.0, -1.019_415), (10.0, -5.593_358), (50.0, -6.786_210)] {
        close(pi.max_re(gain).expect("poles"), expected, 6e-7, "windkessel");
    }
    let first = [listed[0], listed[2]];
    assert!(first[1].im > 0.0);
    let table = [
        (&sdf, [Complex::new(-0.057_041_568, 0.0), Complex::new(-0.200_596_215, 0.565_564_021)]),
        (&pi, [Complex::new(-0.509_707_558, 0.0), Complex::new(f64::NAN, 0.0)]),
    ];
    for (system, expected) in table {
        for (slope, expected) in slopes(system, &first).expect("slopes").iter().zip(expected) {
            if expected.re.is_nan() {
                continue;
            }
            // Printed to nine decimals.
            assert!((slope.analytic.expect("simple") - expected).norm() < 1e-9, "{slope:?}");
            assert!((slope.numerical.expect("simple") - expected).norm() < 3e-8, "{slope:?}");
        }
    }
}

#[test]
fn without_any_better_gain_the_best_is_none() {
    let model = artery_windkessel(20);
    let (_, dvf) = under(&model, "dvf", &all());
    let best = GainCurve::scan(&dvf).expect("scan").best(&dvf).expect("best");
    assert_eq!((best.gain, best.beyond), (0.0, Beyond::NoGain));
}

#[test]
fn nudging_a_scalar_never_saturates() {
    let model = catalogue::build(&ModelDef { kind: "windkessel-2".to_owned(), ..ModelDef::default() })
        .expect("model");
    let theta = [3.0, 0.1];
    let outputs = names(&["pressure"]);
    let at = |gain: f64| {
        let def = ObserverDef { kind: "nudging".to_owned(), gain, ..ObserverDef::default() };
        let wiring = Wiring {
            spec: model.spec(),
            outputs: &outputs,
            model: &*model,
            theta: &theta,
            native: catalogue::NATIVE,
        };
        observer::build(&def, wiring).map(|o| o.feedback(&*model, &theta))
    };
    let feedback = Feedback::of(at).expect("built").expect("linear");
    let a = linearisation(&*model, &theta).expect("smooth");
    let system = ObservedSystem::new(&a, &feedback, 0.0).expect("poles");
    let curve = GainCurve::scan(&system).expect("scan");
    let best = curve.best(&system).expect("best");
    assert_eq!(best.beyond, Beyond::Faster);
    // −1/(RC) − γ, by differences of a linear rate: the step rounds at 1e-10.
    let found = curve.gain_for(&system, best, -13.0).expect("poles").expect("reached");
    close(found, 13.0 - 1.0 / 0.3, 1e-8, "gain");
}

#[test]
fn a_locus_starts_at_the_poles_and_moves_without_jumps() {
    let model = chain(8);
    let (_, system) = under(&model, "sdf", &names(&["displacement[0]", "displacement[3]"]));
    let gains: Vec<f64> =
        std::iter::once(0.0).chain((0..200).map(|k| 10f64.powf(0.02 * f64::from(k)))).collect();
    let ways = Follower::new(&system).follow(&gains, 16).expect("poles");
    assert_eq!(ways.len(), 16);
    for (k, gain) in gains.iter().enumerate() {
        let mut at: Vec<f64> = ways.iter().map(|way| way[k].norm()).collect();
        let mut expected: Vec<f64> = system.poles(*gain).expect("poles").iter().map(|p| p.norm()).collect();
        at.sort_by(f64::total_cmp);
        expected.sort_by(f64::total_cmp);
        assert_eq!(at, expected, "every pole is on one way at gain {gain}");
    }
    let scale = ways.iter().map(|way| way[0].norm()).fold(0.0, f64::max);
    for way in &ways {
        let jump = way.windows(2).map(|p| (p[1] - p[0]).norm()).fold(0.0, f64::max);
        // Two hundred steps over four decades: a way that changed places would jump by the distance of two modes. Near
        // critical damping poles move as the root of the gain.
        assert!(jump < 0.2 * scale || way[200].norm() > scale, "{jump} of {scale}");
    }
}

#[test]
fn the_matrix_of_the_error_is_a_minus_feedback() {
    let model = chain(3);
    let observer = build(&model, &all(), "sdf", 7.0);
    let found = observed(&model, &[], &*observer).expect("linear");
    let a = linearisation(&model, &[]).expect("linear");
    let difference: DVector<f64> = (a - found).diagonal();
    assert_eq!(difference.as_slice(), [7.0, 7.0, 7.0, 0.0, 0.0, 0.0]);
}
