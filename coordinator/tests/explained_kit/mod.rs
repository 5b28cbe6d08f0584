//! The explanation of a study in this process.
#![allow(missing_docs, unreachable_pub, clippy::unwrap_used)]

use starlings_coordinator::explain::{Context, ExplainError, Explanation, Options, check, explain};
use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::store::Store;

use crate::study_kit::Case;

/// The explanation of a study in this process, after the checks of the command.
pub fn explained(case: &Case) -> Result<Explanation, ExplainError> {
    let (study, path) = (case.study(), case.fresh());
    check(&study, &Options::default())?;
    std::fs::create_dir_all(&path).unwrap();
    let store = Store::create(&path.join("run.db"), &[]).unwrap();
    let mut context = Context { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0 };
    explain(&study, &mut InProcess::new(2), &store, &mut context, &Options::of(&study)).map(|f| f.explanation)
}
