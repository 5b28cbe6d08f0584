//! `toy-fsi-windkessel`: the slow pole of the outlet beside the damped waves of the vessel.

use nalgebra::{Complex, DVector};
use serde_json::json;
use starlings_models_core::Drive;
use starlings_models_core::limits::Limits;
use starlings_models_core::observer::Correction;
use starlings_models_core::segment::Segment;
use starlings_models_core::spectrum::poles;

use crate::kit::{STORED_PRESSURE, Toy, close, close_relative, nearest};

fn toy() -> Toy {
    Toy::new("toy-fsi-windkessel", json!({ "modes": 20 }), &[])
}

/// Rates at a state, under an inflow and its slope.
fn rates(toy: &Toy, x: &[f64], flow: f64, slope: f64) -> Vec<f64> {
    let mut dx = vec![0.0; x.len()];
    let drive = Drive { value: &[flow], slope: &[slope], ..Drive::NONE };
    toy.model.rhs(0.0, x, &toy.theta, drive, &mut dx);
    dx
}

fn largest_real_part(toy: &Toy, feedbacks: &[(&str, f64)]) -> f64 {
    let gamma = feedbacks.iter().map(|&(kind, gain)| toy.feedback(kind, gain));
    let matrix = gamma.fold(toy.linearisation(), |a, gamma| a - gamma);
    let poles = poles(&toy.natural(&matrix)).unwrap();
    poles.iter().map(|p| p.re).fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn the_slow_pole_and_the_waves_are_those_of_the_table() {
    let poles = toy().poles();
    let table = [
        (-0.509_840_3, 0.0),
        (-120.586_880_3, 144.535_573_6),
        (-99.084_830_6, 413.453_237_5),
        (-70.917_593_7, 678.650_434_4),
        (-51.196_627_1, 927.150_363_3),
    ];
    let first: Vec<&Complex<f64>> = poles.iter().filter(|p| p.im >= 0.0).take(5).collect();
    for (found, (re, im)) in first.iter().zip(table) {
        // Printed to seven digits behind the point.
        assert!((found.re - re).abs() < 5.1e-8 && (found.im - im).abs() < 5.1e-8, "{found} for {re} {im}i");
    }
}

#[test]
fn the_volume_of_the_vessel_adds_to_the_compliance_of_the_windkessel() {
    let toy = toy();
    // Inflated by p_0, the vessel holds Cᵥ p_0; Sᵀ d is the rate of π under a velocity d, times −C.
    let n = 20;
    let mut inflated = vec![0.0; 2 * n + 1];
    toy.model.initial(&toy.theta, &mut inflated);
    let (pressure, compliance) = (inflated[2 * n], toy.theta[11]);
    inflated.copy_within(0..n, n);
    inflated[2 * n] = 0.0;
    let volume = -compliance * rates(&toy, &inflated, 0.0, 0.0)[2 * n];
    close_relative(&[volume / pressure], &[5.993_994_321_5e-5], 1e-10, "Cv");
}

#[test]
fn slopes_of_the_slow_pole_and_of_the_first_wave_are_those_of_the_table() {
    let toy = toy();
    let all = toy.poles();
    let slow = nearest(&all, Complex::new(-0.51, 0.0));
    let wave = nearest(&all, Complex::new(-120.6, 144.5));
    for (kind, of_slow, re, im) in [
        ("sdf", -0.057_041_568, -0.200_596_215, 0.565_564_021),
        ("dvf", 2e-9, -0.003_410_529, -0.000_790_576),
        ("dvf-am", 5.5e-7, -0.778_698_713, -0.608_399_941),
        (STORED_PRESSURE, -0.509_707_558, -0.011_191_931, 0.023_154_551),
    ] {
        let slopes = toy.slopes(kind, &[slow, wave]);
        // Printed to nine digits behind the point.
        close(&[slopes[0].re, slopes[0].im], &[of_slow, 0.0], 5.1e-10, kind);
        close(&[slopes[1].re, slopes[1].im], &[re, im], 5.1e-10, kind);
    }
}

#[test]
fn the_largest_real_parts_are_those_of_the_table() {
    let gains = [0.0, 1.0, 10.0, 50.0, 100.0, 200.0, 400.0, 1e3];
    let toy = toy();
    let velocity = [-0.509840, -0.509840, -0.509840, -0.509840, -0.509840, -0.509840, -0.509839, -0.509838];
    for (kind, table) in [
        ("sdf", [-0.509840, -0.566428, -1.037833, -2.540716, -3.656797, -4.842114, -5.840993, -6.694876]),
        ("dvf", velocity),
        ("sdf-displacement", velocity),
        ("dvf-am", [-0.509840, -0.509840, -0.509835, -0.509813, -0.509785, -0.509730, -0.509618, -0.509279]),
    ] {
        toy.holds_max_re(kind, &gains, &table, 5.1e-7);
    }
}

#[test]
fn with_the_stored_pressure_measured_the_slow_pole_goes_and_the_waves_need_company() {
    let toy = toy();
    toy.holds_max_re(STORED_PRESSURE, &[1.0, 10.0, 50.0], &[-1.019415, -5.593358, -6.786210], 5.1e-7);
    for (gain, expected) in [(10.0, -10.26551), (100.0, -58.943442), (1e3, -106.86312)] {
        let found = largest_real_part(&toy, &[("sdf", 200.0), (STORED_PRESSURE, gain)]);
        close(&[found], &[expected], 5.1e-6, "sdf and windkessel");
    }
    // By the observers' own lists of digits.
    for (gain, expected) in [(10.0, -5.578257), (100.0, -45.852373), (1e3, -70.454836)] {
        let found = largest_real_part(&toy, &[("dvf-am", 200.0), (STORED_PRESSURE, gain)]);
        close(&[found], &[expected], 5.1e-7, "dvf-am and windkessel");
    }
}

#[test]
fn the_outlet_pressure_in_place_of_the_stored_one_is_weaker_by_the_models_own_flow() {
    let toy = toy();
    // From the matrices written out mode by mode, with γ/(R_d C) (1, −R_p S) in the row of π.
    toy.holds_max_re("windkessel", &[1.0, 10.0, 50.0], &[-1.024149, -5.875694, -6.765649], 5.1e-7);
    for (gain, expected) in [(10.0, -6.760998), (50.0, -14.337826), (100.0, -23.637239)] {
        let found = largest_real_part(&toy, &[("sdf", 200.0), ("windkessel", gain)]);
        close(&[found], &[expected], 5.1e-7, "sdf and windkessel");
    }
}

/// The state error of a run with corrections every `dt` by sdf and windkessel, from a wrong state until `end`.
fn error_of_a_run(
    toy: &Toy,
    start: &DVector<f64>,
    feedbacks: &[(&str, f64)],
    end: f64,
    n: usize,
) -> DVector<f64> {
    let dt = end / n as f64;
    let observers: Vec<_> = feedbacks.iter().map(|&(kind, gain)| toy.observer(kind, gain)).collect();
    let (mut x, mut predicted) = (start.clone(), vec![0.0; start.len()]);
    let (rest, spans) = (vec![0.0; start.len()], vec![dt; start.len()]);
    for step in 0..n {
        let t0 = step as f64 * dt;
        let (u0, slope, history) = (&[0.0][..], &[0.0][..], Drive::NONE.history);
        let segment = Segment { t0, t1: t0 + dt, u0, slope, history, limits: &Limits::none(), noise: None };
        toy.model.advance(segment, &toy.theta, x.as_mut_slice()).unwrap();
        let drive = Drive { value: u0, slope, ..Drive::NONE };
        toy.model.output(t0 + dt, x.as_slice(), &toy.theta, drive, &mut predicted);
        for observer in &observers {
            let (t, model, theta) = (t0 + dt, &*toy.model, &toy.theta[..]);
            let at = Correction { t, spans: &spans, observed: &rest, predicted: &predicted, model, theta };
            observer.correct(at, x.as_mut_slice());
        }
    }
    x
}

#[test]
fn a_run_under_the_windkessel_observer_follows_its_feedback_and_not_that_of_the_stored_pressure() {
    let toy = Toy::new("toy-fsi-windkessel", json!({ "modes": 6 }), &[]);
    let mut start = vec![0.0; 13];
    toy.model.initial(&toy.theta, &mut start);
    let (start, end) = (DVector::from_vec(start), 0.05);
    let closed = |outlet: &str| {
        let feedback = toy.feedback("sdf", 200.0) + toy.feedback(outlet, 50.0);
        ((toy.linearisation() - feedback) * end).exp() * &start
    };
    let (want, theory) = (closed("windkessel")[12], closed(STORED_PRESSURE)[12]);
    let feedbacks = [("sdf", 200.0), ("windkessel", 50.0)];
    let [coarse, fine] =
        [4000, 8000].map(|n| (error_of_a_run(&toy, &start, &feedbacks, end, n)[12] - want).abs());
    // Steps of first order: halved with the step.
    assert!((coarse / fine - 2.0).abs() < 0.05, "{coarse:e} {fine:e}");
    assert!(fine < 0.01 * (theory - want).abs(), "{fine:e}, {want} and {theory}");
}

#[test]
fn a_constant_inflow_ends_in_rest_at_the_pressure_of_both_resistances() {
    let toy = toy();
    let (n, flow) = (20, 60.0);
    let (proximal, distal, compliance) = (toy.theta[9], toy.theta[10], toy.theta[11]);
    let pressure = flow * (proximal + distal);
    let mut theta = toy.theta.clone();
    theta[12] = pressure;
    let mut x = vec![0.0; 2 * n + 1];
    toy.model.initial(&theta, &mut x);
    x[2 * n] = distal * flow;
    let dx = rates(&toy, &x, flow, 0.0);
    // Forces of 1e5 over masses of 1 cancel up to rounding.
    assert!(dx[..2 * n].iter().all(|v| v.abs() < 1e-8), "{dx:?}");
    assert!(dx[2 * n].abs() < 1e-9 * flow / compliance, "{dx:?}");
    let mut y = vec![0.0; 2 * n + 1];
    let drive = Drive { value: &[flow], slope: &[0.0], ..Drive::NONE };
    toy.model.output(0.0, &x, &theta, drive, &mut y);
    close_relative(&y[2 * n..], &[pressure], 1e-13, "outlet pressure");
}

#[test]
fn an_inflow_that_starts_from_rest_loads_the_wall_with_the_pressure_of_a_rigid_channel() {
    let n = 200;
    let toy = Toy::new("toy-fsi-windkessel", json!({ "modes": n }), &[]);
    let dx = rates(&toy, &vec![0.0; 2 * n + 1], 0.0, 1.0);
    let load = toy.blocks().mass * nalgebra::DVector::from_column_slice(&dx[n..2 * n]);
    let (length, radius, density) = (toy.theta[0], toy.theta[1], toy.theta[6]);
    let spacing = length / n as f64;
    for j in 0..n {
        let x = (j as f64 + 0.5) * spacing;
        // ρf (L − x)/(2πR · R) on the perimeter 2πR; modes beyond the 200th hold back a few thousandths of its peak.
        let expected = density * (length - x) / radius * spacing;
        let off = (load[j] - expected).abs() / (density * length / radius * spacing);
        assert!(off < 3e-3, "node {j}: {} for {expected}", load[j]);
    }
}
