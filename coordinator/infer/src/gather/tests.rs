//! Blocks and the seams between them, whoever reads the recordings.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use starlings_estimators::inference::Stream;
use starlings_fleet::InProcess;
use starlings_models::equations::{EquationsDef, OutputDef, StateDef};
use starlings_models::{BuildSetup, ModelDef, PolynomialDef, SumsDef};
use starlings_sums::{Reading, factory};

use super::*;
use crate::file_blocks::files;

const STEP: f64 = 0.25;

fn setup(levels: u32, functions: &[&str]) -> Setup {
    let state = StateDef {
        name: "x".to_owned(),
        initial: "0".to_owned(),
        rate: vec![("x".to_owned(), "0".to_owned())],
        ..StateDef::default()
    };
    let output = OutputDef { name: "y".to_owned(), value: "x".to_owned(), ..OutputDef::default() };
    let equations = EquationsDef { states: vec![state], outputs: vec![output], ..EquationsDef::default() };
    let sums = SumsDef {
        polynomial: Some(PolynomialDef { degree: 2, constant: true }),
        functions: functions.iter().map(|f| (*f).to_owned()).collect(),
        step: STEP,
        levels,
        ..SumsDef::default()
    };
    let model = ModelDef { kind: "equations".to_owned(), equations: Some(equations), ..ModelDef::default() };
    Setup { model, sums: Some(Box::new(sums)), ..Setup::default() }
}

fn x(k: usize) -> f64 {
    (0.7 * k as f64).sin()
}

fn text(rows: impl Iterator<Item = usize>) -> String {
    let mut text = "t,x\n".to_owned();
    rows.for_each(|k| writeln!(text, "{:?},{:?}", k as f64 * STEP, x(k)).unwrap());
    text
}

/// Records of these texts in a folder.
fn records(folder: &Path, texts: &[String]) -> Vec<InferRecord> {
    let record = |(k, text): (usize, &String)| {
        let file = folder.join(format!("{k}.csv"));
        std::fs::write(&file, text).unwrap();
        let columns = vec!["x".to_owned()];
        let span = [f64::NEG_INFINITY, f64::INFINITY];
        InferRecord { name: format!("record {k}"), file, time: "t".to_owned(), columns, span }
    };
    texts.iter().enumerate().map(record).collect()
}

struct Case {
    setup: Setup,
    question: Question,
    records: Vec<InferRecord>,
    _folder: tempfile::TempDir,
}

impl Case {
    fn new(levels: u32, functions: &[&str], texts: &[String]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let setup = setup(levels, functions);
        let question = Question::of(&setup).unwrap();
        Self { records: records(folder.path(), texts), setup, question, _folder: folder }
    }

    fn gather(&self, from_files: bool, block: usize, breaks: bool) -> Result<Option<Gathered>, InferError> {
        let sums = self.setup.sums.as_ref().unwrap();
        let ahead = sums.n_ahead();
        self.gather_cut(from_files, Cut { step: STEP, block, bytes: None, ahead, breaks, resample: false })
    }

    fn gather_cut(&self, from_files: bool, cut: Cut) -> Result<Option<Gathered>, InferError> {
        let sums = self.setup.sums.as_ref().unwrap();
        let (setup, question, records) = (&self.setup, &self.question, &self.records[..]);
        let work = Work { setup, question, records, cut, levels: sums.levels };
        let mut fleet = InProcess::new(2).with_factory(factory(Arc::new(Setup::build), Reading::Allowed));
        let found = files(records, cut).unwrap();
        let source = if from_files { Source::Files(&found) } else { Source::Rows };
        work.gather(source, &mut fleet, &mut |_, _, _| {})
    }
}

#[test]
fn workers_that_read_files_give_the_bits_of_rows_that_travel() {
    let texts = [text(0..1000).replace('\n', "\r\n"), text(3..500).trim_end().to_owned()];
    for levels in [1, 3] {
        let case = Case::new(levels, &[], &texts);
        for block in [7, 100, 256, 5000] {
            let rows = case.gather(false, block, false).unwrap().unwrap();
            assert_eq!(case.gather(true, block, false).unwrap().unwrap(), rows, "blocks of {block}");
            assert_eq!(rows.steps, [999, 496]);
            assert_eq!(rows.spans, [[0.0, 999.0 * STEP], [3.0 * STEP, 499.0 * STEP]]);
        }
    }
}

#[test]
fn blocks_by_bytes_have_the_same_bits_whoever_reads_them() {
    let plain = text(0..400);
    let texts = [plain.replace('\n', "\r\n"), plain.trim_end().to_owned(), plain.replace('\n', " \n")];
    for levels in [1, 3] {
        for text in &texts {
            let case = Case::new(levels, &[], &[text.clone(), texts[1].clone()]);
            let ahead = case.setup.sums.as_ref().unwrap().n_ahead();
            // Every place of a cut in a row and at its end, of rows of some 25 bytes.
            for bytes in (200..260).chain([1000, 5000, 100_000]) {
                let cut =
                    Cut { step: STEP, block: 100, bytes: Some(bytes), ahead, breaks: false, resample: false };
                let rows = case.gather_cut(false, cut).unwrap().unwrap();
                let files = case.gather_cut(true, cut).unwrap();
                assert_eq!(files.as_ref(), Some(&rows), "{bytes} bytes, {levels} levels");
                assert_eq!(rows.steps, [399, 399]);
            }
        }
    }
}

#[test]
fn seams_of_blocks_count_and_those_between_records_do_not() {
    let case = Case::new(1, &[], &[text(0..300), text(300..600)]);
    let found = case.gather(false, 50, false).unwrap().unwrap();
    // The second record would follow the first in time.
    assert_eq!(found.levels[0].n_step(), 299 + 299);
    assert_eq!(found.levels[0].n_pair(), 298 + 298);
    let whole = Case::new(1, &[], &[text(0..600)]).gather(false, 50, false).unwrap().unwrap();
    let mut stream = Stream::new(Arc::clone(&case.question.basis), STEP).unwrap();
    (0..600).for_each(|k| stream.push(k as f64 * STEP, &[x(k)]).unwrap());
    let stream = stream.take().unwrap();
    assert_eq!((whole.levels[0].n_step(), whole.levels[0].n_pair()), (stream.n_step(), stream.n_pair()));
    let off = (whole.levels[0].phi() - stream.phi()).amax() + (whole.levels[0].z() - stream.z()).amax();
    assert!(off < 1e-10, "rounding of six hundred sums: {off}");
}

#[test]
fn a_gap_is_no_seam_and_sends_files_back_to_their_reader() {
    let gap = text((0..300).filter(|k| *k != 120));
    let case = Case::new(1, &[], std::slice::from_ref(&gap));
    assert_eq!(case.gather(true, 50, true).unwrap(), None, "whoever parses a block sees one piece only");
    let found = case.gather(false, 50, true).unwrap().unwrap();
    // Pieces of 120 and 179 rows.
    assert_eq!(found.levels[0].n_step(), 119 + 178);
    assert_eq!(found.levels[0].n_pair(), 118 + 177);
    let refused = case.gather(false, 50, false).unwrap_err().to_string();
    assert!(refused.contains("0.csv:122") && refused.contains("jumps"), "{refused}");
}

#[test]
fn a_file_of_other_text_than_plain_rows_is_read_by_the_coordinator() {
    let plain = text(0..300);
    for (from, to) in [("\n25.0,", "\n\n25.0,"), ("\n25.0,", "\n\"25.0\","), ("\n25.0,", "\r25.0,")] {
        let case = Case::new(1, &[], &[plain.replace(from, to)]);
        assert_eq!(case.gather(true, 50, false).unwrap(), None, "{to:?}");
        let found = case.gather(false, 50, false).unwrap().unwrap();
        assert_eq!(found.levels[0].n_step(), 299, "{to:?}");
    }
}

#[test]
fn a_fault_of_the_data_is_told_with_file_and_line() {
    let mut texts = [text(0..300), text(0..300)];
    texts[1] = texts[1].replace("\n25.0,", "\n25.0,-7");
    // An empty line more, which is no row.
    texts[1] = texts[1].replacen('\n', "\n\n", 1);
    let case = Case::new(1, &["sqrt(x + 2)"], &texts);
    assert_eq!(case.gather(true, 50, false).unwrap(), None);
    let told = case.gather(false, 50, false).unwrap_err().to_string();
    // Row 100 stands in line 103; its step and the one before have a mid-point below -2.
    assert!(told.contains("1.csv:102: sqrt(x + 2) is NaN in the step that begins in this row"), "{told}");
    // Steps that are too long by less than a hundredth each, and together by more than a tenth of that.
    let slow: String = text(0..300).lines().enumerate().fold(String::new(), |mut slow, (k, line)| {
        let line = if k == 0 { line.to_owned() } else { format!("{:?},1.5", (k - 1) as f64 * STEP * 1.005) };
        writeln!(slow, "{line}").unwrap();
        slow
    });
    let told = Case::new(1, &[], &[slow]).gather(false, 50, false).unwrap_err().to_string();
    assert!(told.contains("0.csv:") && told.contains("equal steps"), "{told}");
}
