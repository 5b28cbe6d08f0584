//! The Python package, where `.ci/solvers` has installed it or the system has it.

use std::process::Command;

use super::repository;

/// Where `python3` has the package, first.
pub(crate) fn path() -> String {
    let own = repository("target/solvers/bin");
    let rest = std::env::var("PATH").unwrap_or_default();
    if own.join("python3").exists() { format!("{}:{rest}", own.display()) } else { rest }
}

/// Whether the Python package is there.
pub(crate) fn has_python() -> bool {
    let asked = Command::new("python3").args(["-c", "import starlings, grpc"]).env("PATH", path()).output();
    asked.is_ok_and(|asked| asked.status.success())
}
