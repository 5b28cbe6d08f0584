//! An expression of a study: read, its names listed.
#![no_main]

use libfuzzer_sys::fuzz_target;
use starlings_models::equations::Expression;

fuzz_target!(|text: &str| {
    if let Ok(expression) = Expression::parse(text) {
        let _ = expression.names();
    }
});
