//! `starlings deploy access`: an access file before its coordinator listens.

use std::path::{Path, PathBuf};

use clap::Parser;
use starlings_coordinator::fleet::access::Access;
use starlings_worker::check_address;

use crate::console::line;
use crate::failure::Failure;

/// Make an access file and its private part before a coordinator listens, for places that are given files and do not share them.
///
/// The coordinator takes the secrets of both when it is started with --access FILE; workers need the access file alone.
#[derive(Parser)]
pub(crate) struct Args {
    /// The access file; the private part stands beside it with the ending `key`.
    file: PathBuf,
    /// Address by which workers will dial the coordinator, HOST:PORT; may be given several times, the likeliest first.
    #[arg(long, value_name = "ADDR", required = true)]
    address: Vec<String>,
    /// Name by which workers speak of the run until they are connected.
    #[arg(long, value_name = "NAME", default_value = "to come")]
    run: String,
}

/// Makes both files.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    for address in &args.address {
        check_address(address).map_err(|error| Failure::input(format!("--address: {error}")))?;
    }
    prepare(&args.file, &args.run, args.address.clone())?;
    line(format_args!("{} and its private part are written", args.file.display()))
}

/// Makes an access file for a coordinator that will be dialled at these addresses.
pub(super) fn prepare(file: &Path, run: &str, addresses: Vec<String>) -> Result<(), Failure> {
    Access::prepare(file, run, addresses)
        .map_err(|fault| if fault.is_input() { Failure::input(fault) } else { Failure::run(fault) })
}
