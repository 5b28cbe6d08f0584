//! How many pairs of steps each block gives: of many blocks its share of those that are kept, or most would be sent and thrown away.
//!
//! Next file to read: `run.rs`.

use starlings_estimators::inference::Pairs;
use starlings_study::infer_choice::InferRecord;

use crate::blocks::{Cut, length};
use crate::run::Asked;

impl Asked<'_> {
    /// Asks every block of these recordings for its share, where their number is known beforehand.
    pub(crate) fn share_pairs(&mut self, records: &[InferRecord], cut: Cut) {
        let Some(n_block) = n_block(records, cut) else { return };
        let share = Pairs::share(self.question.basis.n_channel(), n_block);
        self.question.pairs = share;
        if let Some(sums) = &mut self.setup.sums {
            sums.pairs = Some(share);
        }
    }
}

/// Blocks of all recordings, about, where their files are cut by bytes and taken whole.
fn n_block(records: &[InferRecord], cut: Cut) -> Option<u64> {
    let is_whole = |record: &InferRecord| record.span.iter().all(|end| !end.is_finite());
    let bytes: u64 = records.iter().map(length).sum();
    cut.bytes.filter(|_| records.iter().all(is_whole)).map(|block| bytes.div_ceil(block.max(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_counted_where_files_are_cut_by_bytes_and_taken_whole() {
        let dir = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
        let file = dir.path().join("data.csv");
        std::fs::write(&file, vec![b'0'; 1000]).unwrap_or_else(|error| panic!("{error}"));
        let span = [f64::NEG_INFINITY, f64::INFINITY];
        let record =
            InferRecord { name: "a".to_owned(), file, time: "t".to_owned(), columns: Vec::new(), span };
        let cut = Cut { step: 1.0, block: 10, bytes: Some(300), ahead: 0, breaks: false, resample: false };
        assert_eq!(n_block(&[record.clone(), record.clone()], cut), Some(7));
        assert_eq!(n_block(std::slice::from_ref(&record), Cut { bytes: None, ..cut }), None);
        assert_eq!(n_block(&[record.clone(), InferRecord { span: [0.0, span[1]], ..record }], cut), None);
    }
}
