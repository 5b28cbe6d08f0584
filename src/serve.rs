//! `starlings serve`: the model of a study as an external solver, in a process of its own.

use std::path::PathBuf;

use clap::Parser;
use starlings_coordinator::study::Study;
use starlings_solver::instance::SOCKET;
use starlings_solver::serve::{Served, serve};

use crate::failure::Failure;

/// Serve the model of a study as an external solver, where STARLINGS_SOLVER_SOCKET says.
///
/// For trying out the protocol between workers and solvers, and as a solver to compare another one with.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study whose model is served; its data and priors are not looked at.
    study: PathBuf,
}

/// Serves until the worker that started this process ends.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let study = Study::load(&args.study).map_err(Failure::input)?;
    let Some(socket) = std::env::var_os(SOCKET) else {
        return Err(Failure::input(format!(
            "{SOCKET} does not name a Unix socket: a worker sets it; name this command as the `command` of a study"
        )));
    };
    if !study.setup.effects.is_empty() {
        let message =
            "the study adds effects to its model, which a solver would not know: serve a study without any";
        return Err(Failure::input(message));
    }
    let served = Served::new(study.setup.model).map_err(Failure::input)?;
    if std::env::var_os(starlings_worker::LIFELINE).is_some() {
        std::thread::spawn(|| {
            // Ends with the worker, whose end of the pipe closes.
            let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
            std::process::exit(0);
        });
    }
    serve(served, &PathBuf::from(socket)).map_err(Failure::run)
}
