//! What becomes of jobs that are called back.

use starlings_models::{Forward, Job, ParticleError};
use starlings_proto::FromWorker;

use super::*;

/// Computes until it is told to stop.
struct Endless;

impl Forward for Endless {
    fn spec(&self) -> &starlings_models::Spec {
        unreachable!("nobody asks")
    }

    fn run(&self, _: &Job) -> Result<starlings_models::Prediction, ParticleError> {
        unreachable!("it is run within limits")
    }

    fn run_within(&self, _: &Job, until: &Until<'_>) -> Result<starlings_models::Prediction, ParticleError> {
        while !until.stop.is_set() {
            std::thread::yield_now();
        }
        Err(ParticleError::Infrastructure("stopped".to_owned()))
    }
}

#[test]
fn a_computing_job_is_stopped_when_that_is_asked_for_and_answered_as_withdrawn() {
    let (outbox, mut sent) = tokio::sync::mpsc::unbounded_channel();
    let slots = Slots::start(1, None).unwrap();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let transfers = crate::transfer::Transfers::nowhere(runtime.handle());
    let lease = |job| Lease { epoch: 1, job, attempt: 1 };
    let window =
        starlings_models::Window { start: 0.0, times: vec![1.0], observed: vec![0.0], inputs: vec![] };
    let window = Arc::new(window);
    for number in 1..=3 {
        let job = Job { particle: 0, record: 0, window: Arc::clone(&window), theta: vec![], state: None };
        let asked = Asked { lease: lease(number), outbox: outbox.clone(), transfers: transfers.clone() };
        slots.push(Task::new(asked, [7; 32], Arc::new(Endless), job));
    }
    while slots.load().0 == 0 {
        std::thread::yield_now();
    }
    let mut withdrawn = || match FromWorker::decode(sent.blocking_recv().unwrap()).unwrap() {
        FromWorker::Result { lease, answer: LeaseOutcome::Withdrawn, .. } => lease.job,
        other => panic!("{other:?}"),
    };
    // Without the word, only what waits comes back.
    slots.withdraw(&[lease(1), lease(2)], false);
    assert_eq!(withdrawn(), 2);
    slots.withdraw(&[lease(1)], true);
    assert_eq!(withdrawn(), 1);
    while slots.load().0 == 0 {
        std::thread::yield_now();
    }
    slots.withdraw(&[lease(3)], true);
    assert_eq!(withdrawn(), 3);
    slots.close();
}

#[test]
fn threads_that_started_end_again_when_the_system_gives_no_more() {
    let ended = Arc::new(AtomicU32::new(0));
    let spawn = |slot, work: Box<dyn FnOnce() + Send>| {
        if slot == 3 {
            return Err(std::io::Error::other("no more threads"));
        }
        let ended = Arc::clone(&ended);
        Ok(std::thread::spawn(move || {
            work();
            ended.fetch_add(1, Ordering::Relaxed);
        }))
    };
    assert!(Slots::start_with(5, None, spawn).is_err());
    assert_eq!(ended.load(Ordering::Relaxed), 3);
}
