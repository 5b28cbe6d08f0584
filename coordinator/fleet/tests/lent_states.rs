//! States that local workers read and write by descriptors: the same bits as in pieces, in bounded memory, whatever a worker does.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::sync::Arc;
use std::sync::mpsc::Receiver;

use fleet_kit::hand::{Hand, block_on, hello};
use fleet_kit::inherited::{hand, part, workers};
use fleet_kit::{await_event, factory, private_with};
use starlings_fleet::{Fleet, FleetEvent, GrpcFleet, Held, Outcome, StateStore};
use starlings_models::{Job, Prediction, Setup, Window};
use starlings_pieces::SharedMemory;
use starlings_proto::convert::lent::{Lend, encode_in_memory};
use starlings_proto::convert::state::{Get, PutHead, decode_put_result};
use starlings_proto::descriptors::DescriptorReceiver;
use starlings_proto::{
    FromWorker, Hello, INHERITED, Lease, LeaseOutcome, State, StateId, ToWorker, generated,
};
use starlings_worker::WorkerConfig;
use tonic::{Code, Status};

/// Values of a state that is no multiple of a piece.
const N: usize = 100_003;

/// Bytes of one state.
const BYTES: usize = N * 8;

const NONCE: u64 = 42;

/// Every value depends on the one before the run, its place and the particle.
fn moved(job: &Job) -> Prediction {
    let from = job.state.as_deref().expect("every job has a state");
    let p = f64::from(job.particle);
    let state = from.iter().enumerate().map(|(i, x)| x * 1.000_001 + p / (1.0 + i as f64)).collect();
    Prediction { outputs: vec![from.iter().sum::<f64>() + p], state, cost: 0.0 }
}

fn job(particle: u32) -> Job {
    let window = Window { start: 0.0, times: vec![1.0], observed: vec![f64::NAN], inputs: vec![] };
    let mut state: Vec<f64> = (0..N).map(|i| ((i * 31 + particle as usize) % 1009) as f64 / 7.0).collect();
    (state[1], state[2]) = (-0.0, f64::MIN_POSITIVE / 4.0);
    Job { particle, record: 0, window: Arc::new(window), theta: vec![], state: Some(state) }
}

fn fleet(memory: usize) -> (GrpcFleet, StateStore, Receiver<FleetEvent>) {
    let store = StateStore::new(memory);
    let own = store.clone();
    let (fleet, events, _) = private_with(move |config| config.states = own);
    (fleet, store, events)
}

/// Runs this particle alone; the state that came of it.
fn run(fleet: &mut GrpcFleet, particle: u32) -> Held {
    let setup = fleet.install(&Setup::default()).unwrap();
    let job = job(particle).try_map(|x| Ok::<_, ()>(Held::from(x))).unwrap();
    fleet.run_held(vec![(setup, job)]).unwrap().remove(0).result.unwrap().state
}

#[test]
#[ignore = "not a test: the worker process of the others"]
fn worker_process() {
    let Some(part) = part() else { return };
    match part.as_str() {
        "honest" => work(moved),
        "spoils" => work(|job| {
            let mut prediction = moved(job);
            prediction.state[70_000] = f64::NAN;
            prediction
        }),
        "strays" => block_on(strays()),
        "writes" => block_on(writes_afterwards()),
        "hoards" => block_on(hoards()),
        "deaf" => block_on(takes_nothing()),
        other => panic!("no part of this name: {other}"),
    }
}

fn work(run: impl Fn(&Job) -> Prediction + Send + Sync + Clone + 'static) {
    let mut config = WorkerConfig::new(INHERITED);
    config.factory = factory(move |job| Ok(run(job)));
    starlings_worker::run(config).unwrap();
}

fn assert_moved(outcomes: &[Outcome], jobs: &[Job]) {
    assert_eq!(outcomes.len(), jobs.len());
    for (outcome, job) in outcomes.iter().zip(jobs) {
        let (got, wanted) = (outcome.result.as_ref().unwrap(), moved(job));
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&got.outputs), bits(&wanted.outputs));
        assert!(bits(&got.state) == bits(&wanted.state), "particle {}", job.particle);
    }
}

#[test]
fn states_by_descriptors_are_those_in_pieces_to_the_last_bit_whatever_the_memory() {
    for memory in [64 * BYTES, 5 * BYTES + 17, BYTES, 0] {
        let (mut fleet, store, _events) = fleet(memory);
        let workers = workers(&fleet, 2, "worker_process", "honest");
        let setup = fleet.install(&Setup::default()).unwrap();
        let jobs: Vec<Job> = (0..7).map(job).collect();
        assert_moved(&fleet.run(setup, jobs.clone()).unwrap(), &jobs);
        assert!(store.in_memory().1 <= memory, "{:?} of {memory}", store.in_memory());
        let state = run(&mut fleet, 3);
        assert!(state.into_values().unwrap() == moved(&job(3)).state);
        // Which way they went: as much as there is room for.
        assert!(store.in_memory().0 >= if memory > 5 * BYTES { BYTES } else { 0 }, "memory is lent");
        let given = store.keep(&job(9).state.unwrap()).unwrap();
        // Room for just one is free or not, as the states of the runs have come to rest.
        if memory != BYTES {
            assert_eq!(given.descriptor().is_some(), memory > BYTES, "with {memory} bytes");
        }
        drop((given, workers));
        drop(fleet);
        await_nothing(&store);
    }
}

#[test]
fn a_local_worker_that_writes_a_value_that_is_none_is_at_fault() {
    let (mut fleet, store, events) = fleet(usize::MAX);
    let bad = workers(&fleet, 1, "worker_process", "spoils");
    let run = std::thread::spawn(move || (run(&mut fleet, 1).into_values().unwrap(), fleet));
    let aside = await_event(&events, |event| matches!(event, FleetEvent::WorkerSetAside { .. }));
    assert!(format!("{aside:?}").contains("NaN is a value of the state"), "{aside:?}");
    // Its supervisor lets it go, so the run waits for another one.
    drop(bad);
    drop(run);
    drop(store);
}

/// Builds the setup and takes a job, with the name of its state.
async fn given(hand: &mut Hand) -> (Lease, StateId) {
    loop {
        match hand.hear().await.expect("still connected") {
            ToWorker::Setup { id, .. } => hand.say(FromWorker::Setup { id, result: Ok(()) }),
            ToWorker::Job { lease, job, .. } => {
                let Some(State::Named(id)) = job.state else { panic!("a large state has a name") };
                return (lease, id);
            }
            _ => {}
        }
    }
}

async fn joined() -> (Hand, Arc<DescriptorReceiver>, PutHead, StateId) {
    let (mut hand, descriptors) = hand(Hello { nonce: NONCE, ..hello() }).await;
    let (lease, id) = given(&mut hand).await;
    (hand, descriptors, PutHead { n_state: N, lease, nonce: NONCE }, id)
}

/// Asks for memory as this head says: its number and the memory where some was lent.
async fn lend(
    hand: &mut Hand,
    descriptors: &Arc<DescriptorReceiver>,
    head: PutHead,
) -> Result<Option<(u64, SharedMemory)>, Status> {
    let asked = descriptors.ask();
    let number = asked.number();
    let loan = hand.client.lend(Lend { head, descriptor: asked.number() }.encode()).await?.into_inner();
    let descriptor = asked.take();
    assert_eq!(descriptor.is_some(), loan.lent);
    let memory = |descriptor| SharedMemory::received(descriptor, head.n_state * 8, false).unwrap();
    Ok(descriptor.map(|descriptor| (number, memory(descriptor))))
}

async fn put(hand: &mut Hand, head: PutHead, number: u64) -> Result<StateId, Status> {
    let messages = tokio_stream::iter([head.encode(), encode_in_memory(number)]);
    let answer = hand.client.put(messages).await?;
    Ok(decode_put_result(answer.get_ref()).unwrap())
}

fn fill(memory: &SharedMemory, value: f64) {
    let bytes: Vec<u8> = std::iter::repeat_n(value.to_le_bytes(), N).flatten().collect();
    memory.write(&bytes, 0).unwrap();
}

fn answer(hand: &Hand, lease: Lease, state: StateId) {
    let prediction = Prediction { outputs: vec![1.0], state: State::Named(state), cost: 0.0 };
    hand.say(FromWorker::Result { lease, answer: LeaseOutcome::Ran(Ok(prediction)), cost: 0.1 });
}

/// The run of a worker that plays this part: the state that came of it.
fn under(part: &str, memory: usize) -> Vec<f64> {
    let (mut fleet, store, _events) = fleet(memory);
    let workers = workers(&fleet, 1, "worker_process", part);
    let values = run(&mut fleet, 1).into_values().unwrap();
    assert!(store.in_memory().1 <= memory);
    drop(workers);
    drop(fleet);
    await_nothing(&store);
    values
}

/// Waits until the store is empty: memory goes on a thread of its own.
fn await_nothing(store: &StateStore) {
    let begun = std::time::Instant::now();
    while (store.n_pieces(), store.in_memory().0) != (0, 0) {
        assert!(begun.elapsed().as_secs() < 60, "{} pieces, {:?}", store.n_pieces(), store.in_memory());
        std::thread::yield_now();
    }
}

#[test]
fn memory_is_lent_for_an_open_run_alone_and_a_put_without_any_is_refused() {
    assert!(under("strays", 1 << 30) == vec![5.0; N]);
}

async fn strays() {
    let (mut hand, descriptors, head, _) = joined().await;
    let lease = head.lease;
    let refused = put(&mut hand, head, 1).await.unwrap_err();
    assert_eq!(refused.code(), Code::FailedPrecondition, "nothing is lent");
    for (wrong, code) in [
        (PutHead { nonce: NONCE + 1, ..head }, Code::PermissionDenied),
        (PutHead { lease: Lease { epoch: lease.epoch + 1, ..lease }, ..head }, Code::PermissionDenied),
        (PutHead { lease: Lease { job: lease.job + 1, ..lease }, ..head }, Code::FailedPrecondition),
        (PutHead { lease: Lease { attempt: lease.attempt + 1, ..lease }, ..head }, Code::FailedPrecondition),
        (PutHead { n_state: 10, ..head }, Code::InvalidArgument),
        (PutHead { n_state: 1 << 28, ..head }, Code::InvalidArgument),
    ] {
        assert_eq!(lend(&mut hand, &descriptors, wrong).await.unwrap_err().code(), code, "{wrong:?}");
        assert!(put(&mut hand, wrong, 1).await.is_err());
    }
    let none = generated::LendRequest { descriptor: 0, ..Lend { head, descriptor: 1 }.encode() };
    assert_eq!(hand.client.lend(none).await.unwrap_err().code(), Code::InvalidArgument);
    let (number, memory) = lend(&mut hand, &descriptors, head).await.unwrap().expect("room");
    // Neither a state of another length than that of the memory, nor another number, nor a value that is none.
    let shorter = PutHead { n_state: N - 1, ..head };
    for (head, number) in [(shorter, number), (head, number + 1)] {
        assert_eq!(put(&mut hand, head, number).await.unwrap_err().code(), Code::FailedPrecondition);
    }
    fill(&memory, f64::INFINITY);
    assert_eq!(put(&mut hand, head, number).await.unwrap_err().code(), Code::InvalidArgument);
    // The second one under a lease counts.
    for value in [4.0, 5.0] {
        fill(&memory, value);
        let id = put(&mut hand, head, number).await.unwrap();
        if value > 4.5 {
            answer(&hand, lease, id);
        }
    }
    hand.stay_until_drained().await;
}

#[test]
fn neither_a_state_that_was_taken_nor_one_that_is_read_is_changed_by_what_a_worker_writes() {
    assert!(under("writes", 1 << 30) == vec![6.0; N]);
}

async fn writes_afterwards() {
    let (mut hand, descriptors, head, id) = joined().await;
    // The state of the job: its values, and nothing that writes.
    let asked = descriptors.ask();
    let number = asked.number();
    let get = Get { epoch: head.lease.epoch, nonce: NONCE, state: id, names: false, descriptor: number };
    let mut messages = hand.client.get(get.encode()).await.unwrap().into_inner();
    assert!(messages.message().await.unwrap().expect("a head").head.is_some());
    assert_eq!(messages.message().await.unwrap(), Some(encode_in_memory(number)));
    let state = SharedMemory::received(asked.take().expect("sent"), BYTES, true).expect("it is sealed");
    let mut bytes = vec![0; BYTES];
    state.read(&mut bytes, 0).unwrap();
    let values: Vec<f64> = bytes.as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)).collect();
    assert!(values == job(1).state.unwrap());
    assert!(state.write(&[1], 0).is_err());
    // Its end state: what it was when it was taken.
    let (number, memory) = lend(&mut hand, &descriptors, head).await.unwrap().expect("room");
    fill(&memory, 6.0);
    let id = put(&mut hand, head, number).await.unwrap();
    fill(&memory, 7.0);
    answer(&hand, head.lease, id);
    hand.stay_until_drained().await;
}

#[test]
fn a_hoarder_of_memory_gets_no_more_than_its_slots_can_need() {
    assert!(under("hoards", 16 * BYTES) == vec![8.0; N]);
}

async fn hoards() {
    let (mut hand, descriptors, head, _) = joined().await;
    let (first, _memory) = lend(&mut hand, &descriptors, head).await.unwrap().expect("room for one");
    for _ in 0..100 {
        assert!(lend(&mut hand, &descriptors, head).await.unwrap().is_none(), "one for its slot");
    }
    // For a state of another length it gives back what it has.
    let shorter = PutHead { n_state: N - 1, ..head };
    assert!(lend(&mut hand, &descriptors, shorter).await.unwrap().is_some());
    assert_eq!(put(&mut hand, head, first).await.unwrap_err().code(), Code::FailedPrecondition);
    let (number, memory) = lend(&mut hand, &descriptors, head).await.unwrap().expect("room for one");
    fill(&memory, 8.0);
    let id = put(&mut hand, head, number).await.unwrap();
    answer(&hand, head.lease, id);
    hand.stay_until_drained().await;
}

#[test]
fn a_worker_that_takes_no_descriptors_is_not_waited_for() {
    assert!(under("deaf", 1 << 30) == vec![9.0; N]);
}

async fn takes_nothing() {
    let (mut hand, descriptors, head, id) = joined().await;
    let mut refused = 0;
    for number in 1..10_000 {
        // Each takes back the one before.
        let head = PutHead { n_state: N - number % 2, ..head };
        let descriptor = 1_000_000 + number as u64;
        let loan = hand.client.lend(Lend { head, descriptor }.encode()).await.unwrap();
        refused += u32::from(!loan.get_ref().lent);
        if refused == 3 {
            break;
        }
    }
    assert_eq!(refused, 3, "its way of descriptors is full some time");
    // Nor does a state come that way.
    let descriptor = 1_000_000;
    let get = Get { epoch: head.lease.epoch, nonce: NONCE, state: id, names: false, descriptor };
    let mut messages = hand.client.get(get.encode()).await.unwrap().into_inner();
    let mut bytes = 0;
    while let Some(message) = messages.message().await.unwrap() {
        bytes += message.data.len();
    }
    assert_eq!(bytes, BYTES);
    // What came is closed, and there is a way again.
    drop(descriptors.ask());
    let other = PutHead { n_state: N - 2, ..head };
    assert!(lend(&mut hand, &descriptors, other).await.unwrap().is_some());
    let (number, memory) = lend(&mut hand, &descriptors, head).await.unwrap().expect("room");
    fill(&memory, 9.0);
    let id = put(&mut hand, head, number).await.unwrap();
    answer(&hand, head.lease, id);
    hand.stay_until_drained().await;
}
