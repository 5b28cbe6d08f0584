//! What is held, and for how long.

use starlings_models::{Job, Prediction, Window};
use starlings_proto::convert::ended;
use starlings_proto::{State, job_key};

use super::*;

const RUN: Run = Run { id: [1; 16], incarnation: 1 };

fn held(memory: usize, disk: u64) -> Arc<Held> {
    Arc::new(Held::new(HoldLimits { memory, disk }, &std::env::temp_dir()))
}

fn job(particle: u32) -> Arc<Job> {
    let window = Window { start: 0.0, times: vec![1.0], observed: vec![0.0], inputs: vec![], since: vec![] };
    Arc::new(Job { particle, record: 0, window: window.into(), theta: vec![0.5], state: None })
}

fn keep(held: &Held, particle: u32) -> bool {
    let outputs = vec![f64::from(particle); 100];
    let prediction = Prediction { outputs, state: State::default(), cost: 0.5 };
    held.keep(Of::Job([7; 32], job(particle)), Ended::inside(&Ok(prediction), 0.5), false)
}

fn large(n: u8) -> Arc<Large> {
    let prediction = Prediction { outputs: vec![1.0], state: vec![f64::from(n); 1000].into(), cost: 0.5 };
    Arc::new(Large::new(prediction))
}

fn particle(ended: &[u8]) -> f64 {
    ended::decode(ended).unwrap().0.unwrap().outputs[0]
}

/// What is sent, in no order.
fn particles(held: &Arc<Held>) -> Vec<f64> {
    let portions = held.delivery(1500).inspect(|portion| assert!(portion.len() <= 2));
    let mut all: Vec<_> = portions.flatten().map(|run| particle(&run.ended.unwrap())).collect();
    all.sort_by(f64::total_cmp);
    all
}

#[test]
fn what_does_not_fit_into_memory_waits_on_disk_and_comes_back_whole_as_often_as_it_is_needed() {
    let held = held(5000, 10_000);
    assert!(!held.connected(RUN), "the first one has no earlier one");
    held.disconnected();
    let most = (0..1000).take_while(|particle| keep(&held, *particle)).count();
    assert!((10..20).contains(&most), "{most}");
    assert!(held.connected(Run { incarnation: 2, ..RUN }));
    // The one that did not fit is in memory all the same: it was computed.
    let all: Vec<f64> = (0..=most).map(|i| i as f64).collect();
    assert_eq!(particles(&held), all);
    // The connection broke before it had arrived.
    held.disconnected();
    held.connected(Run { incarnation: 3, ..RUN });
    assert_eq!(particles(&held), all);
    let key = |particle| job_key(&[7; 32], &job(particle));
    let found = held.claim(&[key(most as u32), key(5000)]);
    assert_eq!(found.into_keys().collect::<Vec<_>>(), [key(most as u32)]);
}

#[test]
fn while_connected_the_last_ones_are_kept_and_another_run_gets_none() {
    let held = held(3000, 0);
    held.connected(RUN);
    assert!((0..50).all(|particle| keep(&held, particle)), "what was sent makes room");
    let last = particles(&held);
    assert_eq!(last.last(), Some(&49.0));
    assert!((1..4).contains(&last.len()), "{last:?}");
    assert!(!held.connected(Run { id: [2; 16], incarnation: 1 }));
    assert_eq!(held.delivery(1000).count(), 0);
}

#[test]
fn large_states_wait_in_files_of_their_own_and_count() {
    let held = held(9000, 40_000);
    let keep = |n: u8| held.keep(Of::Key([n; 32]), Ended::Large(large(n)), false);
    held.connected(RUN);
    held.disconnected();
    let most = (10..30).take_while(|n| keep(*n)).count();
    assert!((4..8).contains(&most), "{most}");
    held.connected(Run { incarnation: 2, ..RUN });
    assert_eq!(held.delivery(1000).count(), 0, "none fits into a message");
    let mut all = held.large();
    all.sort_unstable();
    assert_eq!(all, (10..=10 + most as u8).map(|n| [n; 32]).collect::<Vec<_>>());
    assert!(matches!(held.claim(&[[10; 32]]).get(&[10; 32]), Some(Ended::Large(_))));
}

#[test]
fn a_large_state_is_held_until_it_has_arrived_however_large_it_is() {
    let held = held(3000, 1 << 20);
    held.connected(RUN);
    let states: Vec<_> = (0..4).map(large).collect();
    for (n, large) in states.iter().enumerate() {
        assert!(held.keep(Of::Key([n as u8; 32]), Ended::Large(Arc::clone(large)), true));
    }
    assert_eq!(held.large().len(), 4, "all are on their way");
    assert!(states.iter().all(|large| large.bytes().1 == 0), "they are in memory as long as they are put");
    // One arrives, the connection breaks under the others.
    assert_eq!(held.was_put(&states[0], true).1.len(), 1, "its memory can be used again");
    assert_eq!(held.large().len(), 3);
    held.disconnected();
    for large in &states[1..] {
        assert!(held.was_put(large, false).0);
    }
    assert!(states[1..].iter().all(|large| large.bytes().1 == 8000), "each is larger than the memory");
    assert!(held.connected(Run { incarnation: 2, ..RUN }));
    let _told = held.delivery(1000);
    assert!((10..50).all(|particle| keep(&held, particle)), "others come and go");
    let mut owed = held.large();
    owed.sort_unstable();
    assert_eq!(owed, [[1; 32], [2; 32], [3; 32]]);
    let Ended::Large(asked) = &held.claim(&[[2; 32]])[&[2; 32]] else { panic!("large") };
    held.drop_void();
    assert!((50..90).all(|particle| keep(&held, particle)));
    assert!(held.large().contains(&[2; 32]), "it is asked for");
    held.was_put(asked, true);
    assert!((90..130).all(|particle| keep(&held, particle)));
    assert_eq!(held.large().len(), 0);
}
