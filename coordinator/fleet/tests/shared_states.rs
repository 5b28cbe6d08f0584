//! States in a folder that machines share: runs and mixing there give the bits that they give over the connection, whoever is lost.
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use fleet_kit::hand::{Hand, block_on, hello};
use fleet_kit::shared::{N, Own, Shared};
use fleet_kit::{ThreadWorker, await_workers, factory};
use starlings_fleet::{Fleet, FleetError, FleetEvent, Folder, Held, hex};
use starlings_models::{Job, Prediction, Setup, Window};
use starlings_proto::{Block, FromWorker, Hello, Lease, ToWorker};
use starlings_worker::{Factory, News};

/// Every value depends on the one before the run, its place and the particle.
fn moved(job: &Job) -> Prediction {
    let from = job.state.as_deref().expect("every job has a state");
    let p = f64::from(job.particle);
    let state = from.iter().enumerate().map(|(i, x)| x * 1.000_001 + p / (1.0 + i as f64)).collect();
    Prediction { outputs: vec![from[7] + p; 2], state, cost: 0.0 }
}

fn models() -> Factory {
    factory(|job| Ok(moved(job)))
}

fn job(particle: u32, state: Held) -> Job<Held> {
    let window = Window::free(0.0, vec![1.0], 2, vec![]);
    Job { particle, record: 0, window: Arc::new(window), theta: vec![], state: Some(state) }
}

/// Runs every state as the state of a particle; the end states are what the model makes of them.
fn assert_runs(shared: &mut Shared) {
    let states = shared.states();
    let setup = shared.fleet.install(&Setup::default()).unwrap();
    let jobs = (0..).zip(&states).map(|(k, state)| (setup, job(k, Held::Stored(state.clone()))));
    let outcomes = shared.fleet.run_held(jobs.collect()).unwrap();
    for ((k, state), outcome) in (0..).zip(&states).zip(outcomes) {
        let values = state.values().unwrap();
        let job = job(k, Held::Values(values)).try_map(Held::for_model).unwrap();
        let ended = outcome.result.unwrap().state;
        assert!(matches!(&ended, Held::Stored(_)));
        assert!(ended.into_values().unwrap() == moved(&job).state, "particle {k}");
    }
}

#[test]
fn runs_through_the_folder_end_in_the_bits_of_the_model_and_what_nobody_needs_goes() {
    let mut shared = Shared::new();
    let _workers = [1, 2].map(|_| shared.worker(models()));
    assert_runs(&mut shared);
    assert_eq!(shared.store.in_memory(), (0, 0), "no value is in the coordinator");
    assert!(shared.files().len() > 10 * 13, "it was used");
    // Of the second round everything goes with the third one's beginning.
    assert_runs(&mut shared);
    let states = shared.states();
    shared.store.tidy();
    let needed: usize = states.iter().map(|state| state.pieces().len()).sum();
    assert!(shared.files().len() <= needed + 14, "the states, the probe and what is kept for control runs");
}

#[test]
fn a_worker_that_sees_another_folder_says_so_and_takes_states_over_the_connection() {
    let mut shared = Shared::new();
    let elsewhere = tempfile::tempdir().unwrap();
    let news = Arc::<Mutex<Vec<News>>>::default();
    let heard = Arc::clone(&news);
    let place = elsewhere.path().to_str().unwrap().parse().unwrap();
    let _worker = ThreadWorker::start_with(shared.fleet.address().unwrap(), models(), |config| {
        config.states = Some(place);
        config.tell = Arc::new(move |news| heard.lock().unwrap().push(news.clone()));
    });
    await_workers(&shared.events, 1);
    assert_runs(&mut shared);
    let news = news.lock().unwrap();
    assert!(news.iter().any(|news| matches!(news, News::DoesNotShare { .. })), "{news:?}");
    assert_eq!(std::fs::read_dir(elsewhere.path()).unwrap().count(), 0, "it leaves nothing there");
    let states = shared.states();
    assert!(Own::of(&states).on(&mut shared.fleet).unwrap().is_none(), "the caller mixes");
}

#[test]
fn states_mixed_by_workers_are_those_that_the_caller_makes() {
    let mut shared = Shared::new();
    let _workers = [1, 2].map(|_| shared.worker(models()));
    let states = shared.states();
    let own = Own::of(&states);
    let mixed = own.on(&mut shared.fleet).unwrap().expect("workers share the folder");
    // The first block of each worker is compared.
    assert!((1..=2).contains(&own.made.lock().unwrap().len()), "{:?}", own.made);
    own.assert_same(&mixed);
    assert_eq!(shared.store.in_memory(), (0, 0));
    drop((states, own));
    let again = Own::of(&mixed);
    again.assert_same(&again.on(&mut shared.fleet).unwrap().unwrap());
    let made = again.made.lock().unwrap().len();
    assert!(made <= 1, "later ones are compared seldom: {made}");
}

/// A worker by hand that says it sees the folder.
async fn sharing(shared: &Shared) -> Hand {
    let hand = Hand::dial(shared.fleet.address().unwrap(), Hello { nonce: 77, ..hello() }).await;
    hand.say(FromWorker::SharesStates);
    await_sharing(&shared.events).await;
    hand
}

/// Waits for the news while the hand's messages travel on this thread.
async fn await_sharing(events: &Receiver<FleetEvent>) {
    let shared = async {
        while !events.try_iter().any(|event| matches!(event, FleetEvent::SharesStates { .. })) {
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
    };
    tokio::time::timeout(Duration::from_secs(60), shared).await.expect("it is told within a minute");
}

/// The next block that it is given.
async fn block(hand: &mut Hand) -> (Lease, Block) {
    loop {
        if let ToWorker::Recombine { lease, block } = hand.hear().await.expect("still connected") {
            return (lease, block);
        }
    }
}

/// What was seen while `play` played a worker that was given the first block before a real one came.
struct Played {
    /// Blocks that the caller made.
    own: usize,
    /// Blocks that the hand was given after it had played.
    given: usize,
    events: Receiver<FleetEvent>,
}

fn while_mixing(play: impl AsyncFnOnce(Hand, Lease, Block) -> Option<Hand>) -> Played {
    while_mixing_in(async |_: &Folder, _: &Own, hand, lease, block| play(hand, lease, block).await)
}

/// Mixes on another thread; whatever is played, also in the folder, the states are right.
fn while_mixing_in(play: impl AsyncFnOnce(&Folder, &Own, Hand, Lease, Block) -> Option<Hand>) -> Played {
    let shared = Shared::new();
    let states = shared.states();
    let (own, known) = (Own::of(&states), Own::of(&states));
    let folder = Folder::at(&shared.path);
    block_on(async {
        let mut hand = sharing(&shared).await;
        let (place, address) = (shared.place.clone(), shared.fleet.address().unwrap());
        let Shared { mut fleet, events, store, scratch, .. } = shared;
        let mixing = std::thread::spawn(move || (own.on(&mut fleet), own, fleet));
        let (lease, first) = block(&mut hand).await;
        let _worker = ThreadWorker::start_with(address, models(), |config| config.states = Some(place));
        await_sharing(&events).await;
        let hand = play(&folder, &known, hand, lease, first).await;
        let (mixed, own, fleet) = tokio::task::spawn_blocking(|| mixing.join().unwrap()).await.unwrap();
        own.assert_same(&mixed.unwrap().expect("the other worker shares the folder"));
        assert_eq!(store.in_memory(), (0, 0));
        tokio::task::spawn_blocking(|| drop(fleet));
        let mut given = 0;
        if let Some(mut hand) = hand {
            while let Some(message) = hand.hear().await {
                given += usize::from(matches!(message, ToWorker::Recombine { .. }));
            }
        }
        drop(scratch);
        let own = own.made.lock().unwrap().len();
        Played { own, given, events }
    })
}

#[test]
fn a_worker_that_is_lost_while_it_mixes_costs_its_blocks_only() {
    let played = while_mixing(async |_, _, _| None);
    assert_eq!(played.own, 1, "the first block of the other one is compared");
}

#[test]
fn a_worker_that_cannot_mix_gives_its_blocks_to_others_and_gets_no_more() {
    let played = while_mixing(async |mut hand, lease, _| {
        let _second = block(&mut hand).await;
        hand.say(FromWorker::Recombined { lease, made: Err("the folder is gone".to_owned()) });
        Some(hand)
    });
    assert_eq!((played.own, played.given), (1, 0));
}

#[test]
fn a_worker_that_mixes_otherwise_is_put_out_and_all_is_mixed_again() {
    let played = while_mixing(async |mut hand, lease, block| {
        // Pieces that are there, and not those that belong there.
        hand.say(FromWorker::Recombined { lease, made: Ok(block.pieces) });
        hand.stay_until_drained().await;
        // It stays connected, and wants to go on.
        hand.say(FromWorker::SharesStates);
        Some(hand)
    });
    let told = excluded(&played);
    assert!(told.contains("is another one than here; 0 of its blocks were used before"), "{told}");
    assert_eq!(played.given, 0, "it is given nothing any more");
}

/// What was told of the worker that was put out; it is one no more.
fn excluded(played: &Played) -> String {
    let events: Vec<_> = played.events.try_iter().collect();
    let left = |event: &FleetEvent| matches!(event, FleetEvent::WorkerLeft { reason, .. } if reason.contains("block"));
    assert!(events.iter().any(left), "{events:?}");
    let fits = |event: &&FleetEvent| matches!(event, FleetEvent::WorkerExcluded { .. });
    events.iter().find(fits).expect("it is told").to_string()
}

#[test]
fn a_worker_that_names_the_right_pieces_and_writes_others_is_put_out_and_all_is_mixed_again() {
    let played = while_mixing_in(async |place: &Folder, own: &Own, mut hand, lease, _| {
        let pieces = own.block(0).unwrap();
        for (name, bytes) in &pieces {
            place.put(name, &vec![1; bytes.len()]).unwrap();
        }
        let made = Ok(pieces.into_iter().map(|(name, _)| name).collect());
        hand.say(FromWorker::Recombined { lease, made });
        hand.stay_until_drained().await;
        Some(hand)
    });
    assert!(excluded(&played).contains("is not what its names say"));
}

#[test]
fn answers_for_blocks_that_were_not_asked_for_change_nothing() {
    while_mixing(async |hand, lease, block| {
        for wrong in [Lease { job: lease.job + 50, ..lease }, Lease { epoch: lease.epoch + 1, ..lease }] {
            hand.say(FromWorker::Recombined { lease: wrong, made: Ok(block.pieces.clone()) });
        }
        // Too few names, and then the same again.
        for _ in 0..2 {
            hand.say(FromWorker::Recombined { lease, made: Ok(block.pieces[..2].to_vec()) });
        }
        None
    });
}

#[test]
fn a_damaged_and_a_missing_piece_end_the_mixing_and_a_run_with_the_name_of_the_file() {
    for damage in [true, false] {
        let mut shared = Shared::new();
        let _worker = shared.worker(models());
        let states = shared.states();
        let name = hex(&states[2].pieces()[4]);
        let file = shared.path.join(&name);
        if damage {
            std::fs::write(&file, vec![0; 256 * 1024]).unwrap();
        } else {
            std::fs::remove_file(&file).unwrap();
        }
        let setup = shared.fleet.install(&Setup::default()).unwrap();
        let error =
            shared.fleet.run_held(vec![(setup, job(0, Held::Stored(states[2].clone())))]).unwrap_err();
        assert!(matches!(&error, FleetError::State(text) if text.contains(&name)), "{error}");
        let error = Own::of(&states).on(&mut shared.fleet).unwrap_err();
        assert!(matches!(&error, FleetError::State(text) if text.contains(&name)), "{error}");
    }
}

#[test]
fn a_run_that_ends_in_a_state_which_is_not_finite_is_the_workers_fault_in_the_folder_too() {
    let mut shared = Shared::new();
    let spoiled = factory(|job| {
        let mut prediction = moved(job);
        prediction.state = (0..N).map(|i| if i == 70_000 { f64::NAN } else { 0.0 }).collect();
        Ok(prediction)
    });
    let _bad = shared.worker(spoiled);
    let (place, address) = (shared.place.clone(), shared.fleet.address().unwrap());
    let good = std::thread::spawn(move || {
        // It comes when the first one is set aside, or before: the outcome is the same.
        ThreadWorker::start_with(address, models(), |config| config.states = Some(place))
    });
    assert_runs(&mut shared);
    drop(good.join().unwrap());
}
