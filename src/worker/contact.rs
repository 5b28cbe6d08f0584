//! How a worker finds its coordinator and knows it: by an access file, plainly, or by a socket that it was started with.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use jiff::SignedDuration;
use starlings_worker::{INHERITED, WorkerConfig, check_address};

use crate::console::note;
use crate::failure::Failure;

/// How long a worker that stays waits for work, where that is not said.
const IDLE: Duration = Duration::from_secs(600);

/// The way to the coordinator.
#[derive(Args)]
pub(crate) struct ContactArgs {
    /// Access file that the coordinator wrote: it has the address, and proves both sides to each other.
    #[arg(long, value_name = "FILE", required_unless_present_any = ["connect", "describe"])]
    access: Option<PathBuf>,
    /// Address of the coordinator, HOST:PORT, instead of those in the access file.
    #[arg(long, value_name = "ADDR")]
    connect: Option<String>,
    /// Dial --connect without an access file: nothing is encrypted, and whoever answers is taken for the coordinator.
    #[arg(long, requires = "connect", conflicts_with = "access")]
    insecure: bool,
    /// When the run is over, wait for the next command that writes the access file and serve it too.
    #[arg(long, requires = "access", conflicts_with = "once")]
    stay: bool,
    /// With --stay, end after so long without work, such as 90s, 10m or 1h30m; 10m without it. Results that a lost coordinator may
    /// not have are kept for --patience at least.
    #[arg(long, value_name = "TIME", value_parser = duration, requires = "stay")]
    idle: Option<Duration>,
}

impl ContactArgs {
    /// What the worker is told of it.
    pub(crate) fn config(&self) -> Result<WorkerConfig, Failure> {
        let connect = self.connect.clone().unwrap_or_default();
        if self.connect.is_some() && !self.is_inherited() {
            check_address(&connect).map_err(|error| Failure::input(format!("--connect: {error}")))?;
        }
        if self.access.is_none() && !self.insecure && !self.is_inherited() {
            return Err(Failure::input(format!(
                "--connect {connect}: without an access file nothing proves the coordinator to this worker, or the worker to it: \
                 give --access FILE, which the coordinator writes and names, or accept a plain connection with --insecure"
            )));
        }
        if self.insecure {
            note(format_args!(
                "warning: --insecure: nothing on the way to {connect} is encrypted, and whoever answers there is taken for the \
                 coordinator and given this machine's computing time"
            ));
        }
        let stay = self.stay.then_some(self.idle.unwrap_or(IDLE));
        Ok(WorkerConfig { access: self.access.clone(), stay, ..WorkerConfig::new(connect) })
    }

    /// Whether a coordinator was named.
    pub(crate) fn is_given(&self) -> bool {
        self.connect.is_some() || self.access.is_some()
    }

    /// Whether it is the process that started this one.
    pub(crate) fn is_inherited(&self) -> bool {
        self.connect.as_deref() == Some(INHERITED)
    }
}

/// A time as people write it.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    let wrong = |_| "expected a time such as 90s, 10m or 1h30m".to_owned();
    let parsed: SignedDuration = text.parse().map_err(wrong)?;
    Duration::try_from(parsed).map_err(|_| "expected a time of zero or more".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_what_people_write() {
        let seconds = |text: &str| duration(text).map(|time| time.as_secs_f64());
        assert_eq!(seconds("90s"), Ok(90.0));
        assert_eq!(seconds("10m"), Ok(600.0));
        assert_eq!(seconds("1h30m"), Ok(5400.0));
        assert_eq!(seconds("1 hour"), Ok(3600.0));
        assert_eq!(seconds("0s"), Ok(0.0));
        for wrong in ["", "10", "-5s", "soon", "1y2"] {
            assert!(duration(wrong).is_err(), "{wrong}");
        }
    }
}
