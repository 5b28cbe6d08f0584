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

/// A job of the particle 0.
fn job() -> Job {
    let window = starlings_models::Window {
        start: 0.0,
        times: vec![1.0],
        observed: vec![0.0],
        inputs: vec![],
        since: vec![],
    };
    Job { particle: 0, record: 0, window: Arc::new(window), theta: vec![], state: None }
}

/// Ends, when it is told to stop, with a result all the same.
struct Stubborn;

impl Forward for Stubborn {
    fn spec(&self) -> &starlings_models::Spec {
        Endless.spec()
    }

    fn run(&self, job: &Job) -> Result<starlings_models::Prediction, ParticleError> {
        Endless.run(job)
    }

    fn run_within(
        &self,
        job: &Job,
        until: &Until<'_>,
    ) -> Result<starlings_models::Prediction, ParticleError> {
        let _ = Endless.run_within(job, until);
        Ok(starlings_models::Prediction { outputs: vec![1.0], state: vec![].into(), cost: 0.0 })
    }
}

/// A network on which nothing happens.
fn network() -> Arc<Driven> {
    Arc::new(Driven::new().expect("a runtime"))
}

#[test]
fn a_run_that_is_over_stops_what_computes_and_nothing_of_it_is_kept_or_told_to_the_next_one() {
    let (outbox, mut sent) = Outbox::new();
    let held = Arc::new(Held::new(crate::HoldLimits::default(), &std::env::temp_dir()));
    let slots = Slots::start(2, Some(Arc::clone(&held)), network()).unwrap();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let transfers = crate::transfer::Transfers::nowhere(runtime.handle());
    let forwards: [Arc<dyn Forward>; 3] = [Arc::new(Endless), Arc::new(Stubborn), Arc::new(Endless)];
    for (number, forward) in (1..).zip(forwards) {
        let lease = Lease { epoch: 1, job: number, attempt: 1 };
        let asked = Asked { lease, outbox: outbox.clone(), transfers: transfers.clone(), traced: None };
        slots.push(Task::new(asked, [7; 32], forward, job()));
    }
    while slots.load() != (2, 1) {
        std::thread::yield_now();
    }
    slots.forget();
    let (next, mut told) = Outbox::new();
    assert_eq!(slots.attach(next.clone()), Vec::<starlings_proto::JobKey>::new());
    while slots.load() != (0, 0) || slots.answered() != (1, 0) {
        std::thread::yield_now();
    }
    slots.close();
    drop((outbox, next));
    // Both threads have ended with what they did.
    drop(slots);
    assert!(sent.blocking_recv().is_none() && told.blocking_recv().is_none());
    assert_eq!(held.len(), 0);
}

#[test]
fn a_computing_job_is_stopped_when_that_is_asked_for_and_answered_as_withdrawn() {
    let (outbox, mut sent) = Outbox::new();
    let slots = Slots::start(1, None, network()).unwrap();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let transfers = crate::transfer::Transfers::nowhere(runtime.handle());
    let lease = |job| Lease { epoch: 1, job, attempt: 1 };
    for number in 1..=3 {
        let asked = Asked {
            lease: lease(number),
            outbox: outbox.clone(),
            transfers: transfers.clone(),
            traced: None,
        };
        slots.push(Task::new(asked, [7; 32], Arc::new(Endless), job()));
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
    assert!(Slots::start_with(5, None, network(), spawn).is_err());
    assert_eq!(ended.load(Ordering::Relaxed), 3);
}
