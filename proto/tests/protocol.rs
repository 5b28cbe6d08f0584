//! What is sent is what arrives, bit by bit, and damaged bytes are an error and no panic.
#![allow(clippy::unwrap_used)]

mod protocol_kit;

use proptest::prelude::*;
use prost::Message;
use protocol_kit::{from_worker, job, lease};
use starlings_models::{ModelDef, ModelFailure, ParticleError, Setup, Window};
use starlings_proto::{
    FromWorker, JobEncoder, Lease, LeaseOutcome, ProtocolError, ReceivedWindows, SentWindows, State,
    ToWorker, Welcome, decode_setup, encode_setup, generated,
};

/// Text in which every float shows its bits, so that NaN compares equal to the same NaN only.
fn state_bits(state: &State) -> Vec<u64> {
    let State::Values(values) = state else { panic!("a small state is inside") };
    bits(values)
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| v.to_bits()).collect()
}

fn through_bytes<M: Message + Default>(message: &M) -> M {
    M::decode(message.encode_to_vec().as_slice()).unwrap()
}

/// What a worker makes of the first message of a stream.
fn decode(message: generated::ToWorker) -> Result<ToWorker, ProtocolError> {
    ToWorker::decode(message, &mut ReceivedWindows::default())
}

fn same_window(a: &Window, b: &Window) -> bool {
    let signals = |w: &Window| w.inputs.iter().map(|s| (bits(&s.times), bits(&s.values))).collect::<Vec<_>>();
    a.start.to_bits() == b.start.to_bits()
        && bits(&a.times) == bits(&b.times)
        && bits(&a.observed) == bits(&b.observed)
        && signals(a) == signals(b)
}

fn failure_bits(error: &ParticleError) -> (String, Vec<u64>) {
    let numbers = match error {
        ParticleError::Model(ModelFailure::NotFinite { time, .. }) => vec![*time],
        ParticleError::Model(ModelFailure::StepTooSmall { time, step }) => vec![*time, *step],
        ParticleError::Model(ModelFailure::TooManySteps { time, limit }) => vec![*time, *limit as f64],
        ParticleError::Timeout(timeout) => vec![timeout.limit],
        _ => vec![],
    };
    // The type, too: an undecided end reads as a model failure does.
    (format!("{:?} {error}", std::mem::discriminant(error)), bits(&numbers))
}

proptest! {
    #[test]
    fn a_job_arrives_bit_by_bit(lease in lease(), setup: [u8; 32], job in job()) {
        let mut encoder = JobEncoder::default();
        for _ in 0..2 {
            let (ahead, sent) = encoder.encode(lease, &setup, &job, &mut SentWindows::default());
            prop_assert_eq!(ahead, None, "a small window travels inside");
            let ToWorker::Job { lease: got_lease, setup: got_setup, job: got, traceparent } =
                decode(through_bytes(&sent)).unwrap() else { panic!("a job arrives as a job") };
            prop_assert_eq!(traceparent, None);
            prop_assert_eq!((got_lease, got_setup), (lease, setup));
            prop_assert_eq!((got.particle, got.record), (job.particle, job.record));
            prop_assert_eq!(bits(&got.theta), bits(&job.theta));
            prop_assert_eq!(got.state.as_ref().map(state_bits), job.state.as_ref().map(state_bits));
            prop_assert!(same_window(&got.window, &job.window));
        }
    }

    /// One that is not as long as the recommendation wants it is no part of a trace, whatever else it is.
    #[test]
    fn a_job_arrives_with_its_place_in_a_trace(lease in lease(), setup: [u8; 32], job in job(), text in "[ -~]{0,80}") {
        let whole = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01".to_owned();
        for (given, wanted) in [(whole.clone(), Some(whole)), (text.clone(), Some(text).filter(|text| text.len() == 55))] {
            let (_, sent) = JobEncoder::default().encode(lease, &setup, &job, &mut SentWindows::default());
            let sent = ToWorker::traced(sent, given);
            let ToWorker::Job { traceparent, .. } =
                decode(through_bytes(&sent)).unwrap() else { panic!("a job arrives as a job") };
            prop_assert_eq!(traceparent, wanted);
        }
    }

    #[test]
    fn a_worker_s_message_arrives_bit_by_bit(message in from_worker()) {
        let got = FromWorker::decode(through_bytes(&message.clone().encode().unwrap())).unwrap();
        match (&message, &got) {
            (
                FromWorker::Result { lease: a, answer: LeaseOutcome::Ran(Ok(sent)), .. },
                FromWorker::Result { lease: b, answer: LeaseOutcome::Ran(Ok(back)), .. },
            ) => {
                prop_assert_eq!(a, b);
                prop_assert_eq!((bits(&sent.outputs), state_bits(&sent.state)), (bits(&back.outputs), state_bits(&back.state)));
            }
            (
                FromWorker::Result { lease: a, answer: LeaseOutcome::Ran(Err(sent)), .. },
                FromWorker::Result { lease: b, answer: LeaseOutcome::Ran(Err(back)), .. },
            ) => {
                prop_assert_eq!(a, b);
                prop_assert_eq!(failure_bits(sent), failure_bits(back));
            }
            _ => prop_assert_eq!(&message, &got),
        }
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        if let Ok(message) = generated::ToWorker::decode(bytes.as_slice()) {
            let _ = decode(message);
        }
        if let Ok(message) = generated::FromWorker::decode(bytes.as_slice()) {
            let _ = FromWorker::decode(message);
        }
    }

    #[test]
    fn a_damaged_job_is_an_error_or_another_job_and_never_a_panic(job in job(), at: prop::sample::Index, byte: u8) {
        let lease = Lease { epoch: 1, job: 2, attempt: 3 };
        let (_, sent) = JobEncoder::default().encode(lease, &[7; 32], &job, &mut SentWindows::default());
        let mut bytes = sent.encode_to_vec();
        let at = at.index(bytes.len());
        bytes[at] = byte;
        if let Ok(message) = generated::ToWorker::decode(bytes.as_slice()) {
            let _ = decode(message);
        }
    }
}

#[test]
fn the_coordinator_s_messages_arrive_as_sent() {
    let welcome = Welcome {
        protocol: 1,
        run: "pig".to_owned(),
        heartbeat: 8.0,
        epoch: 5,
        run_id: [7; 16],
        incarnation: 3,
        probe: None,
    };
    let shared = Welcome { probe: Some([8; 32]), ..welcome.clone() };
    let leases = vec![Lease { epoch: 5, job: 1, attempt: 1 }, Lease { epoch: 5, job: 2, attempt: 3 }];
    let pairs = [
        (ToWorker::welcome(welcome.clone()), ToWorker::Welcome(welcome)),
        (ToWorker::welcome(shared.clone()), ToWorker::Welcome(shared)),
        (ToWorker::refuse("no"), ToWorker::Refuse("no".to_owned())),
        (ToWorker::cancel(&leases, false), ToWorker::Cancel { leases: leases.clone(), stop: false }),
        (ToWorker::cancel(&leases, true), ToWorker::Cancel { leases, stop: true }),
        (ToWorker::heartbeat(), ToWorker::Heartbeat),
        (ToWorker::drain("done"), ToWorker::Drain("done".to_owned())),
    ];
    for (sent, expected) in pairs {
        assert_eq!(decode(through_bytes(&sent)), Ok(expected));
    }
}

#[test]
fn a_setup_arrives_as_sent_and_a_damaged_one_says_so() {
    let mut setup = Setup {
        model: ModelDef { kind: "windkessel-3".to_owned(), ..ModelDef::default() },
        ..Setup::default()
    };
    setup.model.constants.insert("R".to_owned(), 0.1 + 0.2);
    let (id, json) = encode_setup(&setup).unwrap();
    assert_eq!(decode_setup(&id, &json), Ok(setup));
    assert!(matches!(decode_setup(&id, &json[1..]), Err(ProtocolError::Setup(_))));
}

#[test]
fn heartbeats_of_no_length_or_no_end_are_refused() {
    for heartbeat in [0.0, -0.0, -1.0, 1e-300, 1e-3, 1e300, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let welcome = Welcome {
            protocol: 4,
            run: String::new(),
            heartbeat,
            epoch: 1,
            run_id: [0; 16],
            incarnation: 1,
            probe: None,
        };
        let error = ToWorker::decode(ToWorker::welcome(welcome), &mut ReceivedWindows::default());
        assert!(
            matches!(error, Err(ProtocolError::Shape { field: "heartbeat", .. })),
            "{heartbeat}: {error:?}"
        );
    }
}
