//! The programs of solvers that compute at the moment, by the files in which these say so.

use std::collections::HashSet;
use std::fs;

use rustix::process::{Pid, Signal, kill_process};

use crate::fault_kit::processes;
use crate::fault_kit::study_folder::StudyFolder;

/// Sends a signal to a process; whether it was there.
pub(crate) fn signal(pid: u32, signal: Signal) -> bool {
    Pid::from_raw(pid.cast_signed()).is_some_and(|pid| kill_process(pid, signal).is_ok())
}

/// Stops a program that computes with parameters that no fault has met before; its process. A program that fails twice with the same
/// parameters could not be told from parameters that make it fail.
pub(crate) fn stop_one(place: &StudyFolder, met: &mut HashSet<String>) -> Option<u32> {
    let running = fs::read_dir(place.path("faults")).unwrap().filter_map(Result::ok);
    let pids: Vec<u32> = running
        .filter_map(|entry| entry.file_name().to_str()?.strip_prefix("running.")?.parse().ok())
        .collect();
    let living: HashSet<u32> =
        processes::of(&place.mark()).into_iter().map(|(pid, _)| pid.cast_unsigned()).collect();
    for pid in pids.into_iter().filter(|pid| living.contains(pid)) {
        if !signal(pid, Signal::STOP) {
            continue;
        }
        let parameters =
            fs::read_to_string(place.path("faults").join(format!("running.{pid}"))).unwrap_or_default();
        if parameters.ends_with('\n') && met.insert(parameters) {
            return Some(pid);
        }
        signal(pid, Signal::CONT);
    }
    None
}
