//! What can happen to a dispatcher, drawn at random.

use proptest::prelude::*;
use starlings_models::Timeout;

/// One thing that the world does; numbers choose among what is possible then.
#[derive(Clone, Debug)]
pub(super) enum Act {
    Join(u32),
    Reconnect(usize),
    Lose(usize, bool),
    BuildSetup(usize, bool),
    ForgetSetup(usize),
    Answer(usize, f64),
    Fail(usize),
    Crash(usize),
    Place(usize),
    Late(usize),
    Repeat(usize),
    /// A worker comes along with a job.
    Bring(usize, usize, Brought),
    Wait(u64),
}

/// How far a job is that a worker comes along with.
#[derive(Clone, Copy, Debug)]
pub(super) enum Brought {
    Computing,
    Made,
    Failed,
}

pub(super) fn act() -> impl Strategy<Value = Act> {
    prop_oneof![
        2 => (1_u32..4).prop_map(Act::Join),
        1 => any::<usize>().prop_map(Act::Reconnect),
        2 => (any::<usize>(), any::<bool>()).prop_map(|(who, clean)| Act::Lose(who, clean)),
        4 => (any::<usize>(), prop::bool::weighted(0.8)).prop_map(|(who, ok)| Act::BuildSetup(who, ok)),
        1 => any::<usize>().prop_map(Act::ForgetSetup),
        12 => (any::<usize>(), prop::sample::select(vec![1e-6, 1e-3, 1.0])).prop_map(|(which, cost)| Act::Answer(which, cost)),
        3 => any::<usize>().prop_map(Act::Fail),
        3 => any::<usize>().prop_map(Act::Crash),
        2 => any::<usize>().prop_map(Act::Place),
        1 => any::<usize>().prop_map(Act::Late),
        2 => any::<usize>().prop_map(Act::Repeat),
        3 => (any::<usize>(), any::<usize>(), brought()).prop_map(|(who, which, how)| Act::Bring(who, which, how)),
        1 => (1_u64..30).prop_map(Act::Wait),
    ]
}

fn brought() -> impl Strategy<Value = Brought> {
    prop::sample::select(vec![Brought::Computing, Brought::Made, Brought::Failed])
}

/// What a run says that was given up.
pub(super) fn late() -> Timeout {
    Timeout { limit: 1.0, says: "too late".to_owned() }
}
