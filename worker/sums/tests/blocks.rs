//! Sums of blocks, as workers make them and as they travel.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

use starlings_estimators::inference::{InferenceError, Stream, Sums};
use starlings_models::equations::{EquationsDef, OutputDef, StateDef};
use starlings_models::{Forward, ModelDef, PolynomialDef, Setup, SumsDef, SumsFile};
use starlings_sums::{BlockSums, Bytes, Fault, Question, Reading, answer_of, block, file_block, stamp};

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
    let sums = BlockSums::new(setup, Reading::Refused).unwrap();
    let prediction = sums.run(&job).unwrap();
    let levels = setup.sums.as_ref().unwrap().levels;
    let answer = answer_of(&Question::of(setup).unwrap(), STEP, levels, &prediction.state).unwrap().unwrap();
    let [begin, end] = answer.span;
    assert_eq!((begin, end), (from as f64 * STEP, (from + n_step) as f64 * STEP));
    answer.levels
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
    let sums = [summed(&setup, 0, 300, 0, 300)[0].to_values(), vec![0.0, 30.0]].concat();
    // A hundred and fifty pairs, each of a time and three rows of two values.
    let with = |pairs: Vec<f64>| [sums.clone(), pairs].concat();
    let values = with(vec![0.5; 1050]);
    assert!(answer_of(&question, STEP, 1, &values).is_ok());
    let refused = |values: &[f64]| answer_of(&question, STEP, 1, values).unwrap_err();
    assert!(matches!(refused(&sums[1..]), InferenceError::Shape { .. }));
    for pairs in [vec![], vec![0.5; 1043], vec![0.5; 1049], vec![0.5; 1057], vec![f64::NAN; 1050]] {
        assert!(matches!(refused(&with(pairs)), InferenceError::Damaged { .. }));
    }
    let ends = sums.len() - 1;
    for fault in [[-1.0, 9.0, 0.0, 0.0, 0.0], [-1.0, 1.0, -3.0, 0.0, 0.0], [-1.0, 1.0, 3.0, 0.5, 0.0]] {
        assert!(matches!(refused(&fault), InferenceError::Damaged { .. }), "{fault:?}");
    }
    for (at, value) in [
        (0, 0.5),
        (0, -2.0),
        (ends, f64::NAN),
        (ends, -1.0),
        (0, f64::INFINITY),
        (1, 1e9),
        (3, -1.0),
        (20, f64::NAN),
    ] {
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
    let sums = BlockSums::new(&setup, Reading::Refused).unwrap();
    let answer = sums.run(&block(0, 500, 100, times.clone(), rows)).unwrap();
    let told =
        |values: &[f64]| answer_of(&Question::of(&setup).unwrap(), STEP, 1, values).unwrap().unwrap_err();
    // The mid-point of rows 519 and 520 is the first below zero.
    assert_eq!(told(&answer.state).to_string(), "log(x) is NaN at row 519");
    let (rows, mut late) = ([1.0, 0.0].repeat(101), times.clone());
    late[20] += 0.05 * STEP;
    let Fault::Row(InferenceError::NonUniform { row, .. }) =
        told(&sums.run(&block(0, 500, 100, late, rows.clone())).unwrap().state)
    else {
        panic!("a row out of step is told as one")
    };
    assert_eq!(row, 520);
    let Fault::Row(InferenceError::TimeJump { row, before, time, .. }) = told(
        &sums.run(&block(0, 500, 99, [&times[..7], &times[8..]].concat(), rows[2..].to_vec())).unwrap().state,
    ) else {
        panic!("a missing row is told as one")
    };
    assert_eq!((row, before, time), (507, times[6], times[8]));
}

#[test]
fn rows_of_a_file_give_the_bits_of_rows_that_travel_and_only_where_that_is_allowed() {
    use std::fmt::Write as _;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("rows.csv");
    let mut text = "z,t,note,x\n".to_owned();
    let mut starts = vec![text.len() as u64];
    for k in 0..=600 {
        let [x, z] = row(k);
        writeln!(text, "{z:?},{:?},-,{x:?}", k as f64 * STEP).unwrap();
        starts.push(text.len() as u64);
    }
    std::fs::write(&path, &text).unwrap();
    let mut setup = setup(3);
    let (length, modified) = stamp(&std::fs::File::open(&path).unwrap()).unwrap();
    let path = path.display().to_string();
    let cells = vec![1, 3, 0];
    setup.sums.as_mut().unwrap().files = vec![SumsFile { path, length, modified, n_cell: 4, cells }];
    assert!(BlockSums::new(&setup, Reading::Refused).is_err(), "a worker that may read nothing");
    let sums = BlockSums::new(&setup, Reading::Allowed).unwrap();
    let ahead = setup.sums.as_ref().unwrap().n_ahead();
    let (from, n_step) = (200, 150);
    let n_row = n_step + 1 + ahead;
    let bytes = Bytes { start: starts[from], length: starts[from + n_row] - starts[from], n_row };
    let rows = (from..from + n_row).flat_map(row).collect();
    let times = (from..from + n_row).map(|k| k as f64 * STEP).collect();
    let read = sums.run(&file_block(0, from as u64, n_step, bytes)).unwrap();
    assert_eq!(read, sums.run(&block(0, from as u64, n_step, times, rows)).unwrap());
    let question = Question::of(&setup).unwrap();
    let unread = |bytes: Bytes, record| {
        let answer = sums.run(&file_block(record, 0, n_step, bytes)).unwrap();
        assert_eq!(answer_of(&question, STEP, 3, &answer.state).unwrap(), Err(Fault::Unread));
    };
    unread(Bytes { start: bytes.start + 3, ..bytes }, 0);
    unread(Bytes { n_row: n_row + 1, ..bytes }, 0);
    unread(bytes, 1);
}
