//! Entrances of the fuzzer, there only for it: readers that are otherwise reached through a solver's program.

use starlings_models::{Quantity, Spec};

use crate::adapter::{command::fuzzing, um_bridge};

/// Reads outputs by a rule out of what a program wrote to its standard output.
pub fn results(rule: &str, written: &str) {
    fuzzing::results(rule, written);
}

/// Reads a template of an input file.
pub fn template(text: &str) {
    fuzzing::template(text);
}

/// Reads two outputs at two times out of the answer of a UM-Bridge server.
pub fn um_bridge_answer(body: &[u8]) {
    let Ok(answer) = serde_json::from_slice(body) else { return };
    let outputs = vec![Quantity::new("tip", "m"), Quantity::new("wall", "m").size(2)];
    let spec = Spec { outputs, ..Spec::default() };
    if let Ok(rows) = um_bridge::rows(&answer, &spec, 2) {
        assert_eq!(rows.len(), 6);
    }
}
