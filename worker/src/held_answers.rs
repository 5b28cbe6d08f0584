//! Answers to leases for runs that ended before the leases came: on a thread that waits for the network.
//!
//! Next file to read: [`crate::held`].

use std::sync::Arc;

use starlings_proto::convert::ended;
use starlings_proto::{JobKey, Lease, LeaseOutcome};

use crate::held::{Ended, Held};
use crate::inbox::Inbox;
use crate::outbox::Outbox;
use crate::slots::Asked;

/// Answers leases that are for no run that goes on; what is not held is given back.
pub(crate) fn answer(
    runs: Vec<(JobKey, Lease)>,
    outbox: &Outbox,
    held: Option<&Arc<Held>>,
    rest_is_void: bool,
    inbox: &Inbox,
) {
    let keys = runs.iter().map(|(key, _)| *key).collect::<Vec<_>>();
    let mut known = held.map(|held| held.claim(&keys)).unwrap_or_default();
    if rest_is_void && let Some(held) = held {
        held.drop_void();
    }
    let mut found = Vec::new();
    for (key, lease) in runs {
        match known.remove(&key) {
            Some(ended) => found.push((ended, inbox.asked(lease, outbox))),
            None => outbox.answer(lease, LeaseOutcome::Withdrawn, 0.0),
        }
    }
    let Some(held) = held.filter(|_| !found.is_empty()).cloned() else { return };
    let leases: Vec<_> = found.iter().map(|(_, asked)| asked.lease).collect();
    let work = move || found.into_iter().for_each(|(ended, asked)| one(&held, ended, asked));
    if std::thread::Builder::new().name("held-answers".to_owned()).spawn(work).is_err() {
        for lease in leases {
            outbox.answer(lease, LeaseOutcome::Withdrawn, 0.0);
        }
    }
}

fn one(held: &Held, ended: Ended, asked: Asked) {
    let Asked { lease, outbox, transfers, .. } = asked;
    let (answer, cost) = match ended {
        Ended::Large(large) => {
            let put = large.put(&transfers, lease);
            held.was_put(&large, put.is_ok());
            (LeaseOutcome::Ran(put), large.cost())
        }
        Ended::Inside(bytes) => match ended::decode(&bytes) {
            Ok((result, cost)) => (LeaseOutcome::Ran(result), cost),
            // It is made again.
            Err(_) => (LeaseOutcome::Withdrawn, 0.0),
        },
    };
    outbox.answer_when_room(lease, answer, cost);
}
