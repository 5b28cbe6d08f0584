//! `starlings run`: a study, a fleet, a run folder.

use std::net::{SocketAddr, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use clap::Parser;
use starlings_coordinator::fleet::{FleetConfig, FleetEvent, GrpcFleet, LocalConfig, LocalWorkers};
use starlings_coordinator::report;
use starlings_coordinator::study::trial::trial;
use starlings_coordinator::study::{Progress, RunContext, RunFolder, Study, Summary, run as study_run};
use tokio_util::sync::CancellationToken;

use crate::console::{cancel_on_signal, line, note, number, table};
use crate::failure::Failure;
use crate::progress::Display;

/// Estimate the parameters of a study; writes posterior.csv, summary.json and report.html into a run folder.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study file.
    study: PathBuf,
    /// Run folder; runs/NAME-TIME without it.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of local worker processes; what the study says (fleet.workers) without it.
    #[arg(long, value_name = "N", conflicts_with = "listen")]
    workers: Option<usize>,
    /// Wait for workers to dial this address (HOST:PORT, port 0 picks a free one) instead of starting local ones.
    #[arg(long, value_name = "ADDR")]
    listen: Option<String>,
    /// Allow --listen beyond loopback although the connection is neither encrypted nor authenticated.
    #[arg(long)]
    insecure: bool,
    /// Continue an interrupted run in --out from its last stored analysis.
    #[arg(long, requires = "out")]
    resume: bool,
    /// Print the summary as JSON on standard output and nothing else.
    #[arg(long)]
    json: bool,
}

/// Runs the study.
pub(crate) fn run(args: &Args, started: Instant) -> Result<(), Failure> {
    let study = Study::load(&args.study)?;
    let n_worker = args.workers.unwrap_or(study.fleet.workers);
    if n_worker == 0 {
        return Err(Failure::input(
            "--workers must be at least 1 (or use --listen ADDR and start workers elsewhere)",
        ));
    }
    let address = address(args)?;
    trial(&study).map_err(Failure::input)?;
    // Listen before the folder is made: a port in use must leave nothing behind.
    let display = Arc::new(Display::new(args.json));
    let mut crew = Crew::listen(&study, address, &display)?;
    let mut folder = open_folder(args, &study)?;
    if let Some(summary) = folder.summary().map_err(Failure::run)? {
        note(format_args!(
            "the run in {} is finished already; writing its files again",
            folder.path.display()
        ));
        report::write_files(&folder).map_err(Failure::run)?;
        return print(&summary, &folder.path, args.json);
    }
    crew.gather(args, &study, n_worker)?;
    let mut watch = |p: &Progress| display.step(p);
    let clock = move || started.elapsed().as_secs_f64();
    let mut context =
        RunContext { clock: &clock, watch: &mut watch, events: Some(&crew.events), earlier_s: 0.0 };
    let result = study_run::run(&study, &mut crew.fleet, &mut folder, &mut context);
    display.finish();
    crew.dismiss();
    let path = folder.path.display();
    let summary = result.map_err(|error| {
        Failure::run(format!(
            "{error}\n  the run so far is in {path}: continue it with --out {path} --resume"
        ))
    })?;
    report::write_files(&folder).map_err(Failure::run)?;
    print(&summary, &folder.path, args.json)
}

/// Where to listen: a free loopback port for local workers, or what was asked for.
fn address(args: &Args) -> Result<SocketAddr, Failure> {
    let text = args.listen.as_deref().unwrap_or("127.0.0.1:0");
    let address = text.to_socket_addrs().ok().and_then(|mut all| all.next()).ok_or_else(|| {
        Failure::input(format!("--listen {text}: expected HOST:PORT, such as 127.0.0.1:7000"))
    })?;
    if !address.ip().is_loopback() && !args.insecure {
        return Err(Failure::input(format!(
            "{address} is reachable from other machines, and the connection is neither encrypted nor authenticated in \
             this version: listen on 127.0.0.1, or accept it with --insecure on a network you trust"
        )));
    }
    Ok(address)
}

fn open_folder(args: &Args, study: &Study) -> Result<RunFolder, Failure> {
    let stamp = jiff::Timestamp::now().strftime("%Y%m%d-%H%M%S").to_string();
    let path = args.out.clone().unwrap_or_else(|| Path::new("runs").join(format!("{}-{stamp}", study.name)));
    if args.resume {
        return RunFolder::resume(&path, study).map_err(Failure::input);
    }
    let command = std::env::args().skip(1).collect::<Vec<_>>().join(" ");
    RunFolder::create(&path, study, &format!("starlings {command}"), &stamp).map_err(Failure::input)
}

/// The fleet of one run, its local workers, and the way of its events to the store.
struct Crew {
    fleet: GrpcFleet,
    local: Option<LocalWorkers>,
    events: mpsc::Receiver<FleetEvent>,
    watcher: std::thread::JoinHandle<()>,
}

impl Crew {
    /// Listens for workers; none is started yet.
    fn listen(study: &Study, address: SocketAddr, display: &Arc<Display>) -> Result<Self, Failure> {
        let cancel = CancellationToken::new();
        cancel_on_signal(&cancel);
        let (sender, heard) = mpsc::channel();
        let (kept, events) = mpsc::channel();
        let mut config = FleetConfig::new(address, &study.name, cancel, sender);
        if let Some(patience) = study.fleet.patience {
            config.patience = Duration::try_from_secs_f64(patience).map_err(Failure::input)?;
        }
        if let Some(attempts) = study.fleet.max_attempts {
            config.max_attempts = attempts;
        }
        let fleet = GrpcFleet::listen(config).map_err(Failure::run)?;
        let display = Arc::clone(display);
        let watcher = std::thread::spawn(move || relay(heard, &kept, &display));
        Ok(Self { fleet, local: None, events, watcher })
    }

    /// Starts the local workers, or says how to start others.
    fn gather(&mut self, args: &Args, study: &Study, n: usize) -> Result<(), Failure> {
        let address = self.fleet.address();
        if args.listen.is_some() {
            note(format_args!(
                "listening on {address}; start workers with: starlings worker --connect {address}"
            ));
            return Ok(());
        }
        let slots = study.fleet.slots.unwrap_or(1).to_string();
        let config = LocalConfig {
            program: std::env::current_exe().map_err(Failure::run)?,
            args: ["worker", "--slots", &slots].map(str::to_owned).to_vec(),
            n,
            address,
            fleet: self.fleet.handle(),
        };
        self.local = Some(LocalWorkers::spawn(config).map_err(Failure::run)?);
        Ok(())
    }

    /// Ends the fleet and its workers.
    fn dismiss(self) {
        let Self { fleet, local, watcher, .. } = self;
        fleet.close();
        drop(local);
        // The relay ends with the last sender of events; a panic in it has been printed already.
        let _ = watcher.join();
    }
}

/// Shows the events that people should see at once and hands all of them on to the store.
fn relay(heard: mpsc::Receiver<FleetEvent>, kept: &mpsc::Sender<FleetEvent>, display: &Display) {
    for event in heard {
        if event.is_notable() {
            display.say(&event.to_string());
        } else {
            tracing::info!(kind = event.kind(), "{event}");
        }
        if event.is_lasting() {
            // The store stops listening at the end of the run; later events have no reader.
            let _ = kept.send(event);
        }
    }
}

fn print(summary: &Summary, folder: &Path, json: bool) -> Result<(), Failure> {
    if json {
        return line(serde_json::to_string_pretty(summary).map_err(Failure::run)?);
    }
    for warning in &summary.warnings {
        line(format_args!("warning: {warning}"))?;
    }
    let mut rows =
        vec![["parameter", "unit", "estimate", "95 % interval", "prior median"].map(str::to_owned).to_vec()];
    for p in &summary.parameters {
        let [lo, hi] = p.interval95.map(|v| number(v, Some(p.sd)));
        rows.push(vec![
            p.name.clone(),
            p.unit.clone(),
            number(p.estimate, Some(p.sd)),
            format!("{lo} … {hi}"),
            number(p.prior_median, None),
        ]);
    }
    line(format_args!("\n{}", table(&rows, false)))?;
    let shown = |rmse: Option<f64>| rmse.map_or_else(|| "–".to_owned(), |v| number(v, None));
    for c in &summary.fit.channels {
        line(format_args!(
            "{}: RMSE {} on the training span, {} held out (noise {})",
            c.name,
            shown(c.train_rmse),
            shown(c.held_out_rmse),
            number(c.noise, None)
        ))?;
    }
    line(format_args!(
        "{} runs ({} failed, {} retried) on {} worker{} in {:.2} s; NIS {:.2} per observation",
        summary.runs.total,
        summary.runs.failed,
        summary.runs.retried,
        summary.workers,
        if summary.workers == 1 { "" } else { "s" },
        summary.wall_s,
        summary.fit.nis_per_observation
    ))?;
    line(format_args!("report: {}", folder.join("report.html").display()))
}
