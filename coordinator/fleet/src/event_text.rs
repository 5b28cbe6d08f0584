//! The fleet's events in words: for the store, the terminal and the report.

use std::fmt;

use super::FleetEvent;

impl fmt::Display for FleetEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Listening { address } => write!(f, "listening on {address}"),
            Self::WorkerJoined { worker, host, pid, slots, cores, .. } => {
                write!(f, "worker {worker} joined from {host} (process {pid}, {slots} slots, {cores} cores)")
            }
            Self::OtherBuild { worker, host, build, own } => {
                write!(
                    f,
                    "worker {worker} on {host} runs another build of this version ({} instead of {}): its results may differ in the \
                     last digits",
                    short(build),
                    short(own)
                )
            }
            Self::SharesStates { worker } => write!(f, "worker {worker} shares the folder for states"),
            Self::WorkerRefused { host, reason } => write!(f, "a worker from {host} was refused: {reason}"),
            Self::CallerRefused { from, reason, count } => f.write_str(&refused(from, reason, *count)),
            Self::WorkerLeft { worker, reason, requeued: 0 } => write!(f, "worker {worker} left: {reason}"),
            Self::WorkerLeft { worker, reason, requeued } => {
                write!(f, "worker {worker} left: {reason}; {requeued} of its runs go to others")
            }
            Self::SetupFailed { worker, reason } => {
                write!(f, "worker {worker} cannot build the model: {reason}")
            }
            Self::WorkerSetAside { worker, reason, seconds } => {
                write!(f, "worker {worker} is set aside for {seconds} s, its runs go to others: {reason}")
            }
            Self::WorkerBack { worker } => write!(f, "worker {worker} makes runs again"),
            Self::ControlRun { .. } | Self::JobRetried { .. } | Self::JobFailed { .. } => runs(self, f),
            Self::RunsBrought { worker, finished, computing } => {
                write!(
                    f,
                    "worker {worker} brought {finished} finished runs along and goes on with {computing}"
                )
            }
            Self::WorkerExcluded { .. }
            | Self::WorkersDiffer { .. }
            | Self::NotReproducible { .. }
            | Self::JobDuplicated { .. }
            | Self::Untold { .. } => comparing(self, f),
            Self::LateAnswer { worker, job } => {
                write!(f, "worker {worker} answered run {job} too late; ignored")
            }
            Self::Waiting { .. } | Self::Progress { .. } => going(self, f),
            Self::LocalWorkerRestarted { .. } | Self::LocalWorkerGivenUp { .. } => local(self, f),
        }
    }
}

/// How a run went that gave no result.
fn runs(event: &FleetEvent, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match event {
        FleetEvent::ControlRun { particle, record, worker, fault } => {
            let found = controlled(fault.as_deref());
            write!(f, "particle {particle}, record {record}: failed again on worker {worker}, {found}")
        }
        FleetEvent::JobRetried { particle, record, worker, reason } => {
            write!(f, "particle {particle}, record {record}: tried again after worker {worker}: {reason}")
        }
        FleetEvent::JobFailed { particle, record, parameters, attempts, reason } => {
            let s = if *attempts == 1 { "" } else { "s" };
            let with = with(parameters);
            write!(
                f,
                "particle {particle}, record {record}{with}: given up after {attempts} attempt{s}: {reason}"
            )
        }
        _ => Ok(()),
    }
}

/// What became of a process that this one started.
fn local(event: &FleetEvent, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match event {
        FleetEvent::LocalWorkerRestarted { pid, reason } => {
            write!(f, "local worker process {pid} ended ({reason}) and was started again")
        }
        FleetEvent::LocalWorkerGivenUp { pid, deaths, reason } => {
            let after = format!("after {deaths} deaths in a row");
            write!(f, "local worker process {pid} ended ({reason}) and is not started again {after}")
        }
        _ => Ok(()),
    }
}

/// How a batch goes on.
fn going(event: &FleetEvent, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match event {
        FleetEvent::Waiting { seconds, missing } => write!(f, "waiting for {seconds:.0} s: {missing}"),
        FleetEvent::Progress { done, total } => write!(f, "{done} of {total} runs"),
        _ => Ok(()),
    }
}

/// What follows from comparing workers, and what was only counted.
fn comparing(event: &FleetEvent, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match event {
        FleetEvent::WorkerExcluded { worker, build, reason, again, earlier } => {
            let build = if build.is_empty() { String::new() } else { format!(" (build {})", short(build)) };
            let earlier = if *earlier == 0 {
                String::new()
            } else {
                format!("; {earlier} of its runs were used before")
            };
            write!(
                f,
                "worker {worker}{build} is put out: {reason}; {again} of its runs are made again{earlier}"
            )
        }
        FleetEvent::WorkersDiffer { what } => {
            write!(f, "workers give different results for one run, which is allowed here: {what}")
        }
        FleetEvent::NotReproducible { what } => {
            write!(
                f,
                "the solver gives another result when it is asked again, so its runs are not compared: {what}"
            )
        }
        FleetEvent::JobDuplicated { particle, record, slow, worker } => {
            write!(
                f,
                "particle {particle}, record {record}: takes long on worker {slow}, given to worker {worker} too"
            )
        }
        FleetEvent::Untold { of, count, last } => {
            write!(f, "{count} more events of the kind {of} were not told one by one; the last: {last}")
        }
        _ => Ok(()),
    }
}

/// Who was refused, and why.
fn refused(from: &str, reason: &str, count: u64) -> String {
    match count {
        1 => format!("a caller from {from} was refused: {reason}"),
        n => format!("{n} callers were refused, last one from {from}: {reason}"),
    }
}

/// What a control run found.
fn controlled(fault: Option<&str>) -> String {
    match fault {
        None => {
            "where a run that is known to work does work: its parameters are at fault unless it works now"
                .to_owned()
        }
        Some(fault) => {
            format!("where a run that is known to work fails too ({fault}): the worker is at fault")
        }
    }
}

/// Parameters that a message lists.
const LISTED: usize = 20;

/// Parameters and their values in brackets.
fn with(parameters: &[(String, f64)]) -> String {
    if parameters.is_empty() {
        return String::new();
    }
    let shown = parameters.iter().take(LISTED).map(|(name, value)| format!("{name} = {value}"));
    let shown = shown.collect::<Vec<_>>().join(", ");
    let more = match parameters.len().saturating_sub(LISTED) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    format!(" ({shown}{more})")
}

/// The first digits of a hash: enough to tell two builds apart.
fn short(hash: &str) -> &str {
    hash.get(..12).unwrap_or(hash)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_job_says_its_attempts_once_and_in_the_right_number() {
        let text = |attempts| {
            let (parameters, reason) = (Vec::new(), "no".to_owned());
            FleetEvent::JobFailed { particle: 1, record: 0, parameters, attempts, reason }.to_string()
        };
        assert_eq!(text(1), "particle 1, record 0: given up after 1 attempt: no");
        assert_eq!(text(2), "particle 1, record 0: given up after 2 attempts: no");
    }

    #[test]
    fn a_failed_job_says_its_parameters_and_of_many_the_first() {
        let text = |n: usize| {
            let parameters = (0..n).map(|i| (format!("p{i}"), i as f64 + 0.5)).collect();
            let reason = "no".to_owned();
            FleetEvent::JobFailed { particle: 1, record: 0, parameters, attempts: 1, reason }.to_string()
        };
        assert_eq!(text(2), "particle 1, record 0 (p0 = 0.5, p1 = 1.5): given up after 1 attempt: no");
        assert!(text(23).contains("p19 = 19.5 and 3 more): given up"), "{}", text(23));
    }
}
