//! The tube over heart beats: its periodic state and the error of cells and steps.

mod fsi_tube_kit;

use fsi_tube_kit::{MM_HG, advance, inflow, outputs, periodic, run, tube, values};
use starlings_models_core::Model;

#[test]
fn the_periodic_state_is_the_known_one() {
    let model = tube(25, 1e-3);
    let theta = values(&model, &[]);
    let mut x = periodic(&model, &theta, 1e-3);
    // Half a unit of the last digit printed, everywhere.
    assert!((x[50] / MM_HG - 88.9993).abs() < 5e-5, "pi {}", x[50] / MM_HG);
    assert!((x[0] - 0.084_962_99).abs() < 5e-9, "first cell {}", x[0]);
    assert!((x[24] - 0.240_609_52).abs() < 5e-9, "last cell {}", x[24]);
    let table = [
        (100, [0.116_268_28, 0.222_677_02, 0.300_010_00], 113.535_306_45),
        (200, [0.119_058_00, 0.245_980_27, 0.355_429_80], 133.643_293_12),
        (400, [0.101_713_80, 0.204_339_26, 0.290_756_92], 108.854_175_99),
    ];
    let (mut step, start) = (0, x.clone());
    for (until, eta, pressure) in table {
        while step < until {
            let q = [step, step + 1].map(|i| inflow(f64::from(i) * 1e-3));
            advance(&model, &theta, q, 1e-3, &mut x);
            step += 1;
        }
        for (cell, want) in [0, 12, 24].into_iter().zip(eta) {
            assert!((x[cell] - want).abs() < 5e-9, "step {step}, cell {cell}: {}", x[cell]);
        }
        let y = outputs(&model, &theta, inflow(f64::from(step) * 1e-3), 0.0, &x);
        // The table's solution was found with dense inverses, which cost some digits of a flow.
        assert!((y[50] / MM_HG - pressure).abs() < 1e-7, "step {step}: {}", y[50] / MM_HG);
    }
    for i in step..800 {
        let q = [i, i + 1].map(|i| inflow(f64::from(i) * 1e-3));
        advance(&model, &theta, q, 1e-3, &mut x);
    }
    for (end, start) in x.iter().zip(&start) {
        assert!((end - start).abs() < 1e-10 * start.abs().max(1.0), "the beat closes: {end} {start}");
    }
}

/// Windkessel pressure at the beat's start, outlet pressure and the regions' mean displacement at 0.2 s, of the periodic
/// solution.
fn solution(cells: usize, dt: f64) -> Vec<f64> {
    let model = tube(cells, dt);
    let theta = values(&model, &[]);
    let mut x = periodic(&model, &theta, dt);
    let mut found = vec![x[2 * cells] / MM_HG];
    run(&model, &theta, dt, (0.2 / dt).round() as usize, &mut x);
    found.push(outputs(&model, &theta, inflow(0.2), 0.0, &x)[2 * cells] / MM_HG);
    let region = cells / 5;
    found.extend(x[..cells].chunks(region).map(|eta| eta.iter().sum::<f64>() / region as f64));
    found
}

fn relative(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn a_fine_grid_and_a_short_step_change_the_beat_by_a_hundred_thousandth() {
    let error = relative(&solution(25, 1e-3), &solution(200, 1.25e-4));
    // The largest of seven figures.
    assert!(error < 1e-5, "{error:e}");
    assert!(error > 1e-7, "two resolutions differ: {error:e}");
}

#[test]
fn the_error_falls_with_the_square_of_the_step() {
    let errors: Vec<f64> = {
        let finest = solution(25, 6.25e-5);
        [1e-3, 5e-4, 2.5e-4].map(|dt| relative(&solution(25, dt)[..1], &finest[..1])).into()
    };
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        // Second order; the finest solution's own error shifts it by a few hundredths.
        assert!((1.9..2.15).contains(&order), "{order} from {errors:?}");
    }
}

#[test]
fn a_segment_longer_than_the_layouts_step_is_divided() {
    let model = tube(25, 1e-3);
    let theta = values(&model, &[]);
    let mut whole = vec![0.0; model.spec().n_state()];
    model.initial(&theta, &mut whole);
    let mut pieces = whole.clone();
    advance(&model, &theta, [40.0, 50.0], 0.01, &mut whole);
    for i in 0..10 {
        let q = [i, i + 1].map(|i| 40.0 + f64::from(i));
        advance(&model, &theta, q, 1e-3, &mut pieces);
    }
    for (a, b) in whole.iter().zip(&pieces) {
        // Rounding of the inflow and of the step's length.
        assert!((a - b).abs() < 1e-11 * b.abs().max(1.0), "{a} against {b}");
    }
}
