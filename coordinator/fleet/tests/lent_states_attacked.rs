//! Workers played by hand that take descriptors of states and misuse them: what is kept stays as it was, and is bounded.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::sync::Arc;

use fleet_kit::hand::{Hand, block_on, hello};
use fleet_kit::inherited::{hand, part};
use fleet_kit::large::{BYTES, N, answer, given, job};
use fleet_kit::lent::under;
use starlings_pieces::SharedMemory;
use starlings_proto::convert::lent::{GiveBack, Lend, NOT_LENT, encode_in_memory};
use starlings_proto::convert::state::{Get, PutHead, decode_put_result};
use starlings_proto::descriptors::DescriptorReceiver;
use starlings_proto::{Hello, Lease, StateId, generated};
use tonic::{Code, Status};

const NONCE: u64 = 42;

#[test]
#[ignore = "not a test: the worker process of the others"]
fn worker_process() {
    let Some(part) = part() else { return };
    match part.as_str() {
        "strays" => block_on(strays()),
        "writes" => block_on(writes_afterwards()),
        "hoards" => block_on(hoards()),
        "deaf" => block_on(takes_nothing()),
        other => panic!("no part of this name: {other}"),
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

async fn give_back(hand: &mut Hand, epoch: u64, nonce: u64, descriptor: u64) -> Result<(), Status> {
    hand.client.give_back(GiveBack { epoch, nonce, descriptor }.encode()).await.map(drop)
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

#[test]
fn memory_is_lent_for_an_open_run_alone_and_a_put_without_any_is_refused() {
    assert!(under("strays", 1 << 30) == vec![5.0; N]);
}

async fn strays() {
    let (mut hand, descriptors, head, _) = joined().await;
    let lease = head.lease;
    let refused = put(&mut hand, head, 1).await.unwrap_err();
    assert_eq!(refused.code(), NOT_LENT, "nothing is lent");
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
        assert_eq!(put(&mut hand, head, number).await.unwrap_err().code(), NOT_LENT);
    }
    // Nor does anybody else give it back.
    for (epoch, nonce, number, code) in [
        (lease.epoch, NONCE + 1, number, Code::PermissionDenied),
        (lease.epoch + 1, NONCE, number, Code::PermissionDenied),
        (lease.epoch, NONCE, 0, Code::InvalidArgument),
    ] {
        assert_eq!(give_back(&mut hand, epoch, nonce, number).await.unwrap_err().code(), code);
    }
    give_back(&mut hand, lease.epoch, NONCE, number + 1).await.expect("what is not lent is not missed");
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
    assert!(values == job(1, 1).state.unwrap());
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
    assert_eq!(put(&mut hand, head, first).await.unwrap_err().code(), NOT_LENT);
    let (number, memory) = lend(&mut hand, &descriptors, head).await.unwrap().expect("room for one");
    give_back(&mut hand, head.lease.epoch, NONCE, number).await.unwrap();
    assert_eq!(put(&mut hand, head, number).await.unwrap_err().code(), NOT_LENT, "it was given back");
    drop(memory);
    let (number, memory) = lend(&mut hand, &descriptors, head).await.unwrap().expect("room for one again");
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
