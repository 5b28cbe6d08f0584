//! Clients that ask for states and send them by hand: strangers, liars, hoarders.
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::net::SocketAddr;

use fleet_kit::hand::{Hand, block_on, hello};
use fleet_kit::large::{answer, await_nothing, given};
use fleet_kit::{any_port, listen_with};
use starlings_fleet::{Fleet, Folder, Held, StateStore};
use starlings_models::{Job, Setup, Window};
use starlings_proto::convert::piece_names::encode_names;
use starlings_proto::convert::state::{
    CHUNK_BYTES, Get, PutHead, decode_put_result, encode_chunk, encode_head,
};
use starlings_proto::generated::{self, fleet_client::FleetClient};
use starlings_proto::{Hello, Lease, StateId};
use tokio::sync::mpsc::unbounded_channel;
use tokio_stream::wrappers::UnboundedReceiverStream;
use tonic::{Code, Status};

const NONCE: u64 = 42;

/// Values of the model's state, as the setup below says: two pieces.
const N: usize = 40_000;

async fn dial(address: SocketAddr, nonce: u64) -> Hand {
    Hand::dial(address, Hello { nonce, ..hello() }).await
}

async fn put(hand: &mut Hand, messages: Vec<generated::Chunk>) -> Result<StateId, Status> {
    let answer = hand.client.put(tokio_stream::iter(messages)).await?;
    Ok(decode_put_result(answer.get_ref()).unwrap())
}

async fn get(hand: &mut Hand, epoch: u64, nonce: u64, state: StateId) -> Result<usize, Status> {
    let request = Get { epoch, nonce, state, names: false, descriptor: 0 }.encode();
    let mut pieces = hand.client.get(request).await?.into_inner();
    let mut bytes = 0;
    while let Some(piece) = pieces.message().await? {
        bytes += piece.data.len();
    }
    Ok(bytes)
}

fn pieces(value: f64) -> Vec<generated::Chunk> {
    let bytes: Vec<u8> = std::iter::repeat_n(value.to_le_bytes(), N).flatten().collect();
    bytes.chunks(CHUNK_BYTES).map(|piece| encode_chunk(piece.to_vec().into())).collect()
}

fn state(head: PutHead, value: f64) -> Vec<generated::Chunk> {
    std::iter::once(head.encode()).chain(pieces(value)).collect()
}

/// Runs one job with a large state while `attack` plays its worker; gives the state that came of it.
fn under(attack: impl AsyncFnOnce(SocketAddr)) -> (Vec<f64>, StateStore) {
    under_with(StateStore::new(1 << 30), attack)
}

/// The same with states in this store.
fn under_with(store: StateStore, attack: impl AsyncFnOnce(SocketAddr)) -> (Vec<f64>, StateStore) {
    let own = store.clone();
    let (mut fleet, _events, _) = listen_with(any_port(), move |config| config.states = own);
    let address = fleet.address().unwrap();
    let run = std::thread::spawn(move || {
        // A setup that this side cannot build: it does not know how long a state is.
        let setup = fleet.install(&Setup::default()).unwrap();
        let window = Window::free(0.0, vec![1.0], 1, vec![]);
        let state = Some(Held::Values(vec![0.5; N]));
        let job = Job { particle: 0, record: 0, window: window.into(), theta: vec![], state };
        let outcome = fleet.run_held(vec![(setup, job)]).unwrap().remove(0);
        let values = outcome.result.unwrap().state.into_values().unwrap();
        fleet.close();
        values
    });
    block_on(attack(address));
    (run.join().unwrap(), store)
}

#[test]
fn a_stranger_neither_gets_nor_puts_a_state() {
    let (values, store) = under(async |address| {
        let mut hand = dial(address, NONCE).await;
        let (lease, id) = given(&mut hand).await;
        let mut stranger = hand;
        stranger.client = FleetClient::connect(format!("http://{address}")).await.unwrap();
        for (epoch, nonce) in [(lease.epoch, NONCE + 1), (lease.epoch + 1, NONCE), (0, 0)] {
            let refused = get(&mut stranger, epoch, nonce, id).await.unwrap_err();
            assert_eq!(refused.code(), Code::PermissionDenied);
            let head = PutHead { n_state: N, lease: Lease { epoch, ..lease }, nonce };
            let refused = put(&mut stranger, state(head, 1.0)).await.unwrap_err();
            assert_eq!(refused.code(), Code::PermissionDenied);
        }
        assert_eq!(get(&mut stranger, lease.epoch, NONCE, [9; 32]).await.unwrap_err().code(), Code::NotFound);
        assert_eq!(get(&mut stranger, lease.epoch, NONCE, id).await.unwrap(), N * 8);
        let id = put(&mut stranger, state(PutHead { n_state: N, lease, nonce: NONCE }, 2.0)).await.unwrap();
        answer(&stranger, lease, id);
        stranger.stay_until_drained().await;
    });
    assert!(values == vec![2.0; N]);
    await_nothing(&store);
}

#[test]
fn what_is_put_wrongly_is_refused_and_leaves_nothing() {
    let (values, store) = under(async |address| {
        let mut hand = dial(address, NONCE).await;
        let (lease, _) = given(&mut hand).await;
        let head = PutHead { n_state: N, lease, nonce: NONCE };
        let with = |change: &dyn Fn(&mut Vec<generated::Chunk>)| {
            let mut messages = state(head, 3.0);
            change(&mut messages);
            messages
        };
        let other = |job, attempt| PutHead { lease: Lease { job, attempt, ..lease }, ..head }.encode();
        let wrong = [
            (with(&|m| m.truncate(0)), Code::InvalidArgument),
            (with(&|m| m[0] = other(lease.job + 1, lease.attempt)), Code::FailedPrecondition),
            (with(&|m| m[0] = other(lease.job, lease.attempt + 1)), Code::FailedPrecondition),
            (with(&|m| drop(m.remove(0))), Code::InvalidArgument),
            (with(&|m| m[0] = encode_head(N)), Code::InvalidArgument),
            (with(&|m| m[0] = PutHead { n_state: 10, ..head }.encode()), Code::InvalidArgument),
            (with(&|m| m[0] = PutHead { n_state: 1 << 28, ..head }.encode()), Code::InvalidArgument),
            (with(&|m| m[0] = PutHead { n_state: usize::MAX / 2, ..head }.encode()), Code::InvalidArgument),
            (with(&|m| drop(m.pop())), Code::InvalidArgument),
            (with(&|m| m.push(encode_chunk(vec![0; 8].into()))), Code::InvalidArgument),
            (with(&|m| m.swap(1, 2)), Code::InvalidArgument),
            (with(&|m| m[1] = encode_head(N)), Code::InvalidArgument),
            (with(&|m| m[2] = pieces(f64::NAN).remove(1)), Code::InvalidArgument),
            (with(&|m| m[1] = pieces(f64::INFINITY).remove(0)), Code::InvalidArgument),
            // Nothing is shared here.
            (vec![head.encode(), encode_names(&[[1; 32]; 2])], Code::FailedPrecondition),
            (vec![head.encode(), encode_names(&[[1; 32]; 3])], Code::InvalidArgument),
        ];
        for (index, (messages, code)) in wrong.into_iter().enumerate() {
            assert_eq!(put(&mut hand, messages).await.unwrap_err().code(), code, "number {index}");
        }
        // Neither is a piece with much else beside it.
        let much = with(&|m| m[1].names = vec![0; 1 << 20].into());
        let refused = put(&mut hand, much).await.unwrap_err();
        assert!(refused.message().contains("bytes for a piece of a state, at most"), "{refused}");
        // The second one under a lease counts.
        put(&mut hand, state(head, 4.0)).await.unwrap();
        let id = put(&mut hand, state(head, 5.0)).await.unwrap();
        answer(&hand, lease, id);
        hand.stay_until_drained().await;
    });
    assert!(values == vec![5.0; N]);
    await_nothing(&store);
}

#[test]
fn a_liar_about_its_state_is_set_aside_and_the_job_runs_elsewhere() {
    let (values, store) = under(async |address| {
        let mut liar = dial(address, 1).await;
        let (lease, first) = given(&mut liar).await;
        // The state that it was given is not one that it sent.
        answer(&liar, lease, first);
        let mut thief = dial(address, 2).await;
        let (theirs, _) = given(&mut thief).await;
        // Nor does a state under another one's lease count.
        let head = PutHead { n_state: N, lease: theirs, nonce: 1 };
        assert_eq!(put(&mut liar, state(head, 6.0)).await.unwrap_err().code(), Code::PermissionDenied);
        let id = put(&mut thief, state(PutHead { nonce: 2, ..head }, 7.0)).await.unwrap();
        answer(&liar, theirs, id);
        answer(&thief, theirs, id);
        thief.stay_until_drained().await;
    });
    assert!(values == vec![7.0; N]);
    await_nothing(&store);
}

#[test]
fn a_hoarder_has_no_more_transfers_than_its_slots_can_need() {
    let (values, store) = under(async |address| {
        let mut hand = dial(address, NONCE).await;
        let (lease, _) = given(&mut hand).await;
        let head = PutHead { n_state: N, lease, nonce: NONCE };
        let mut begun = Vec::new();
        let refused = loop {
            assert!(begun.len() < 100, "nobody stops it");
            let (sender, messages) = unbounded_channel();
            sender.send(head.encode()).unwrap();
            let mut client = hand.client.clone();
            let put = tokio::spawn(async move { client.put(UnboundedReceiverStream::new(messages)).await });
            begun.push((sender, put));
            // The ones before wait for pieces; one that is refused ends.
            let last = &mut begun.last_mut().unwrap().1;
            if let Ok(ended) = tokio::time::timeout(std::time::Duration::from_millis(300), last).await {
                break ended.unwrap().unwrap_err();
            }
        };
        assert_eq!(refused.code(), Code::ResourceExhausted);
        for (_, put) in begun {
            put.abort();
        }
        // What was begun and given up is counted no more.
        let id = loop {
            match put(&mut hand, state(head, 8.0)).await {
                Ok(id) => break id,
                Err(status) => assert_eq!(status.code(), Code::ResourceExhausted),
            }
        };
        answer(&hand, lease, id);
        hand.stay_until_drained().await;
    });
    assert!(values == vec![8.0; N]);
    await_nothing(&store);
}

#[test]
fn names_of_pieces_count_where_these_stand_in_the_shared_folder() {
    let scratch = tempfile::tempdir().unwrap();
    let path = scratch.path().join("run");
    let store = StateStore::shared(Folder::at(&path));
    let (values, store) = under_with(store, async |address| {
        let mut hand = dial(address, NONCE).await;
        let (lease, _) = given(&mut hand).await;
        let head = PutHead { n_state: N, lease, nonce: NONCE };
        let bytes: Vec<Vec<u8>> = pieces(9.0).into_iter().map(|piece| piece.data.to_vec()).collect();
        let names: Vec<[u8; 32]> = bytes.iter().map(|piece| starlings_proto::digest(piece)).collect();
        let folder = Folder::at(&path);
        let named = || vec![head.encode(), encode_names(&names)];
        // None is there, then one; then the last one is too short.
        assert_eq!(put(&mut hand, named()).await.unwrap_err().code(), Code::FailedPrecondition);
        folder.put(&names[0], &bytes[0]).unwrap();
        assert_eq!(put(&mut hand, named()).await.unwrap_err().code(), Code::FailedPrecondition);
        folder.put(&names[1], &bytes[1][8..]).unwrap();
        assert_eq!(put(&mut hand, named()).await.unwrap_err().code(), Code::FailedPrecondition);
        folder.put(&names[1], &bytes[1]).unwrap();
        for wrong in [vec![names[1], names[0]], vec![names[0]], vec![names[0], names[1], names[1]]] {
            assert!(put(&mut hand, vec![head.encode(), encode_names(&wrong)]).await.is_err());
        }
        // Pieces and names may follow each other.
        let mixed = vec![head.encode(), encode_chunk(bytes[0].clone().into()), encode_names(&names[1..])];
        let id = put(&mut hand, mixed).await.unwrap();
        answer(&hand, lease, id);
        hand.stay_until_drained().await;
    });
    assert!(values == vec![9.0; N]);
    await_nothing(&store);
    store.tidy();
}
