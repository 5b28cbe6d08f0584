//! What a worker makes of a block of a recording's file: rows per second read, parsed and summed, and summed alone.
//!
//! `cargo bench -p starlings-sums --bench file_blocks` prints the quickest of many repeats for the 27 coefficients of quadratic equations
//! of three states, numbers of 16 to 18 digits. No time is asserted.

#![allow(clippy::print_stdout, clippy::print_stderr, missing_docs)]

use std::fmt::Write as _;
use std::fs::File;
use std::hint::black_box;
use std::process::ExitCode;
use std::time::Instant;

use starlings_models::equations::{EquationsDef, OutputDef, StateDef};
use starlings_models::{Forward, Job, ModelDef, PolynomialDef, Setup, SumsDef, SumsFile};
use starlings_sums::{BlockSums, Bytes, Reading, block, file_block, stamp};

type Failure = Box<dyn std::error::Error>;

/// Rows of the block, and repeats.
const N_ROW: usize = 4_097;
const REPEATS: usize = 1_000;
const STEP: f64 = 0.005;

fn main() -> ExitCode {
    if let Err(error) = run() {
        eprintln!("benchmark: {error}");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

fn setup(file: SumsFile) -> Setup {
    let state = |name: &&str| StateDef {
        name: (*name).to_owned(),
        initial: "0".to_owned(),
        rate: vec![((*name).to_owned(), "0".to_owned())],
        ..StateDef::default()
    };
    let output = OutputDef { name: "y".to_owned(), value: "x1".to_owned(), ..OutputDef::default() };
    let states = ["x1", "x2", "x3"].iter().map(state).collect();
    let equations = EquationsDef { states, outputs: vec![output], ..EquationsDef::default() };
    let polynomial = Some(PolynomialDef { degree: 2, constant: false });
    let sums = SumsDef { polynomial, step: STEP, levels: 1, files: vec![file], ..SumsDef::default() };
    let model = ModelDef { kind: "equations".to_owned(), equations: Some(equations), ..ModelDef::default() };
    Setup { model, sums: Some(Box::new(sums)), ..Setup::default() }
}

fn run() -> Result<(), Failure> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("rows.csv");
    let (mut text, mut times, mut rows) = (String::new(), Vec::new(), Vec::new());
    for k in 0..N_ROW {
        let (t, a) = (k as f64 * STEP, k as f64);
        let x = [(0.7 * a).sin() * 9.0, (0.3 * a).cos() * 11.0, 20.0 + (0.1 * a).sin() * 15.0];
        writeln!(text, "{t:?},{:?},{:?},{:?}", x[0], x[1], x[2])?;
        times.push(t);
        rows.extend(x);
    }
    std::fs::write(&path, &text)?;
    let (length, modified) = stamp(&File::open(&path)?).ok_or("the file has no time of change")?;
    let (path, cells) = (path.display().to_string(), vec![0, 1, 2, 3]);
    let sums =
        BlockSums::new(&setup(SumsFile { path, length, modified, n_cell: 4, cells }), Reading::Allowed)?;
    let bytes = Bytes { start: 0, length, n_row: N_ROW };
    let of_file = rate(&sums, &file_block(0, 0, N_ROW - 1, bytes))?;
    let of_rows = rate(&sums, &block(0, 0, N_ROW - 1, times, rows))?;
    println!(
        "read, parsed and summed  {of_file:5.1} million rows/s, {:.0} MB/s",
        of_file * length as f64 / N_ROW as f64
    );
    println!("summed                   {of_rows:5.1} million rows/s");
    Ok(())
}

/// Million rows per second of the quickest repeat.
fn rate(sums: &BlockSums, job: &Job) -> Result<f64, Failure> {
    let mut quickest = f64::INFINITY;
    for _ in 0..REPEATS {
        let begun = Instant::now();
        let found = black_box(sums.run(black_box(job)))?;
        quickest = quickest.min(begun.elapsed().as_secs_f64());
        if found.state.len() < 100 {
            return Err("the block was not read".into());
        }
    }
    Ok(N_ROW as f64 / quickest / 1e6)
}
