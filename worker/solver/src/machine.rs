//! What solvers share on one machine: its cores and its ports.

use std::io;
use std::net::TcpListener;

use rustix::thread::{CpuSet, sched_getaffinity};

/// The cores of the program of this number: as many as it has threads, in turn, of those that this process may use.
pub(crate) fn cores(number: usize, threads: usize) -> Vec<usize> {
    let allowed = allowed();
    let start = number.saturating_mul(threads);
    (0..threads.clamp(1, allowed.len())).map(|i| allowed[(start + i) % allowed.len()]).collect()
}

/// The cores that this process may use, at least one: a batch system or a container may have left it a few of the machine's.
fn allowed() -> Vec<usize> {
    let set = sched_getaffinity(None).unwrap_or_default();
    let known: Vec<usize> = (0..CpuSet::MAX_CPU).filter(|core| set.is_set(*core)).collect();
    if !known.is_empty() {
        return known;
    }
    let n = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    (0..n).collect()
}

/// A loopback port that nobody listens on at this moment.
pub(crate) fn free_port() -> io::Result<u16> {
    Ok(TcpListener::bind(("127.0.0.1", 0))?.local_addr()?.port())
}

#[cfg(test)]
mod tests {
    use rustix::thread::sched_setaffinity;

    use super::*;

    #[test]
    fn programs_are_bound_in_turn_to_the_cores_that_this_process_may_use() {
        let all = allowed();
        let turns: Vec<usize> = (0..2 * all.len()).flat_map(|number| cores(number, 1)).collect();
        assert_eq!(turns, [all.clone(), all.clone()].concat());
        assert_eq!(cores(0, 10 * all.len()), all, "no core twice");
        // A thread's limit ends with the thread.
        let last = all[all.len() - 1];
        let limited = std::thread::spawn(move || {
            let mut set = CpuSet::new();
            set.set(last);
            sched_setaffinity(None, &set).expect("a core of its own");
            [0, 1, 2].map(|number| cores(number, 1))
        });
        assert_eq!(limited.join().expect("it ended well"), [[last], [last], [last]].map(Vec::from));
    }
}
