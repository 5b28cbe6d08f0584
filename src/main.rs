//! The command line of Starlings: one file per command, nothing here computes.
//!
//! Exit code 0: done; 1: the run failed; 2: the input is wrong; 130: Ctrl-C. With `--json` standard output holds the machine-readable
//! result and nothing else; everything for people goes to standard error. Next file to read: [`run`].

#![allow(clippy::print_stdout, clippy::print_stderr)]

mod check;
mod compare;
mod conformance;
mod console;
mod csv_file;
mod deploy;
mod diagnose;
mod disk;
mod effects;
mod explain;
mod export;
mod failure;
mod fleet_session;
mod fleet_values;
mod forecast;
mod guard;
mod identify;
mod import;
mod infer;
mod init;
mod interrupt;
mod load;
mod log;
mod models;
mod note;
mod plain;
mod progress;
mod replay;
mod report;
mod run;
mod run_folder;
mod serve;
mod shell;
mod simulate;
mod solvers;
mod spectrum;
mod traces;
mod watch;
mod why;
mod worker;

use std::process::ExitCode;
use std::time::Instant;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};

/// Estimates what a simulation does not know, on as many machines as you give it.
///
/// A study file names a forward model, a recording and the uncertain parameters. Every sigma point of the reduced-order
/// unscented Kalman filter is one run of the model on one worker.
#[derive(Parser)]
#[command(name = "starlings", version, max_term_width = 100)]
struct Cli {
    /// More detail on standard error: -v for what the fleet does, -vv for every job.
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,
    /// Form of what goes to standard error: text for people, or a JSON object a line for programs (docs/watching.md).
    #[arg(long = "log", value_name = "FORMAT", global = true, value_enum, default_value_t = log::LogFormat::Text)]
    log: log::LogFormat,
    /// End in order, as at Ctrl-C, when standard input ends: for programs that start this one.
    #[arg(long, global = true)]
    end_with_stdin: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Estimate the parameters of a study and write a run folder.
    Run(run::Args),
    /// Say where a model disagrees with its recordings, name the missing effect, add it and show the gap shrink.
    Explain(explain::Args),
    /// Follow a run in the terminal: by its folder, running or not, or by the address of its live page.
    Watch(watch::Args),
    /// Set runs side by side: settings that differ, parameters, errors, log evidence.
    Compare(compare::Args),
    /// Say why a run, or a parameter, worker, particle or observation of it, is as it is.
    Why(why::Args),
    /// Make a run of a sigma point again, with the inputs that it had, and say whether the bits are the same here.
    Replay(replay::Args),
    /// Validate a study and make one trial run of its model.
    Check(check::Args),
    /// Run the model forward with chosen values and noise: a twin experiment.
    Simulate(simulate::Args),
    /// Write a first version of a study: from a recording, a model, or both.
    Init(init::Args),
    /// Write a study from a file of another program.
    Import(import::Args),
    /// Infer drift and noise of stochastic equations from recordings of all states.
    Infer(infer::Args),
    /// Say whether a recording shows a fault, since when, and which scenario of a library it followed.
    Diagnose(diagnose::Args),
    /// Say whether the estimation is reasonable, before it is made: what these data could determine.
    Identify(identify::Args),
    /// Forecast from a run or an inference: quantiles against time, and when a quantity crosses a level.
    Forecast(forecast::Args),
    /// Show how the poles of the model's error move with the gain of each observer.
    Spectrum(spectrum::Args),
    /// Be a worker: dial a coordinator and run its jobs.
    Worker(worker::Args),
    /// Start the workers of a study under an engine that starts and supervises processes.
    Deploy(deploy::Args),
    /// Try an external solver out: does it do what a study relies on?
    Conformance(conformance::Args),
    /// Serve the model of a study as an external solver.
    Serve(serve::Args),
    /// End the solvers that a dying worker leaves behind; started by workers.
    #[command(hide = true)]
    Guard,
    /// List the built-in models, or describe one.
    Models(models::Args),
    /// List the effects that a model can lack: all built-in ones, or those that would be tried for a study.
    Effects(effects::Args),
    /// Write the result files of a run folder again.
    Report(report::Args),
    /// Write a table of a run folder as CSV.
    Export(export::Args),
    /// Print what a shell needs to complete commands and options.
    Completions(shell::CompletionsArgs),
    /// Write a page of the manual for every command.
    Manual(shell::ManualArgs),
}

fn main() -> ExitCode {
    let started = Instant::now();
    let cli = Cli::try_parse().unwrap_or_else(|error| refuse(&error));
    let json = cli.command.prints_json();
    log::to_stderr(cli.log, cli.verbose);
    if cli.end_with_stdin {
        if let Command::Infer(args) = &cli.command
            && args.follows_standard_input()
        {
            let message = "--end-with-stdin cannot be used with `infer --follow -`: standard input is the recording; follow a file";
            refuse(&Cli::command().error(ErrorKind::ArgumentConflict, message));
        }
        interrupt::at_end_of_stdin();
    }
    let outcome = match cli.command {
        Command::Run(args) => run::run(&args, started),
        Command::Explain(args) => explain::run(&args, started),
        Command::Infer(args) => infer::run(&args),
        Command::Diagnose(args) => diagnose::run(&args),
        Command::Watch(args) => watch::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Why(args) => why::run(&args),
        Command::Replay(args) => replay::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Init(args) => init::run(&args),
        Command::Import(args) => import::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Identify(args) => identify::run(&args),
        Command::Forecast(args) => forecast::run(&args),
        Command::Spectrum(args) => spectrum::run(&args),
        Command::Worker(args) => worker::run(&args),
        Command::Deploy(args) => deploy::run(&args),
        Command::Conformance(args) => conformance::run(&args),
        Command::Serve(args) => serve::run(&args),
        Command::Guard => {
            guard::run();
            Ok(())
        }
        Command::Models(args) => models::run(&args),
        Command::Effects(args) => effects::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Completions(args) => shell::completions(&args),
        Command::Manual(args) => shell::manual(&args),
    };
    // Nothing else drops them: their folders would stay.
    load::end_solvers();
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.print();
            if let Some(error) = failure.as_json().filter(|_| json) {
                // Where nobody reads it, the message stands on standard error.
                let _ = console::line(format_args!("{error:#}"));
            }
            failure.code()
        }
    }
}

/// Ends the program for arguments that make no command, as clap does, with JSON where it is asked for.
fn refuse(error: &clap::Error) -> ! {
    if error.exit_code() != 0 && std::env::args_os().any(|argument| argument == "--json") {
        let text = error.render().to_string();
        let message = text.trim().strip_prefix("error: ").unwrap_or(text.trim());
        let _ = console::line(format_args!("{:#}", serde_json::json!({ "error": message })));
    }
    error.exit()
}

impl Command {
    /// Whether standard output holds JSON and nothing else.
    fn prints_json(&self) -> bool {
        match self {
            Self::Run(args) => args.json,
            Self::Deploy(args) => args.prints_json(),
            Self::Explain(args) => args.json,
            Self::Infer(args) => args.json,
            Self::Diagnose(args) => args.json,
            Self::Watch(args) => args.json,
            Self::Compare(args) => args.json,
            Self::Why(args) => args.json,
            Self::Replay(args) => args.json,
            Self::Check(args) => args.json,
            Self::Init(args) => args.json,
            Self::Import(args) => args.json,
            Self::Identify(args) => args.json,
            Self::Forecast(args) => args.json,
            Self::Spectrum(args) => args.json,
            Self::Conformance(args) => args.json,
            Self::Models(args) => args.json,
            Self::Effects(args) => args.json,
            Self::Report(args) => args.json,
            Self::Simulate(_)
            | Self::Worker(_)
            | Self::Serve(_)
            | Self::Guard
            | Self::Export(_)
            | Self::Completions(_)
            | Self::Manual(_) => false,
        }
    }
}
