//! Programs that left the process group of the solver that started them: found and ended all the same.
//!
//! A worker adopts the orphans among its descendants (`PR_SET_CHILD_SUBREAPER`), so that one whose parent ended becomes its child and
//! is found among its children; every program carries the mark of the run of the solver that it descends from in its environment. One
//! whose solver has ended is killed, and every orphan that ended is reaped. Where a worker is killed its guard looks for the
//! mark among all processes. A program that clears its environment is ended when no solver is left. Next file to read:
//! [`super::process`].

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::process::{Child, Command};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rustix::process::{Pid, Signal, WaitOptions, kill_process, set_child_subreaper, waitpid};

/// The variable with the mark.
const MARK: &str = "STARLINGS_DESCENT";

/// Rounds of ending orphans and those that become orphans by that.
const ROUNDS: usize = 16;

/// How often, and after how long each time, it is looked whether a killed process has ended.
const LOOKS: u32 = 50;
const LOOK: Duration = Duration::from_millis(2);

/// Whether this process adopts orphans: then all its children are started here.
static ADOPTS: AtomicBool = AtomicBool::new(false);

/// The children that were started here and are not reaped, with their marks.
static CHILDREN: Mutex<BTreeMap<i32, String>> = Mutex::new(BTreeMap::new());

/// Has this process adopt the orphans among its descendants. For a process that starts no others than solvers.
///
/// # Errors
/// When the system does not let it.
pub fn adopt_orphans() -> io::Result<()> {
    set_child_subreaper(Pid::from_raw(1))?;
    ADOPTS.store(true, Ordering::Release);
    Ok(())
}

/// The beginning of the marks of this process.
pub(crate) fn marks_here() -> String {
    format!("{}-", std::process::id())
}

fn children() -> MutexGuard<'static, BTreeMap<i32, String>> {
    CHILDREN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts a program with a mark of its own.
pub(crate) fn start(command: &mut Command) -> io::Result<Child> {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let mark = format!("{}{}", marks_here(), NEXT.fetch_add(1, Ordering::Relaxed));
    // Whoever looks for orphans must not find a child that is not noted yet.
    let mut children = children();
    let child = command.env(MARK, &mark).spawn()?;
    children.insert(child.id().cast_signed(), mark);
    Ok(child)
}

/// A child that was started here is about to be reaped.
pub(crate) fn forget(child: i32) {
    children().remove(&child);
}

/// Ends the orphans of solvers that have ended, and reaps those that ended.
pub(crate) fn end_orphans() {
    if !ADOPTS.load(Ordering::Acquire) {
        return;
    }
    for _ in 0..ROUNDS {
        // Held, so that no child is started meanwhile.
        let known = children();
        let orphans = own_children().into_iter().filter(|pid| !known.contains_key(pid));
        let mut ended = 0;
        for pid in orphans.filter_map(Pid::from_raw) {
            let mark = mark_of(pid.as_raw_nonzero().get());
            let lives = mark.as_ref().is_some_and(|mark| known.values().any(|other| other == mark));
            // Without a mark it may belong to any of them.
            if lives || (mark.is_none() && known.len() > 1 && !is_zombie(pid)) {
                continue;
            }
            let _ = kill_process(pid, Signal::KILL);
            ended += usize::from(is_reaped(pid));
        }
        if ended == 0 {
            return;
        }
    }
}

/// Waits shortly for the end of a process that was killed.
fn is_reaped(pid: Pid) -> bool {
    (0..LOOKS).any(|look| {
        if look > 0 {
            std::thread::sleep(LOOK);
        }
        waitpid(Some(pid), WaitOptions::NOHANG).is_ok_and(|status| status.is_some())
    })
}

/// Kills every process whose mark begins so, but for this one.
pub(crate) fn kill_marked(beginning: &str) {
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    let pids = entries.filter_map(|entry| entry.file_name().to_str()?.parse::<i32>().ok());
    let own = std::process::id().cast_signed();
    let marked = pids
        .filter(|pid| *pid != own)
        .filter(|pid| mark_of(*pid).is_some_and(|mark| mark.starts_with(beginning)));
    for pid in marked.filter_map(Pid::from_raw) {
        let _ = kill_process(pid, Signal::KILL);
    }
}

/// The children of all threads of this process.
fn own_children() -> Vec<i32> {
    let threads = fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let texts = threads.filter_map(|thread| fs::read_to_string(thread.path().join("children")).ok());
    texts
        .flat_map(|text| text.split_ascii_whitespace().filter_map(|pid| pid.parse().ok()).collect::<Vec<_>>())
        .collect()
}

/// The mark of a process; none of one that has ended or has another user.
fn mark_of(pid: i32) -> Option<String> {
    let environment = fs::read(format!("/proc/{pid}/environ")).ok()?;
    let of = |entry: &[u8]| {
        let value = entry.strip_prefix(MARK.as_bytes())?.strip_prefix(b"=")?;
        String::from_utf8(value.to_vec()).ok()
    };
    environment.split(|byte| *byte == 0).find_map(of)
}

fn is_zombie(pid: Pid) -> bool {
    let stat = fs::read_to_string(format!("/proc/{}/stat", pid.as_raw_nonzero().get())).unwrap_or_default();
    stat.rsplit_once(')').is_some_and(|(_, rest)| rest.trim_start().starts_with('Z'))
}
