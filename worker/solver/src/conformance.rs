//! What any solver must do so that a study can rely on it: tried out, one check after the other.
//!
//! Every check is a sentence that holds or a reason why it does not. The checks know nothing of the physics: they compare runs
//! with each other. Next files to read: [`mod@trial`] for the run that they vary, [`mod@checks`] for the checks.

mod checks;
mod hosted;
mod refusals;
mod rows;
mod subject;
pub mod trial;

use serde::Serialize;
use starlings_models::{Description, ObserverDef, SolverDef};

use super::{SolverError, Solvers};
use checks::CHECKS;
use subject::{Subject, Verdict};
pub use trial::Trial;

/// What was found.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Conformance {
    /// Names of the checks that hold.
    pub passed: Vec<String>,
    /// Those that do not, with the reason.
    pub failed: Vec<Reason>,
    /// Those that this solver gives no occasion for.
    pub skipped: Vec<Reason>,
}

/// A check and a reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Reason {
    /// The check.
    pub name: String,
    /// One sentence.
    pub reason: String,
}

/// Tries a solver out. `trial` is made from its description where none is given.
///
/// # Errors
/// When it cannot be reached at all, or no run can be made of what is known.
pub fn conformance(
    solvers: &Solvers,
    def: &SolverDef,
    trial: impl FnOnce(&Description) -> Result<Trial, String>,
) -> Result<Conformance, SolverError> {
    let reached = solvers.reach(def)?;
    let description = reached.describe()?;
    let trial = trial(&description).map_err(SolverError::Incomplete)?;
    let subject = Subject {
        solvers,
        def,
        adapter: &*reached.adapter,
        description: &description,
        trial: &trial,
        none: ObserverDef::default(),
    };
    let mut found = Conformance::default();
    let fails = subject.plain().is_err();
    for (i, (name, check)) in CHECKS.into_iter().enumerate() {
        let name = name.to_owned();
        // The first two say why the trial fails; the others would only say it again.
        if fails && i >= 2 {
            found.skipped.push(Reason { name, reason: "the trial itself fails".to_owned() });
            continue;
        }
        match check(&subject) {
            Verdict::Holds => found.passed.push(name),
            Verdict::Fails(reason) => found.failed.push(Reason { name, reason }),
            Verdict::NoOccasion(reason) => found.skipped.push(Reason { name, reason }),
        }
    }
    Ok(found)
}
