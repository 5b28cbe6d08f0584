//! What cannot be meant is refused: by the side that would send it where that can know, else by the side that receives it.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use starlings_models::{Job, Prediction, Setup, Signal, Window};
use starlings_proto::{
    FromWorker, JobEncoder, Lease, LeaseOutcome, MAX_INLINE_STATE, MAX_SLOTS, MAX_STATE, ProtocolError,
    ReceivedWindows, SentWindows, State, ToWorker,
    convert::{job::check_size, state::check_state},
    encode_setup, generated,
};

/// The message of a job whose window travels inside it.
fn encode(lease: Lease, job: &Job<State>) -> generated::ToWorker {
    JobEncoder::default().encode(lease, &[0; 32], job, &mut SentWindows::default()).1
}

fn decode(message: generated::ToWorker) -> Result<ToWorker, ProtocolError> {
    ToWorker::decode(message, &mut ReceivedWindows::default())
}

fn small_job() -> Job<State> {
    let window = Window { start: 0.0, times: vec![1.0], observed: vec![2.0], inputs: vec![], since: vec![] };
    Job { particle: 0, record: 0, window: Arc::new(window), theta: vec![], state: None }
}

#[test]
fn a_setup_with_an_infinite_constant_is_refused_before_it_travels() {
    let mut setup = Setup::default();
    setup.model.constants.insert("R".to_owned(), f64::INFINITY);
    assert!(matches!(encode_setup(&setup), Err(ProtocolError::Setup(_))));
}

#[test]
fn a_state_beyond_the_limit_inside_a_message_is_refused_on_both_sides() {
    let mut job = small_job();
    let lease = Lease { epoch: 1, job: 1, attempt: 1 };
    job.state = Some(vec![0.0; MAX_INLINE_STATE / 8].into());
    assert!(matches!(decode(encode(lease, &job)), Ok(ToWorker::Job { job: got, .. }) if got == job));
    job.state = Some(vec![0.0; MAX_INLINE_STATE / 8 + 1].into());
    let sent = encode(lease, &job);
    assert!(matches!(decode(sent), Err(ProtocolError::Job { lease: l, .. }) if l == lease));
    let prediction = Prediction { outputs: vec![], state: job.state.unwrap(), cost: 0.0 };
    let result = FromWorker::Result { lease, answer: LeaseOutcome::Ran(Ok(prediction)), cost: 0.0 };
    assert!(matches!(result.encode(), Err(ProtocolError::StateTooLarge { .. })));
}

#[test]
fn a_state_that_travels_by_itself_is_named_both_ways() {
    let lease = Lease { epoch: 1, job: 1, attempt: 1 };
    let job = Job { state: Some(State::Named([7; 32])), ..small_job() };
    assert!(matches!(decode(encode(lease, &job)), Ok(ToWorker::Job { job: got, .. }) if got == job));
    let prediction = Prediction { outputs: vec![1.0], state: State::Named([8; 32]), cost: 0.5 };
    let result = FromWorker::Result { lease, answer: LeaseOutcome::Ran(Ok(prediction)), cost: 0.5 };
    assert_eq!(FromWorker::decode(result.clone().encode().unwrap()), Ok(result));
}

#[test]
fn no_state_larger_than_the_protocol_allows_is_begun() {
    assert_eq!(check_state(MAX_STATE / 8), Ok(()));
    let error = check_state(MAX_STATE / 8 + 1).unwrap_err();
    assert_eq!(error.to_string(), "the state has 17179869192 bytes; more than 17179869184 cannot travel");
}

#[test]
fn a_malformed_job_names_its_lease_so_that_it_can_be_answered() {
    let lease = Lease { epoch: 1, job: 9, attempt: 1 };
    let sent = encode(lease, &small_job());
    let Some(generated::to_worker::Kind::Job(good)) = sent.kind else { panic!("a job is encoded as a job") };
    let without_times = generated::Window { start: Some(0.0), ..generated::Window::default() };
    let spoil: [&dyn Fn(&mut generated::Job); 4] = [
        &|job| job.theta = vec![1, 2, 3].into(),
        &|job| job.setup = vec![0; 31].into(),
        &|job| job.over = None,
        &|job| job.over = Some(generated::job::Over::Window(without_times.clone())),
    ];
    for damage in spoil {
        let mut job = good.clone();
        damage(&mut job);
        let message = generated::ToWorker { kind: Some(generated::to_worker::Kind::Job(job)) };
        assert!(matches!(decode(message), Err(ProtocolError::Job { lease: l, .. }) if l == lease));
    }
}

#[test]
fn a_worker_without_slots_or_with_too_many_is_malformed() {
    for slots in [0, MAX_SLOTS as u32 + 1, u32::MAX] {
        let hello = generated::Hello { slots, ..generated::Hello::default() };
        let message = generated::FromWorker { kind: Some(generated::from_worker::Kind::Hello(hello)) };
        assert!(matches!(FromWorker::decode(message), Err(ProtocolError::Shape { field: "slots", .. })));
    }
}

#[test]
fn a_window_that_no_worker_would_take_is_refused_before_it_travels() {
    let spoil: [fn(&mut Window); 3] = [
        |window| window.times.clear(),
        |window| window.times = vec![1.0, 2.0],
        |window| window.inputs = vec![Signal { times: vec![0.0], values: vec![] }],
    ];
    for damage in spoil {
        let mut job = small_job();
        damage(Arc::make_mut(&mut job.window));
        assert!(matches!(check_size(&job), Err(ProtocolError::Shape { .. })), "{job:?}");
    }
}
