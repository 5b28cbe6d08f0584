//! Setups built so far: only a cache, filled by the coordinator on every connection.
//!
//! Building may take long, so it happens on threads of its own, as few as there is work for. The cache keeps the latest
//! [`KEPT`] setups: a job whose setup is gone goes back to the coordinator, which sends the setup again. Next file to read:
//! `slots`.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use starlings_models::{Factory, Forward, Setup};
use starlings_proto::words::panic_text;
use starlings_proto::{ProtocolError, SetupId};

/// Setups kept built: a screening sends some dozens, each of a few kilobytes.
pub(crate) const KEPT: usize = 512;

/// Setups built at the same time, so that one that takes minutes does not hold up the others.
const BUILDERS: usize = 4;

/// Setups that may wait to be built: more than any batch has.
const WAITING: usize = 1 << 16;

/// Told how building went.
pub(crate) type Tell = Box<dyn FnOnce(Result<(), String>) + Send>;

/// Shared between the network and the threads that build.
#[derive(Clone)]
pub(crate) struct Setups {
    factory: Factory,
    shared: Arc<Mutex<Shared>>,
}

#[derive(Default)]
struct Shared {
    built: BTreeMap<SetupId, Built>,
    /// Missed by a job since they were last ordered.
    missed: BTreeSet<SetupId>,
    /// Counts uses.
    now: u64,
    waiting: VecDeque<Order>,
    builders: usize,
}

struct Built {
    forward: Arc<dyn Forward>,
    used: u64,
}

/// A setup to build.
struct Order {
    id: SetupId,
    setup: Result<Box<Setup>, ProtocolError>,
    tell: Tell,
}

impl Setups {
    pub(crate) fn new(factory: Factory) -> Self {
        Self { factory, shared: Arc::default() }
    }

    /// A built setup, unless it never was or is forgotten.
    pub(crate) fn get(&self, id: &SetupId) -> Option<Arc<dyn Forward>> {
        let mut shared = self.lock();
        shared.now += 1;
        let now = shared.now;
        let built = shared.built.get_mut(id)?;
        built.used = now;
        Some(Arc::clone(&built.forward))
    }

    /// Notes that a job found its setup forgotten; says whether it is the first one since the setup was last ordered.
    pub(crate) fn miss(&self, id: SetupId) -> bool {
        self.lock().missed.insert(id)
    }

    /// Builds a setup, on another thread, and tells how that went; one that is there already is only told of.
    pub(crate) fn order(&self, id: SetupId, setup: Result<Box<Setup>, ProtocolError>, tell: Tell) {
        let mut shared = self.lock();
        shared.missed.remove(&id);
        if shared.waiting.len() >= WAITING {
            drop(shared);
            return tell(Err(format!("{WAITING} setups wait to be built already")));
        }
        shared.waiting.push_back(Order { id, setup, tell });
        if shared.builders >= BUILDERS {
            return;
        }
        shared.builders += 1;
        drop(shared);
        let own = self.clone();
        let spawned = std::thread::Builder::new().name("setup".to_owned()).spawn(move || own.work());
        if let Err(error) = spawned {
            let mut shared = self.lock();
            shared.builders -= 1;
            // A running builder takes it next; only without one the failure to start a thread matters.
            let stranded =
                if shared.builders == 0 { std::mem::take(&mut shared.waiting) } else { VecDeque::new() };
            drop(shared);
            for order in stranded {
                (order.tell)(Err(format!("no thread to build it: {error}")));
            }
        }
    }

    /// Builds what waits, until nothing does.
    fn work(&self) {
        while let Some(Order { id, setup, tell }) = self.next() {
            tell(if self.get(&id).is_some() { Ok(()) } else { self.build(id, setup) });
        }
    }

    fn next(&self) -> Option<Order> {
        let mut shared = self.lock();
        let order = shared.waiting.pop_front();
        if order.is_none() {
            shared.builders -= 1;
        }
        order
    }

    fn build(&self, id: SetupId, setup: Result<Box<Setup>, ProtocolError>) -> Result<(), String> {
        let setup = setup.map_err(|error| error.to_string())?;
        let forward = catch_unwind(AssertUnwindSafe(|| (self.factory)(&setup)))
            .map_err(|panic| panic_text(panic.as_ref()))?
            .map_err(|error| error.to_string())?;
        self.keep(id, Arc::from(forward));
        Ok(())
    }

    /// Keeps a built setup and forgets the one that was not used for longest when there are too many.
    fn keep(&self, id: SetupId, forward: Arc<dyn Forward>) {
        let mut shared = self.lock();
        shared.now += 1;
        let used = shared.now;
        shared.built.insert(id, Built { forward, used });
        if shared.built.len() > KEPT {
            let oldest = shared.built.iter().min_by_key(|(_, built)| built.used).map(|(id, _)| *id);
            oldest.and_then(|id| shared.built.remove(&id));
        }
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use starlings_models::BuildSetup;

    use super::*;

    fn id(i: usize) -> SetupId {
        let mut id = [0; 32];
        id[..8].copy_from_slice(&(i as u64).to_le_bytes());
        id
    }

    fn oscillator() -> Box<Setup> {
        let mut setup = Setup::default();
        setup.model.kind = "oscillator".to_owned();
        setup.model.constants = [("m", 1.0), ("c", 0.1), ("k", 1.0)].map(|(n, v)| (n.to_owned(), v)).into();
        Box::new(setup)
    }

    #[test]
    fn the_setup_that_was_not_used_for_longest_is_forgotten() {
        let setups = Setups::new(Arc::new(|setup: &Setup| setup.build()));
        let (sender, told) = mpsc::channel();
        let order = |i: usize| {
            let sender = sender.clone();
            setups.order(id(i), Ok(oscillator()), Box::new(move |result| drop(sender.send(result))));
            told.recv().expect("each order is answered").expect("an oscillator builds");
        };
        (0..KEPT).for_each(order);
        assert!(setups.get(&id(0)).is_some(), "used again, so the next one is the oldest");
        order(KEPT);
        assert!(setups.get(&id(0)).is_some() && setups.get(&id(KEPT)).is_some());
        assert!(setups.get(&id(1)).is_none());
        assert_eq!([setups.miss(id(1)), setups.miss(id(1)), setups.miss(id(2))], [true, false, true]);
        order(1);
        assert!(setups.miss(id(1)), "ordered again, it may be missed again");
        assert_eq!(setups.lock().built.len(), KEPT);
    }

    #[test]
    fn many_orders_at_once_are_all_answered_by_few_threads() {
        let setups = Setups::new(Arc::new(|setup: &Setup| setup.build()));
        let (sender, told) = mpsc::channel();
        for i in 0..200 {
            let (sender, own) = (sender.clone(), setups.clone());
            let tell = move |result| drop(sender.send((result, own.lock().builders)));
            setups.order(id(i), Ok(oscillator()), Box::new(tell));
        }
        for _ in 0..200 {
            let (result, builders) = told.recv().expect("each order is answered");
            assert_eq!(result, Ok(()));
            assert!((1..=BUILDERS).contains(&builders), "{builders}");
        }
        assert!((0..200).all(|i| setups.get(&id(i)).is_some()), "none is forgotten");
    }
}
