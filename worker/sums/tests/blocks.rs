//! Sums of blocks, as workers make them and as they travel.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

use starlings_estimators::inference::{InferenceError, Stream, Sums};
use starlings_models::equations::{EquationsDef, OutputDef, StateDef};
use starlings_models::{Forward, ModelDef, PolynomialDef, Setup, SumsDef};
use starlings_sums::{BlockSums, Question, block, sums_of};

const STEP: f64 = 0.1;

fn setup(levels: u32) -> Setup {
    let state = |name: &str| StateDef {
        name: name.to_owned(),
        initial: "0".to_owned(),
        rate: vec![(name.to_owned(), "0".to_owned())],
        ..StateDef::default()
    };
    let output = OutputDef { name: "y".to_owned(), value: "x".to_owned(), ..OutputDef::default() };
    let equations = EquationsDef {
        states: vec![state("x"), state("z")],
        outputs: vec![output],
        ..EquationsDef::default()
    };
    let sums = SumsDef {
        polynomial: Some(PolynomialDef { degree: 2, constant: true }),
        functions: vec!["sin(t)*z".to_owned(), "sqrt(max(x, 0))".to_owned()],
        left: vec!["sqrt(max(x, 0))".to_owned()],
        step: STEP,
        levels,
        ..SumsDef::default()
    };
    let model = ModelDef { kind: "equations".to_owned(), equations: Some(equations), ..ModelDef::default() };
    Setup { model, sums: Some(Box::new(sums)), ..Setup::default() }
}

fn row(k: usize) -> [f64; 2] {
    let t = k as f64;
    [(0.7 * t).sin() + 0.1 * t.cos(), (0.3 * t).cos()]
}

/// Rows `from..=to` of a recording, of which so many steps start in the block.
fn summed(setup: &Setup, from: usize, n_step: usize, ahead: usize, end: usize) -> Vec<Sums> {
    let rows = from..=(from + n_step + ahead).min(end);
    let times = rows.clone().map(|k| k as f64 * STEP).collect();
    let job = block(0, from as u64, n_step, times, rows.flat_map(row).collect());
    let sums = BlockSums::new(setup).unwrap();
    let prediction = sums.run(&job).unwrap();
    let levels = setup.sums.as_ref().unwrap().levels;
    sums_of(&Question::of(setup).unwrap(), STEP, levels, &prediction.state).unwrap()
}

#[test]
fn blocks_in_order_are_the_whole_recording_at_every_step() {
    let (setup, end) = (setup(3), 1000);
    let ahead = setup.sums.as_ref().unwrap().n_ahead();
    let whole = summed(&setup, 0, end, ahead, end);
    let mut parts: Option<Vec<Sums>> = None;
    for from in (0..end).step_by(137) {
        let part = summed(&setup, from, 137.min(end - from), ahead, end);
        match &mut parts {
            Some(all) => all.iter_mut().zip(&part).for_each(|(all, part)| all.merge(part).unwrap()),
            None => parts = Some(part),
        }
    }
    for (k, (whole, parts)) in whole.iter().zip(&parts.unwrap()).enumerate() {
        assert_eq!(whole.n_step(), parts.n_step(), "level {k}");
        if k == 0 {
            assert_eq!(whole.n_pair(), parts.n_pair(), "pairs at the seams count at the sampling step");
        }
        // A step of 2^k rows starts at every row but the last 2^k.
        assert_eq!(whole.n_step(), end as u64 + 1 - (1 << k));
        let close = (whole.phi() - parts.phi()).amax() / whole.phi().amax();
        assert!(close < 1e-13, "rounding of a thousand sums: {close}");
        assert!((whole.v() - parts.v()).amax() < 1e-10 && (whole.z() - parts.z()).amax() < 1e-9);
    }
}

#[test]
fn sums_of_a_block_are_those_of_a_stream_bit_by_bit() {
    let setup = setup(1);
    let question = Question::of(&setup).unwrap();
    let mut stream = Stream::new(question.basis.clone(), STEP).unwrap();
    (0..=600).for_each(|k| stream.push(k as f64 * STEP, &row(k)).unwrap());
    assert_eq!(summed(&setup, 0, 600, 0, 600)[0], stream.take().unwrap());
}

#[test]
fn numbers_that_are_no_sums_are_refused() {
    let setup = setup(1);
    let question = Question::of(&setup).unwrap();
    let values = summed(&setup, 0, 300, 0, 300)[0].to_values();
    let refused = |values: &[f64]| sums_of(&question, STEP, 1, values).unwrap_err();
    assert!(matches!(refused(&values[1..]), InferenceError::Shape { .. }));
    for (at, value) in [(0, 0.5), (0, -1.0), (0, f64::INFINITY), (1, 1e9), (3, -1.0), (20, f64::NAN)] {
        let mut damaged = values.clone();
        damaged[at] = value;
        assert!(matches!(refused(&damaged), InferenceError::Damaged { .. }), "{value} at {at}");
    }
}

#[test]
fn a_function_without_a_value_is_told_with_the_row_of_the_recording() {
    let mut setup = setup(1);
    setup.sums.as_mut().unwrap().functions.push("log(x)".to_owned());
    let times: Vec<f64> = (500..=600).map(|k| k as f64 * STEP).collect();
    let rows = (500..=600).flat_map(|k| if k == 520 { [-10.0, 0.0] } else { [9.0, 0.0] }).collect();
    let error = BlockSums::new(&setup).unwrap().run(&block(0, 500, 100, times, rows)).unwrap_err();
    // The mid-point of rows 519 and 520 is the first below zero.
    assert_eq!(error.to_string(), "outside the model's domain: log(x) is NaN at row 519");
}
