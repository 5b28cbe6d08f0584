//! `starlings deploy`: the workers of a study under an engine that starts and supervises processes.
//!
//! Next files to read: [`order`] for what is asked for, [`submit`], then the crate `deploy`, which has a file per engine.

mod access;
mod kubernetes;
mod order;
mod remove;
mod scale;
mod status;
mod submit;
mod watch;

use clap::{Parser, Subcommand};
use starlings_deploy::DeployError;

use crate::failure::Failure;

/// Start the workers of a study under Slurm or PBS, on a list of machines or in Kubernetes, and ask, keep and remove them.
///
/// The scripts that are submitted stand in a folder, by which a deployment is named afterwards. Workers find their coordinator through
/// the access file, which may be written after them.
#[derive(Parser)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Submit an array of workers to Slurm.
    Slurm(submit::SlurmArgs),
    /// Submit an array of workers to PBS.
    Pbs(submit::PbsArgs),
    /// Start workers on a list of machines over ssh.
    Hosts(submit::HostsArgs),
    /// Write the manifests of a coordinator and its workers for Kubernetes.
    Kubernetes(kubernetes::Args),
    /// Make an access file beforehand, for places that are given it as a secret.
    Access(access::Args),
    /// Say of every process of a deployment where it stands, since when, and why.
    Status(status::Args),
    /// Keep the pool of a deployment: have what the engine starts again started at once, and say what waits and why.
    Watch(watch::Args),
    /// Cancel everything of a deployment and wait until nothing is left.
    Remove(remove::Args),
}

/// Does what was asked for.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    match &args.what {
        What::Slurm(args) => submit::slurm(args),
        What::Pbs(args) => submit::pbs(args),
        What::Hosts(args) => submit::hosts(args),
        What::Kubernetes(args) => kubernetes::run(args),
        What::Access(args) => access::run(args),
        What::Status(args) => status::run(args),
        What::Watch(args) => watch::run(args),
        What::Remove(args) => remove::run(args),
    }
}

impl Args {
    /// Whether standard output holds JSON and nothing else.
    pub(crate) fn prints_json(&self) -> bool {
        matches!(&self.what, What::Status(args) if args.json)
    }
}

fn failed(error: DeployError) -> Failure {
    if error.is_input() { Failure::input(error) } else { Failure::run(error) }
}

/// Seconds since 1970.
fn now() -> i64 {
    jiff::Timestamp::now().as_second()
}
