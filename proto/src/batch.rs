//! Threads that compute for long, as the scheduler of the system should know them.

/// From now on this thread is one that computes: woken, it waits for its turn and interrupts nobody.
///
/// A thread that was interrupted has the processor's memory of what it did, so that it is not moved to an idle processor for a while,
/// and one that waits for its turn is. Where the system knows no such threads, or lets nobody ask, all stays as it was.
pub fn computes() {
    #[cfg(target_os = "linux")]
    {
        use preempt_rt::sched::{Pid, Scheduler, SchedulerParams, set_scheduler};
        let _ = set_scheduler(Pid::current_thread(), Scheduler::SCHED_BATCH, SchedulerParams { priority: 0 });
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use preempt_rt::sched::{Pid, Scheduler, get_scheduler};

    #[test]
    fn a_thread_that_computes_is_known_as_one_and_no_other_becomes_it() {
        let policy = || get_scheduler(Pid::current_thread()).expect("the system says it");
        let before = policy();
        let known = std::thread::spawn(move || {
            super::computes();
            policy()
        });
        assert_eq!(known.join().expect("it ends"), Scheduler::SCHED_BATCH);
        assert_eq!(policy(), before);
    }
}
