//! What is to be deployed, from the command line: the options that all engines share.

use std::path::{Path, PathBuf};

use clap::Args;
use starlings_deploy::Order;

use crate::failure::Failure;
use crate::load::{is_outside, load_where};
use crate::solvers::own_program;
use crate::worker::duration;

/// Options of every engine.
#[derive(Args)]
pub(crate) struct OrderArgs {
    /// The study file.
    pub(super) study: PathBuf,
    /// Number of workers; on a list of hosts one on each without it.
    #[arg(long, value_name = "N")]
    pub(super) workers: Option<usize>,
    /// Access file by which workers and coordinator find each other; access.json in the folder of the deployment without it. It
    /// need not exist yet.
    #[arg(long, value_name = "FILE")]
    access: Option<PathBuf>,
    /// Runs of one worker at a time; one for every core that it is given without it.
    #[arg(long, value_name = "N")]
    slots: Option<usize>,
    /// A worker ends after so long without work, such as 90s, 10m or 1h30m; also before the coordinator has come.
    #[arg(long, value_name = "TIME", default_value = "10m", value_parser = idle)]
    idle: String,
    /// Folder on the nodes in which each worker makes one for files of runs, and removes it; $TMPDIR or /tmp without it.
    #[arg(long, value_name = "FOLDER")]
    scratch: Option<PathBuf>,
    /// Where this program stands on the nodes; the same place as here without it.
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// Folder for scripts and logs, which the nodes see too; deploy/NAME-TIME without it.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write the folder and say what would be submitted, and submit nothing.
    #[arg(long)]
    pub(super) dry_run: bool,
}

/// A time as `worker --idle` takes it, as it was written.
fn idle(text: &str) -> Result<String, String> {
    duration(text).map(|_| text.to_owned())
}

impl OrderArgs {
    /// The order and the folder for it, with `default` workers where nothing is said. The study is read and checked; no solver is started.
    pub(super) fn order(
        &self,
        is_job: bool,
        options: &[String],
        default: Option<usize>,
        hosts: &[String],
    ) -> Result<(Order, PathBuf), Failure> {
        let workers = self.workers.or(default);
        let workers =
            workers.ok_or_else(|| Failure::input("say with --workers N how many workers there are to be"))?;
        if workers == 0 {
            return Err(Failure::input("--workers must be at least 1"));
        }
        if self.slots == Some(0) {
            return Err(Failure::input("--slots must be at least 1"));
        }
        let study = load_where(&self.study, false)?;
        let stamp = jiff::Timestamp::now().strftime("%Y%m%d-%H%M%S").to_string();
        let default = || Path::new("deploy").join(format!("{}-{stamp}", study.name));
        let folder = absolute(&self.out.clone().unwrap_or_else(default))?;
        let program = match &self.program {
            Some(program) => program.clone(),
            None => own_program().map_err(Failure::run)?,
        };
        let scratch = self.scratch.as_deref().map(absolute).transpose()?;
        let order = Order {
            // Two deployments of one second are told apart by who made them.
            name: Order::name_of(&study.name, &format!("{stamp}-{}", std::process::id())),
            study: absolute(&self.study)?,
            is_solver: is_outside(&study),
            program,
            workers,
            elastic: None,
            slots: self.slots,
            access: absolute(&self.access.clone().unwrap_or_else(|| folder.join("access.json")))?,
            idle: self.idle.clone(),
            scratch,
            run_folder: is_job.then(|| folder.join("run")),
            options: options.to_vec(),
            hosts: hosts.to_vec(),
            ssh: Vec::new(),
            copies_access: false,
            port: None,
        };
        Ok((order, folder))
    }
}

fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    std::path::absolute(path).map_err(|error| Failure::input(format!("{}: {error}", path.display())))
}
