//! Callers that have not proved themselves, of which there are only so many at a time.

use std::collections::VecDeque;
use std::net::IpAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use tokio::sync::Notify;

/// Strangers at a time: each holds a socket and at most some dozens of kilobytes.
pub(super) const MOST: usize = 256;

/// How long one that was refused may take to read why.
const FAREWELL: Duration = Duration::from_secs(1);

/// Whoever is at the other end of a connection.
pub(super) struct Caller {
    peer: IpAddr,
    is_proven: AtomicBool,
    is_refused: AtomicBool,
    /// Told when it is refused.
    refused: Notify,
    /// Told when it has to make room.
    displaced: Notify,
}

impl Caller {
    fn new(peer: IpAddr) -> Self {
        let flag = || AtomicBool::new(false);
        let (refused, displaced) = (Notify::new(), Notify::new());
        Self { peer, is_proven: flag(), is_refused: flag(), refused, displaced }
    }

    pub(super) fn peer(&self) -> IpAddr {
        self.peer
    }

    /// It has the token: from now on it is no stranger.
    pub(super) fn prove(&self) {
        self.is_proven.store(true, Ordering::Relaxed);
    }

    pub(super) fn is_proven(&self) -> bool {
        self.is_proven.load(Ordering::Relaxed)
    }

    /// It showed that it does not belong here: its connection ends soon.
    pub(super) fn refuse(&self) {
        self.is_refused.store(true, Ordering::Relaxed);
        self.refused.notify_one();
    }

    pub(super) fn is_refused(&self) -> bool {
        self.is_refused.load(Ordering::Relaxed)
    }

    /// Ends when the stranger's time is up.
    pub(super) fn patience(self: &Arc<Self>, patience: Duration) -> impl Future<Output = ()> + Send + use<> {
        let caller = Arc::clone(self);
        async move {
            tokio::select! {
                () = tokio::time::sleep(patience) => {}
                () = caller.displaced.notified() => {}
                () = async {
                    caller.refused.notified().await;
                    tokio::time::sleep(FAREWELL).await;
                } => {}
            }
        }
    }
}

/// The strangers, the oldest first.
#[derive(Default)]
pub(super) struct Strangers(Mutex<VecDeque<Weak<Caller>>>);

impl Strangers {
    /// One more; where there are too many, the oldest goes.
    pub(super) fn arrive(&self, peer: IpAddr) -> Arc<Caller> {
        let caller = Arc::new(Caller::new(peer));
        let mut waiting = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        waiting.retain(|other| other.upgrade().is_some_and(|other| !other.is_proven()));
        while waiting.len() >= MOST {
            if let Some(oldest) = waiting.pop_front().and_then(|oldest| oldest.upgrade()) {
                oldest.displaced.notify_one();
            }
        }
        waiting.push_back(Arc::downgrade(&caller));
        caller
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOST: IpAddr = IpAddr::V4(std::net::Ipv4Addr::LOCALHOST);

    /// Whether its time is up.
    fn is_up(caller: &Arc<Caller>) -> bool {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let patience = caller.patience(Duration::from_mins(10));
        runtime.block_on(async { tokio::time::timeout(Duration::from_millis(1), patience).await.is_ok() })
    }

    #[test]
    fn the_oldest_stranger_makes_room_and_one_that_proved_itself_stays() {
        let strangers = Strangers::default();
        let proven = strangers.arrive(HOST);
        proven.prove();
        let oldest = strangers.arrive(HOST);
        let mut others: Vec<_> = (1..MOST).map(|_| strangers.arrive(HOST)).collect();
        assert!(!is_up(&oldest), "there is room for as many");
        let last = strangers.arrive(HOST);
        assert!(is_up(&oldest) && !is_up(&last) && !is_up(&proven));
        assert!(!is_up(&others[0]));
        // Those that went by themselves leave their room.
        others.clear();
        let next = strangers.arrive(HOST);
        assert!(!is_up(&last) && !is_up(&next));
        assert!(strangers.0.lock().unwrap().len() < 5);
    }
}
