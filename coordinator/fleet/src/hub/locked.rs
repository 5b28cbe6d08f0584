//! The hub's lock: what is decided under it lets go of states, whose files and memory go after it.
//!
//! Files may take long to go, as on a shared file system, and memory of many pages does; a thread of the network that waits for them hears no heartbeat. Next file
//! to read: [`super::state`].

use std::ops::{Deref, DerefMut};
use std::sync::MutexGuard;

use starlings_states::StoredState;
use tokio::runtime::Handle;

use super::state::State;

/// The state of the fleet, for as long as this thread alone has it.
pub(super) struct Locked<'a>(Option<MutexGuard<'a, State>>);

impl<'a> Locked<'a> {
    pub(super) fn new(state: MutexGuard<'a, State>) -> Self {
        Self(Some(state))
    }
}

impl Deref for Locked<'_> {
    type Target = State;

    fn deref(&self) -> &State {
        self.0.as_ref().expect("it is held until it is dropped")
    }
}

impl DerefMut for Locked<'_> {
    fn deref_mut(&mut self) -> &mut State {
        self.0.as_mut().expect("it is held until it is dropped")
    }
}

impl Drop for Locked<'_> {
    fn drop(&mut self) {
        let Some(mut state) = self.0.take() else { return };
        let (gone, lent) = state.states.gone();
        drop(state);
        let slow: Vec<StoredState> = gone.into_iter().filter(StoredState::goes_slowly).collect();
        match Handle::try_current() {
            Ok(runtime) if !slow.is_empty() || !lent.is_empty() => {
                drop(runtime.spawn_blocking(|| drop((slow, lent))));
            }
            _ => drop((slow, lent)),
        }
    }
}
