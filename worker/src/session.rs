//! One session with a coordinator: from its Welcome until it drains, vanishes, or the worker is cancelled.

use std::sync::Arc;
use std::time::Duration;

use starlings_models::ParticleError;
use starlings_proto::words::status_text;
use starlings_proto::{FromWorker, LeaseOutcome, ProtocolError, ReceivedWindows, ToWorker, generated};
use starlings_traces::Traces;
use tonic::Streaming;

use crate::WorkerConfig;
use crate::blocks::Blocks;
use crate::dial::Connection;
use crate::held::Held;
use crate::held_answers;
use crate::idle::Idle;
use crate::inbox::Inbox;
use crate::news::{News, Tell};
use crate::outbox::Outbox;
use crate::setups::Setups;
use crate::slots::{Asked, Slots, Traced};
use crate::watch::Watch;

/// How long a leaving worker waits for the coordinator to close the stream.
const GOODBYE_PATIENCE: Duration = Duration::from_secs(1);

/// How a session ended.
#[derive(Debug)]
pub(crate) enum Ended {
    /// The coordinator asked the worker to leave.
    Drained(String),
    /// The connection is gone.
    Lost(String),
    /// The worker was cancelled.
    Cancelled,
    /// A worker that stays had no work for as long as it waits.
    Idle(String),
}

pub(crate) async fn serve(
    mut connection: Connection,
    slots: &Slots,
    setups: &Setups,
    held: Option<&Arc<Held>>,
    config: &WorkerConfig,
    mut idle: Option<&mut Idle>,
) -> Ended {
    let mut beats = tokio::time::interval(Duration::from_secs_f64(connection.welcome.heartbeat));
    beats.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let mut silence = Silence::default();
    let inbox = Inbox::new(connection.transfers.clone(), config.slots);
    let blocks = Blocks::new(connection.transfers.shared(), config.slots);
    let mut watch = Watch::new(slots);
    loop {
        tokio::select! {
            // Messages first: a flood of jobs must not be mistaken for silence.
            biased;
            message = connection.inbound.message() => {
                silence.broken();
                let (tell, traces) = (&config.tell, config.traces.as_ref());
                let place = Place { slots, setups, held, inbox: &inbox, blocks: &blocks, tell, traces };
                match take(message, &connection.outbox, &mut connection.windows, &place) {
                    Ok(()) => {}
                    Err(Ended::Drained(reason)) => {
                        goodbye(&connection.outbox, &mut connection.inbound, &reason).await;
                        return Ended::Drained(reason);
                    }
                    Err(ended) => return ended,
                }
            }
            () = config.cancel.cancelled() => {
                goodbye(&connection.outbox, &mut connection.inbound, "it was told to end").await;
                return Ended::Cancelled;
            }
            _ = beats.tick() => {
                let (running, queued) = slots.load();
                let queued = queued + inbox.len() as u32;
                if let Some(held) = held {
                    held.look();
                }
                connection.outbox.send(FromWorker::Heartbeat { running, queued });
                if let Some(idle) = &mut idle {
                    idle.look(slots, queued > 0 || blocks.are_given());
                    if idle.left().is_zero() {
                        let reason = idle.reason();
                        goodbye(&connection.outbox, &mut connection.inbound, &reason).await;
                        return Ended::Idle(reason);
                    }
                }
                watch.look(slots, &config.tell);
                // A worker that serves once does not dial again: only the end of its connection ends its session.
                if let Some(reason) = silence.after_beat().filter(|_| !config.once) {
                    return Ended::Lost(reason);
                }
            }
        }
    }
}

/// Heartbeats of this side since the coordinator was last heard, after which it counts as gone.
const SILENT_BEATS: u32 = 3;

/// Counts heartbeats of this side since the coordinator was last heard. Counting beats instead of reading a clock keeps a
/// suspended machine from taking its coordinator for gone.
#[derive(Default)]
struct Silence {
    beats: u32,
}

impl Silence {
    fn broken(&mut self) {
        self.beats = 0;
    }

    fn after_beat(&mut self) -> Option<String> {
        self.beats += 1;
        (self.beats > SILENT_BEATS)
            .then(|| format!("the coordinator was silent for {SILENT_BEATS} heartbeats"))
    }
}

/// What a message acts on.
struct Place<'a> {
    slots: &'a Slots,
    setups: &'a Setups,
    held: Option<&'a Arc<Held>>,
    inbox: &'a Inbox,
    blocks: &'a Blocks,
    tell: &'a Tell,
    traces: Option<&'a Traces>,
}

fn take(
    message: Result<Option<generated::ToWorker>, tonic::Status>,
    outbox: &Outbox,
    windows: &mut ReceivedWindows,
    place: &Place<'_>,
) -> Result<(), Ended> {
    let Place { slots, setups, held, inbox, blocks, tell, traces } = *place;
    let message = match message {
        Ok(Some(message)) => message,
        Ok(None) => return Err(Ended::Lost("the coordinator closed the connection".to_owned())),
        Err(status) => return Err(Ended::Lost(format!("the connection broke: {}", status_text(&status)))),
    };
    match ToWorker::decode(message, windows) {
        Ok(ToWorker::Job { .. }) if slots.is_flooded(inbox.len()) => {
            return Err(Ended::Lost("the coordinator sent more jobs than can wait here".to_owned()));
        }
        Ok(ToWorker::Job { lease, setup, job, traceparent }) => {
            if let Some(forward) = setups.get(&setup) {
                let asked = Asked { traced: Traced::new(traceparent, traces), ..inbox.asked(lease, outbox) };
                inbox.take(slots, asked, setup, forward, job);
            } else {
                // First the setup, so that the job that comes back finds it missing here; and once, however many of its jobs
                // are on their way: a second time would stand for the setup that is sent again.
                if setups.miss(setup) {
                    outbox.send(FromWorker::Setup { id: setup, result: Err("it is forgotten".to_owned()) });
                }
                outbox.answer(lease, LeaseOutcome::Withdrawn, 0.0);
            }
        }
        Err(ProtocolError::Job { lease, source }) => {
            outbox.answer(lease, LeaseOutcome::Ran(Err(ParticleError::BadJob(source.to_string()))), 0.0);
        }
        Ok(ToWorker::Setup { id, setup }) => {
            let outbox = outbox.clone();
            setups.order(id, setup, Box::new(move |result| outbox.send(FromWorker::Setup { id, result })));
        }
        Ok(ToWorker::Cancel { leases, stop }) => {
            inbox.withdraw(&leases, outbox);
            slots.withdraw(&leases, stop);
        }
        Ok(ToWorker::Adopt { runs, rest_is_void }) => {
            let gone = slots.adopt(runs, |lease| inbox.asked(lease, outbox));
            held_answers::answer(gone, outbox, held, rest_is_void, inbox);
            if rest_is_void {
                slots.drop_void();
            }
        }
        Ok(ToWorker::Recombine { lease, block }) => blocks.take(lease, block, outbox),
        Ok(ToWorker::Notice(text)) => tell(&News::Told(text)),
        Ok(ToWorker::Drain(reason)) => return Err(Ended::Drained(reason)),
        Ok(ToWorker::Window | ToWorker::Heartbeat | ToWorker::Welcome(_) | ToWorker::Refuse(_)) => {}
        Err(error) => return Err(Ended::Lost(format!("the coordinator sent a malformed message: {error}"))),
    }
    Ok(())
}

/// Says goodbye and waits shortly until the coordinator closes the stream, so that the message is not lost.
async fn goodbye(outbox: &Outbox, inbound: &mut Streaming<generated::ToWorker>, reason: &str) {
    outbox.send(FromWorker::Goodbye(reason.to_owned()));
    let closed = async { while let Ok(Some(_)) = inbound.message().await {} };
    let _ = tokio::time::timeout(GOODBYE_PATIENCE, closed).await;
}

#[cfg(test)]
mod tests {
    use starlings_models::{BuildSetup, Job, Setup, Window};
    use starlings_proto::driven::Driven;
    use starlings_proto::{JobEncoder, Lease, SentWindows, State, encode_setup};

    use super::*;
    use crate::transfer::Transfers;

    /// A run of the oscillator to time 1.
    fn job() -> Job<State> {
        let window = Window::free(0.0, vec![1.0], 1, vec![]);
        Job { particle: 0, record: 0, window: Arc::new(window), theta: vec![], state: None }
    }

    fn oscillator() -> Setup {
        let mut setup = Setup { outputs: vec!["position".to_owned()], ..Setup::default() };
        setup.model.kind = "oscillator".to_owned();
        setup.model.constants = [("m", 1.0), ("c", 0.1), ("k", 1.0)].map(|(n, v)| (n.to_owned(), v)).into();
        setup
    }

    #[test]
    fn jobs_of_a_forgotten_setup_all_come_back_and_its_loss_is_told_once() {
        let (outbox, mut sent) = Outbox::new();
        let network = Arc::new(Driven::new().unwrap());
        let (slots, setups) =
            (Slots::start(1, None, network).unwrap(), Setups::new(Arc::new(|setup: &Setup| setup.build())));
        let mut windows = ReceivedWindows::default();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let inbox = Inbox::new(Transfers::nowhere(runtime.handle()), 1);
        let tell: Tell = Arc::new(|_| {});
        let blocks = Blocks::new(None, 1);
        let place = Place {
            slots: &slots,
            setups: &setups,
            held: None,
            inbox: &inbox,
            blocks: &blocks,
            tell: &tell,
            traces: None,
        };
        let mut take = |message| take(Ok(Some(message)), &outbox, &mut windows, &place).unwrap();
        let mut next = || FromWorker::decode(sent.blocking_recv().expect("an answer")).unwrap();
        let (id, json) = encode_setup(&oscillator()).unwrap();
        let mut encoder = JobEncoder::default();
        let lease = |number| Lease { epoch: 1, job: number, attempt: 1 };
        let mut given = |number| encoder.encode(lease(number), &id, &job(), &mut SentWindows::default()).1;
        let back =
            |number| FromWorker::Result { lease: lease(number), answer: LeaseOutcome::Withdrawn, cost: 0.0 };

        (1..=3).for_each(|number| take(given(number)));
        assert!(matches!(next(), FromWorker::Setup { id: lost, result: Err(_) } if lost == id));
        assert_eq!([next(), next(), next()], [back(1), back(2), back(3)]);

        take(ToWorker::setup(&id, json));
        assert_eq!(next(), FromWorker::Setup { id, result: Ok(()) });
        take(given(4));
        assert!(matches!(next(), FromWorker::Result { answer: LeaseOutcome::Ran(Ok(_)), .. }));
        slots.close();
    }
}
