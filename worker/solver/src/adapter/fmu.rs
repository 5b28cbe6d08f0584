//! A functional mock-up unit (FMI 2 and 3, co-simulation), served by the Python package with fmpy.
//!
//! The command of the study is the file and, after it, options of `python -m starlings.fmu`. Next file to read:
//! [`super::grpc`].

use std::sync::Arc;

use starlings_models::SolverDef;
use starlings_proto::adapters::{AdapterDef, NamedBy};

use super::Adapter;
use super::grpc::Grpc;
use crate::SolverError;
use crate::site::Site;

/// What it says of itself.
pub(crate) const DEF: AdapterDef = AdapterDef {
    name: "fmu",
    says: "a functional mock-up unit, through the Python package and fmpy",
    describes_itself: true,
    per_run: false,
    named_by: NamedBy::Command("the file of the FMU, such as `[\"tank.fmu\"]`"),
    keys: &["described"],
};

/// The Python package with the FMU of the definition.
///
/// # Errors
/// When the study gives no command.
pub(super) fn open(def: &SolverDef, site: &Arc<Site>) -> Result<Box<dyn Adapter>, SolverError> {
    if def.command.is_empty() {
        let message = "an FMU solver needs `command = [\"model.fmu\"]`";
        return Err(SolverError::Incomplete(message.to_owned()));
    }
    let python = def.environment.get(PYTHON).cloned().unwrap_or_else(|| "python3".to_owned());
    let module = ["-m", "starlings.fmu"].map(str::to_owned);
    let command = std::iter::once(python).chain(module).chain(def.command.clone()).collect();
    Ok(Box::new(Grpc::new(def, site, command)?))
}

/// Variable in the solver's environment that names another interpreter, such as that of a virtual environment.
const PYTHON: &str = "STARLINGS_PYTHON";
