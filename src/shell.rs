//! `starlings completions` and `starlings manual`: what shells and `man` are told, made of the arguments themselves.

use std::path::PathBuf;

use clap::{CommandFactory, Parser};
use clap_complete::Shell;

use crate::Cli;
use crate::console::text;
use crate::failure::Failure;

/// Print what a shell needs to complete commands and options.
///
/// bash: starlings completions bash > ~/.local/share/bash-completion/completions/starlings
#[derive(Parser)]
pub(crate) struct CompletionsArgs {
    /// The shell.
    shell: Shell,
}

/// Write a page of the manual for every command.
///
/// starlings manual ~/.local/share/man/man1, then: man starlings-run
#[derive(Parser)]
pub(crate) struct ManualArgs {
    /// Folder for the pages.
    dir: PathBuf,
}

/// Prints the script of a shell.
pub(crate) fn completions(args: &CompletionsArgs) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), env!("CARGO_PKG_NAME"), &mut script);
    text(String::from_utf8_lossy(&script))
}

/// Writes the pages.
pub(crate) fn manual(args: &ManualArgs) -> Result<(), Failure> {
    let cannot = |error| Failure::input(format!("cannot write to {}: {error}", args.dir.display()));
    std::fs::create_dir_all(&args.dir).map_err(cannot)?;
    clap_mangen::generate_to(Cli::command(), &args.dir).map_err(cannot)
}
