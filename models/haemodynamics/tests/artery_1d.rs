//! Waves in arterial networks against closed forms: order of convergence, wave speed, reflection, steady flow.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

mod artery_1d_kit;

use std::f64::consts::PI;

use artery_1d_kit::{QUIET, bifurcation, drive, output, outputs, rate, run, speed, start, theta, tube};
use starlings_haemodynamics::Artery1d;
use starlings_models_core::Model;

/// Writes a rise of the radius around the middle of the first vessel of 25 cm, cut into `n` cells, with the flow for which
/// it travels towards the outlet only: u − 4c is the same everywhere.
fn pulse(model: &Artery1d, theta: &[f64], n: usize, height: f64, width: f64) -> Vec<f64> {
    let mut x = start(model, theta);
    let (n_cell, dx) = (model.spec().states[0].size, 25.0 / n as f64);
    let radius = |s: f64| 1.0 + height * (-0.5 * ((s - 12.5) / width).powi(2)).exp();
    let area = |s: f64| PI * radius(s).powi(2);
    let flow = |s: f64| area(s) * 4.0 * speed() * (radius(s).sqrt() - 1.0);
    for i in 0..n {
        let s = (i as f64 + 0.5) * dx;
        // Gauss' rule for the mean over a cell: grids of all widths start from one function.
        let d = 0.5 * dx * 0.6_f64.sqrt();
        let mean = |f: &dyn Fn(f64) -> f64| (5.0 * f(s - d) + 8.0 * f(s) + 5.0 * f(s + d)) / 18.0;
        x[i] = mean(&area);
        x[n_cell + i] = mean(&flow);
    }
    x
}

/// Means of a fine field over the cells of a coarse one.
fn averaged(fine: &[f64], n: usize) -> Vec<f64> {
    fine.chunks(fine.len() / n).map(|chunk| chunk.iter().sum::<f64>() / chunk.len() as f64).collect()
}

/// Orders in the sum norm between grids, against a finest one, of a field run on each.
fn orders(grids: &[usize], finest: usize, field: impl Fn(usize) -> Vec<f64>) -> Vec<f64> {
    let finest = field(finest);
    let error = |n: usize| {
        let pairs = field(n).into_iter().zip(averaged(&finest, n));
        pairs.map(|(a, b)| (a - b).abs()).sum::<f64>() / n as f64
    };
    let errors: Vec<f64> = grids.iter().map(|&n| error(n)).collect();
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

#[test]
fn a_smooth_pulse_converges_at_second_order_with_and_without_viscosity() {
    for own in [&QUIET[..], &QUIET[..1]] {
        for field in [0, 1] {
            let found = orders(&[100, 200, 400], 3200, |n| {
                let model = tube(n, 1, 1.0);
                let theta = theta(&model, own);
                let mut x = pulse(&model, &theta, n, 0.05, 1.5);
                run(&model, &theta, &mut x, [0.0, 0.008], [0.0, 0.0]);
                x[field * n..(field + 1) * n].to_vec()
            });
            // 1.95, 2.00 without and 1.97, 2.01 with viscosity.
            assert!(found.iter().all(|order| *order > 1.9), "{own:?}, field {field}: {found:?}");
        }
    }
}

#[test]
fn a_driven_tube_of_several_stiffnesses_converges_at_second_order() {
    let found = orders(&[50, 100], 800, |n| {
        let model = tube(n, 5, 0.8);
        let theta = theta(&model, &[("E2", 1e7), ("E4", 3e6), ("p0", 1e5)]);
        let mut x = start(&model, &theta);
        drive(&model, &theta, &mut x, 0..50, 1e-3, &|t| 200.0 * (PI * t / 0.1).sin().powi(2));
        x[..n].to_vec()
    });
    // 2.08; a finest grid eight times as fine adds 0.02 to an order of 2.
    assert!(found.iter().all(|order| *order > 1.9), "{found:?}");
}

/// Where the wave of a field lies: its centre of gravity in the first vessel.
fn centre(field: &[f64], dx: f64) -> f64 {
    let moment = |power: i32| -> f64 {
        field.iter().enumerate().map(|(i, v)| v * ((i as f64 + 0.5) * dx).powi(power)).sum()
    };
    moment(1) / moment(0)
}

#[test]
fn a_small_wave_travels_at_the_speed_of_bramwell_and_hill() {
    let n = 200;
    let model = tube(n, 1, 1.0);
    for (stiffness, density) in [(5e6, 1.06), (8e6, 1.0)] {
        let theta = theta(&model, &[QUIET[0], QUIET[1], QUIET[2], ("E1", stiffness), ("rho_f", density)]);
        let c = (stiffness * 0.2 / (2.0 * density)).sqrt();
        let mut x = pulse(&model, &theta, n, 1e-5, 1.0);
        for q in &mut x[n..2 * n] {
            *q *= c / speed();
        }
        let displacement = |x: &[f64]| -> Vec<f64> { x[..n].iter().map(|a| (a / PI).sqrt() - 1.0).collect() };
        let before = centre(&displacement(&x), 0.125);
        run(&model, &theta, &mut x, [0.0, 0.008], [0.0, 0.0]);
        let found = (centre(&displacement(&x), 0.125) - before) / 0.008;
        // Waves of this height are faster by their height, 1e-5; the grid adds less than a ten-thousandth.
        assert!((found / c - 1.0).abs() < 1e-3, "{found} against {c}");
    }
}

#[test]
fn a_fork_reflects_and_transmits_as_linear_theory_says() {
    let n = 200;
    let model = bifurcation(n);
    let young = [5e6, 4e6, 9e6];
    let own: Vec<(&str, f64)> =
        ["E_aorta", "E_left", "E_right"].into_iter().zip(young).chain(QUIET).collect();
    let theta = theta(&model, &own);
    let mut x = pulse(&model, &theta, n, 1e-5, 1.0);
    let radius = [1.0, 0.7, 0.6];
    // K = E h/((1 − ν²) R0²), c² = K R0/(2ρ), admittance A/(ρc).
    let stiffness: Vec<f64> = young.iter().zip(radius).map(|(e, r)| e * 0.2 / (r * r)).collect();
    let c: Vec<f64> = stiffness.iter().zip(radius).map(|(k, r)| (k * r / 2.12).sqrt()).collect();
    let admittance: Vec<f64> = c.iter().zip(radius).map(|(c, r)| PI * r * r / (1.06 * c)).collect();
    // Sum of the pressure over a vessel.
    let pressure = |x: &[f64], vessel: usize| -> f64 {
        let cells = &x[vessel * n..(vessel + 1) * n];
        cells.iter().map(|a| stiffness[vessel] * ((a / PI).sqrt() - radius[vessel])).sum()
    };
    let sent = pressure(&x, 0);
    run(&model, &theta, &mut x, [0.0, 0.030], [0.0, 0.0]);
    let daughters = admittance[1] + admittance[2];
    let reflection = (admittance[0] - daughters) / (admittance[0] + daughters);
    let found = pressure(&x, 0) / sent;
    // Sums over the wave do not feel what the grid does to its shape; heights of 1e-5 leave the linear theory by as much.
    assert!((found - reflection).abs() < 1e-3 * reflection.abs(), "{found} against {reflection}");
    for vessel in [1, 2] {
        // The wave that goes on is as long as its speed makes it.
        let transmission = (1.0 + reflection) * c[vessel] / c[0];
        let found = pressure(&x, vessel) / sent;
        assert!((found / transmission - 1.0).abs() < 1e-3, "{found} against {transmission}");
    }
}

#[test]
fn a_steady_flow_loses_the_pressure_that_friction_takes() {
    let model = bifurcation(20);
    let theta = theta(
        &model,
        &[("p0", 5e4), ("mu", 0.5), ("R_out_right_leg", 3000.0), ("p_venous", 2e4), ("C_left_leg", 1e-4)],
    );
    let mut x = start(&model, &theta);
    run(&model, &theta, &mut x, [0.0, 10.0], [50.0, 50.0]);
    let flow: f64 = rate(&model, &theta, &x, 50.0).iter().map(|v| v.abs()).fold(0.0, f64::max);
    // Of pressures of 1e5 dyn/cm².
    assert!(flow < 0.1, "not steady: {flow}");
    let y = outputs(&model, &theta, &x, 50.0);
    let out = |name: &str| output(&model, &y, name);
    let (left, right) = (out("outflow_left_leg"), out("outflow_right_leg"));
    // Steady to the tolerance above; the laws of the outlets hold to that of Newton's iterations.
    assert!((left + right - 50.0).abs() < 1e-4, "{left} + {right}");
    assert!((out("outlet_pressure_left_leg") - (2e4 + 2000.0 * left)).abs() < 0.1);
    assert!((out("outlet_pressure_right_leg") - (2e4 + 3000.0 * right)).abs() < 0.1);
    for (vessel, outlet, flow) in [(1, "left_leg", left), (2, "right_leg", right)] {
        let cells = 20 * vessel..20 * (vessel + 1);
        // d(p + ½ρu²)/dx = −8πμ Q/A²; from the middle of the first cell to the outlet, trapezoid by cells.
        let lost = |area: f64| 8.0 * PI * 0.5 * flow / (area * area) * 1.25;
        let drop: f64 = x[cells.clone()].iter().map(|a| lost(*a)).sum::<f64>() - 0.5 * lost(x[cells.start]);
        let total = |area: f64, pressure: f64| pressure + 0.53 * (flow / area).powi(2);
        let last = x[cells.end - 1];
        let found = total(x[cells.start], y[60 + cells.start])
            - total(last, out(&format!("outlet_pressure_{outlet}")));
        // The outlet's area is that of its cell's middle to first order.
        assert!((found / drop - 1.0).abs() < 0.01, "{outlet}: {found} against {drop}");
    }
}

#[test]
fn friction_faster_than_waves_is_stepped_as_steadily() {
    let model = tube(10, 1, 1.0);
    // 8πμ/(ρA) is 4500 per second, and waves cross a cell 560 times; pressure diffuses to rest with a time of 0.5 s.
    let own = [("p0", 5e4), ("p_venous", 5e4), ("E1", 2e7), ("mu", 600.0), ("R_d", 150.0)];
    let theta = theta(&model, &own);
    let mut x = start(&model, &theta);
    run(&model, &theta, &mut x, [0.0, 5.0], [1.0, 1.0]);
    let y = outputs(&model, &theta, &x, 1.0);
    // The faces carry 1; cells differ from it by what the flux takes from a field that is not linear: 0.003 in ten cells.
    assert!(x[10..20].iter().all(|q| (q - 1.0).abs() < 5e-3), "{:?}", &x[10..20]);
    assert!((output(&model, &y, "outflow") - 1.0).abs() < 1e-3, "not steady");
    // Poiseuille's flow from the middle of the first cell to that of the last; at u = 0.3 cm/s p is the total pressure.
    let lost = |area: f64| 8.0 * PI * 600.0 / (area * area) * 2.5;
    let drop = x[..10].iter().map(|a| lost(*a)).sum::<f64>() - 0.5 * (lost(x[0]) + lost(x[9]));
    let found = y[10] - y[19];
    // As the flow above.
    assert!((found / drop - 1.0).abs() < 5e-3, "{found} against {drop}");
}

#[test]
fn a_short_step_follows_the_rate() {
    let model = tube(20, 5, 0.8);
    let theta = theta(&model, &[("E2", 1e7), ("alpha", 1.1), ("k_s", 1e5), ("c_s", 1e3), ("p_ext", 4e3)]);
    let mut x = start(&model, &theta);
    drive(&model, &theta, &mut x, 0..100, 1e-3, &|t| 300.0 * (PI * t / 0.3).sin());
    let flow = 300.0 * (PI / 3.0).sin();
    let (dx, before, h) = (rate(&model, &theta, &x, flow), x.clone(), 1e-8);
    run(&model, &theta, &mut x, [0.0, h], [flow, flow]);
    for field in [0..20, 20..40, 40..41] {
        let scale = dx[field.clone()].iter().map(|v| v.abs()).fold(0.0, f64::max);
        for i in field {
            let found = (x[i] - before[i]) / h;
            // Rates change within h by 1e-4 of themselves at most, differences lose half the digits.
            assert!((found - dx[i]).abs() < 1e-3 * scale, "{i}: {found} against {}", dx[i]);
        }
    }
}
