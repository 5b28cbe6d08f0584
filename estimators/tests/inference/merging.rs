//! Sums of blocks are the sums of the whole.

use std::sync::Arc;

use nalgebra::DMatrix;
use proptest::prelude::*;
use starlings_estimators::inference::{InferenceError, Stream, Sums};

use crate::kit::{lorenz, sums, times};

fn close(a: &DMatrix<f64>, b: &DMatrix<f64>, tolerance: f64) -> bool {
    (a - b).amax() <= tolerance * a.amax()
}

fn same(a: &Sums, b: &Sums, tolerance: f64) -> bool {
    (a.n_step(), a.n_pair(), a.span()) == (b.n_step(), b.n_pair(), b.span())
        && close(&a.phi(), &b.phi(), tolerance)
        && close(&a.z(), &b.z(), tolerance)
        && close(a.v(), b.v(), tolerance)
        && close(&a.q(), &b.q(), tolerance)
        && close(&lagged(a), &lagged(b), tolerance)
}

/// The sums at lag one, which are private, by their text.
fn lagged(sums: &Sums) -> DMatrix<f64> {
    let value = serde_json::to_value(sums).unwrap();
    let (n, m, values): (usize, usize, Vec<f64>) = serde_json::from_value(value["lagged"].clone()).unwrap();
    DMatrix::from_vec(n, m, values)
}

/// A recording in blocks that share one row with the next one.
fn blocks(rows: &[[f64; 3]], h: f64, cuts: &[usize]) -> Vec<Sums> {
    let ends = cuts.iter().copied().chain([rows.len() - 1]);
    let mut from = 0;
    let block = |to: usize| {
        let times = times(rows.len(), h);
        let mut stream = Stream::new(lorenz::basis(), h).unwrap();
        stream.extend(&times[from..=to], rows[from..=to].as_flattened()).unwrap();
        from = to;
        stream.take().unwrap()
    };
    ends.map(block).collect()
}

fn merged<'a>(blocks: impl IntoIterator<Item = &'a Sums>) -> Sums {
    let mut blocks = blocks.into_iter();
    let mut whole = blocks.next().unwrap().clone();
    blocks.for_each(|block| whole.merge(block).unwrap());
    whole
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn blocks_cut_anywhere_merge_to_one_pass(cut in 1_usize..1999, length in 1_usize..400, seed in 0_u64..1000) {
        let h = 0.005;
        let rows = lorenz::strong(seed, 2000, h, 5.0);
        let mut cuts = vec![cut, (cut + length).min(1999)];
        cuts.dedup();
        let whole = sums(&lorenz::basis(), &rows, h);
        let parts = blocks(&rows, h, &cuts);
        // Rounding of sums of 2000 products.
        prop_assert!(same(&whole, &merged(&parts), 1e-12));
        let left = merged(&parts);
        let right = merged([&parts[0], &merged(&parts[1..])]);
        prop_assert!(same(&left, &right, 1e-13), "associative to rounding");
    }
}

#[test]
fn a_stream_that_is_read_in_between_makes_the_same_sums() {
    let h = 0.005;
    let rows = lorenz::strong(3, 1500, h, 5.0);
    let mut stream = Stream::new(lorenz::basis(), h).unwrap();
    let mut parts = Vec::new();
    for (n, row) in rows.iter().enumerate() {
        stream.push(n as f64 * h, row).unwrap();
        if n % 317 == 0 {
            stream.sums().unwrap();
        }
        if n % 500 == 499 {
            parts.push(stream.take().unwrap());
        }
    }
    parts.push(stream.take().unwrap());
    assert!(same(&sums(&lorenz::basis(), &rows, h), &merged(&parts), 1e-12));
}

#[test]
fn a_break_makes_no_step_and_no_pair() {
    let h = 0.005;
    let rows = lorenz::strong(3, 400, h, 5.0);
    let times = times(rows.len(), h);
    let mut stream = Stream::new(lorenz::basis(), h).unwrap();
    stream.extend(&times[..200], rows[..200].as_flattened()).unwrap();
    let jump = stream.push(times[300], &rows[300]).unwrap_err();
    assert!(matches!(jump, InferenceError::TimeJump { row: 200, .. }), "{jump}");
    stream.break_off().unwrap();
    stream.extend(&times[300..], rows[300..].as_flattened()).unwrap();
    let broken = stream.take().unwrap();
    assert_eq!((broken.n_step(), broken.n_pair()), (199 + 100, 198 + 99));
    let halves = [sums(&lorenz::basis(), &rows[..200], h).detach(), sums(&lorenz::basis(), &rows[300..], h)];
    assert!(close(&broken.phi(), &merged(&halves).phi(), 1e-12));
}

#[test]
fn sums_travel_as_text_and_damage_is_found() {
    let rows = lorenz::strong(4, 100, 0.005, 5.0);
    let basis = lorenz::basis();
    let made = sums(&basis, &rows, 0.005);
    let text = serde_json::to_string(&made).unwrap();
    let read: Sums = serde_json::from_str(&text).unwrap();
    assert_eq!(read, made);
    read.check(&basis).unwrap();
    let cut = text.replacen("\"n_function\":9", "\"n_function\":8", 1);
    let damaged: Sums = serde_json::from_str(&cut).unwrap();
    assert_eq!(damaged.check(&basis), Err(InferenceError::Incompatible { what: "their size" }));
    let other = Arc::new(starlings_estimators::inference::Basis::new(3, 0));
    assert_eq!(made.check(&other), Err(InferenceError::Incompatible { what: "their functions" }));
    let coarse = sums(&basis, &rows, 0.01);
    let mut whole = made.clone();
    assert_eq!(whole.merge(&coarse), Err(InferenceError::Incompatible { what: "their step" }));
}
