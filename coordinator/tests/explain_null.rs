//! Recordings of a pig's aorta as they would be if nothing were missing: simulated from the fitted two-element model.
//!
//! `cargo test --release -p starlings-coordinator --test explain_null -- --ignored --nocapture` makes a hundred.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout)]

use std::path::Path;

use starlings_coordinator::explain::result::Nulls;
use starlings_coordinator::explain::{Context, Options, explain};
use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::Study;
use starlings_coordinator::study::store::Store;

/// The search on so many recordings without a gap.
fn searched(nulls: usize) -> Nulls {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/pig-aorta/explain.toml");
    let folder = tempfile::tempdir().unwrap();
    let store = Store::create(&folder.path().join("run.db"), &[]).unwrap();
    let mut context = Context { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0 };
    let options = Options { nulls, ..Options::default() };
    let found =
        explain(&Study::load(&example).unwrap(), &mut InProcess::new(2), &store, &mut context, &options);
    found.unwrap_or_else(|error| panic!("{error}")).explanation.false_alarm.nulls.unwrap()
}

#[test]
fn no_effect_is_named_where_the_two_element_model_is_the_truth() {
    let nulls = searched(3);
    assert_eq!((nulls.names, nulls.of), (0, 3));
}

#[test]
#[ignore = "a hundred explanations"]
fn at_most_two_of_a_hundred_null_recordings_get_a_name() {
    let nulls = searched(100);
    println!("{} false names of {}", nulls.names, nulls.of);
    assert!(nulls.names <= 2 && nulls.of == 100, "{nulls:?}");
}
