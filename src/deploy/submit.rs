//! Submitting a deployment, and looking whether it dies at once.

use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use starlings_deploy::elastic::Limits;
use starlings_deploy::{Deployment, Engine, Hosts, Order, Pbs, Slurm, State};
use starlings_worker::check_address;
use tokio_util::sync::CancellationToken;

use super::order::OrderArgs;
use super::status::last_words;
use super::{access, failed};
use crate::console::{cancel_on_signal, line, note};
use crate::failure::Failure;

/// How long it is looked whether what was submitted dies at once.
const LOOKED_AT: Duration = Duration::from_secs(3);

/// How often in that time.
const TICK: Duration = Duration::from_millis(250);

/// Where the coordinator runs.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Coordinator {
    /// Started by hand, on this machine or another one.
    Here,
    /// A job of its own, whose run folder stands in the folder of the deployment; it goes on where it was when it is started again.
    Job,
}

/// Submit an array of workers to Slurm.
#[derive(Args)]
pub(crate) struct SlurmArgs {
    #[command(flatten)]
    order: OrderArgs,
    /// Where the coordinator runs.
    #[arg(long, value_name = "WHERE", default_value = "here")]
    coordinator: Coordinator,
    /// Let the number of workers follow the work: the least and the most. MIN are submitted; `starlings deploy watch` adds and ends
    /// others while it runs.
    #[arg(long, value_name = "MIN..MAX", conflicts_with = "workers")]
    elastic: Option<Limits>,
    /// Options for sbatch, such as -p PARTITION --time=2:00:00 -c 4.
    #[arg(last = true, value_name = "SBATCH OPTIONS")]
    options: Vec<String>,
}

/// Deploys under Slurm.
pub(crate) fn slurm(args: &SlurmArgs) -> Result<(), Failure> {
    let most = args.elastic.map(|limits| limits.most);
    let is_job = args.coordinator == Coordinator::Job;
    let (mut order, folder) = args.order.order(is_job, &args.options, most, &[])?;
    order.elastic = args.elastic;
    submit(&Slurm, (order, folder), args.order.dry_run, None)
}

/// Submit an array of workers to PBS.
#[derive(Args)]
pub(crate) struct PbsArgs {
    #[command(flatten)]
    order: OrderArgs,
    /// Options for qsub, such as -q QUEUE -l walltime=2:00:00 -l select=1:ncpus=4.
    #[arg(last = true, value_name = "QSUB OPTIONS")]
    options: Vec<String>,
}

/// Deploys under PBS.
pub(crate) fn pbs(args: &PbsArgs) -> Result<(), Failure> {
    let made = args.order.order(false, &args.options, None, &[])?;
    submit(&Pbs, made, args.order.dry_run, None)
}

/// Start workers on a list of machines over ssh.
#[derive(Args)]
pub(crate) struct HostsArgs {
    #[command(flatten)]
    order: OrderArgs,
    /// The machines, as ssh names them; workers go to one after the other.
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', required_unless_present = "hosts_file")]
    hosts: Vec<String>,
    /// File with a machine on each line; what follows a # is not read.
    #[arg(long, value_name = "FILE", conflicts_with = "hosts")]
    hosts_file: Option<PathBuf>,
    /// Address by which the machines reach the coordinator, HOST:PORT: an access file is made now and copied to them. Without it they
    /// must see the file of --access.
    #[arg(long, value_name = "ADDR")]
    address: Option<String>,
    /// The command that reaches a machine, with its options.
    #[arg(long, value_name = "CMD", default_value = "ssh -o BatchMode=yes -o ConnectTimeout=10")]
    ssh: String,
}

/// Deploys on a list of machines.
pub(crate) fn hosts(args: &HostsArgs) -> Result<(), Failure> {
    let hosts = match &args.hosts_file {
        Some(file) => listed(file)?,
        None => args.hosts.clone(),
    };
    let is_plain =
        |host: &String| !host.is_empty() && !host.starts_with('-') && !host.contains(char::is_whitespace);
    if let Some(wrong) = hosts.iter().find(|host| !is_plain(host)) {
        return Err(Failure::input(format!("`{wrong}` is no name of a host")));
    }
    if hosts.is_empty() {
        return Err(Failure::input("the list of hosts is empty"));
    }
    let (mut order, folder) = args.order.order(false, &[], Some(hosts.len()), &hosts)?;
    order.ssh = shell_words::split(&args.ssh).map_err(|error| Failure::input(format!("--ssh: {error}")))?;
    if let Some(address) = &args.address {
        check_address(address).map_err(|error| Failure::input(format!("--address: {error}")))?;
        order.port = address.rsplit_once(':').and_then(|(_, port)| port.parse().ok());
        order.copies_access = true;
    }
    submit(&Hosts, (order, folder), args.order.dry_run, args.address.as_deref())
}

/// The hosts of a file.
fn listed(file: &Path) -> Result<Vec<String>, Failure> {
    let text = std::fs::read_to_string(file)
        .map_err(|error| Failure::input(format!("--hosts-file: cannot read {}: {error}", file.display())))?;
    let names = text.lines().map(|line| line.split('#').next().unwrap_or_default().trim());
    Ok(names.filter(|name| !name.is_empty()).map(str::to_owned).collect())
}

/// Writes a deployment, submits it and says what comes next.
fn submit(
    engine: &'static dyn Engine,
    made: (Order, PathBuf),
    dry_run: bool,
    address: Option<&str>,
) -> Result<(), Failure> {
    let (order, folder) = made;
    let deployment = Deployment::write(engine, order, &folder).map_err(failed)?;
    let shown = folder.display();
    if dry_run {
        line(format_args!("{shown} is written, nothing is submitted; without --dry-run follows"))?;
        return engine
            .commands(&deployment)
            .iter()
            .try_for_each(|command| line(format_args!("  {}", in_shell(command))));
    }
    if let Some(address) = address
        && !deployment.order.access.exists()
    {
        access::prepare(&deployment.order.access, &deployment.order.name, vec![address.to_owned()])?;
    }
    if deployment.order.elastic.is_some() {
        // A coordinator writes into it where it stands.
        let work = starlings_deploy::work::path(&deployment.order.access);
        let written =
            work.parent().map_or(Ok(()), std::fs::create_dir_all).and_then(|()| std::fs::write(&work, ""));
        written.map_err(|error| Failure::input(format!("cannot write {}: {error}", work.display())))?;
    }
    let ask = CancellationToken::new();
    cancel_on_signal(&ask);
    engine.submit(&deployment).map_err(failed)?;
    look(&deployment, &ask)?;
    told(&deployment)
}

fn in_shell(command: &[String]) -> String {
    shell_words::join(command)
}

/// What comes next.
fn told(deployment: &Deployment) -> Result<(), Failure> {
    let order = &deployment.order;
    let folder = shell_words::quote(&deployment.folder.to_string_lossy()).into_owned();
    let tasks = deployment.tasks().unwrap_or_default();
    if let Some(limits) = order.elastic {
        line(format_args!(
            "{limits} workers, as many as the work asks for, are kept by: starlings deploy watch {folder}"
        ))?;
    }
    let running = tasks.iter().filter(|task| task.state == State::Running).count();
    if tasks.is_empty() {
        line(format_args!("submitted {} as {}", plural(order), order.name))?;
    } else {
        line(format_args!(
            "submitted {} as {}: {running} of {} run",
            plural(order),
            order.name,
            tasks.len()
        ))?;
    }
    let waits = tasks.iter().find(|task| task.state == State::Waiting);
    if let Some(says) = waits.and_then(|task| task.says.as_deref()) {
        line(format_args!("the others wait: {says}"))?;
    }
    match &order.run_folder {
        Some(run) => line(format_args!("result:  {}", run.display()))?,
        None => line(format_args!("next:    {}", order.coordinator_command()))?,
    }
    line(format_args!("status:  starlings deploy status {folder}"))?;
    line(format_args!("keep:    starlings deploy watch {folder}"))?;
    line(format_args!("remove:  starlings deploy remove {folder}"))
}

fn plural(order: &Order) -> String {
    let n = order.first().len();
    let workers = format!("{n} worker{}", if n == 1 { "" } else { "s" });
    if order.run_folder.is_some() { format!("a coordinator and {workers}") } else { workers }
}

/// Waits a moment and refuses what died in it: where a script or a node is wrong, all tasks do.
fn look(deployment: &Deployment, ask: &CancellationToken) -> Result<(), Failure> {
    let started = Instant::now();
    while started.elapsed() < LOOKED_AT {
        sleep(TICK);
        if ask.is_cancelled() {
            let message = format!("interrupted; {}", deployment.cancel_rest());
            return Err(Failure::Interrupted { message, code: 130 });
        }
        let tasks = match deployment.tasks() {
            Ok(tasks) => tasks,
            // The submission stands.
            Err(error) => {
                note(format_args!("warning: it is not known whether what was submitted runs: {error}"));
                return Ok(());
            }
        };
        let n_failed = tasks.iter().filter(|task| task.state == State::Failed).count();
        if n_failed == 0 || tasks.iter().any(|task| task.state.is_live() || task.state == State::Unreached) {
            continue;
        }
        let words = last_words(deployment, &tasks);
        // What is left of it would be started for nothing.
        let left = deployment.cancel_rest();
        let says = tasks.iter().find_map(|task| task.says.clone()).unwrap_or_default();
        return Err(Failure::input(format!(
            "all {} tasks died at once ({says}); {left}. Their last lines:\n{words}",
            tasks.len()
        )));
    }
    Ok(())
}
