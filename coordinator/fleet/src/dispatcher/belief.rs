//! Whose results may be used before their batch is over: what is handed on early may outlive this process.
//!
//! A worker that others can still contradict is not believed yet, nor is one that is in a dispute. Next file to read:
//! [`super::canary`].

use std::collections::BTreeSet;

use super::Dispatcher;
use super::firsts::Contributor;
use super::message::{BatchError, WorkerId};
use super::roster::Worker;
use crate::wire::Outcome;

impl Dispatcher {
    /// Outcomes of the running batch, or of one that ended in an error, that were not handed on before.
    pub(crate) fn arrived(&mut self) -> Vec<(usize, Outcome)> {
        let in_doubt = self.in_doubt();
        self.batch.as_mut().map_or_else(|| std::mem::take(&mut self.left), |batch| batch.arrived(&in_doubt))
    }

    /// The outcomes that a batch leaves behind when it ends in an error. Where workers disagree nobody knows which are right.
    pub(super) fn leftover(&mut self, error: &BatchError) -> Vec<(usize, Outcome)> {
        if matches!(error, BatchError::Disagreement { .. }) { Vec::new() } else { self.arrived() }
    }

    /// Workers whose results of this batch may turn out to be wrong.
    fn in_doubt(&self) -> BTreeSet<WorkerId> {
        let uncompared = self.repeats.firsts.iter().filter(|(id, contributor)| {
            self.repeats.repeats(contributor.index) || self.may_be_compared(*id, contributor)
        });
        let disputed = self.repeats.disputes.values().flat_map(|dispute| &dispute.opinions);
        uncompared.map(|(id, _)| id).chain(disputed.map(|opinion| opinion.by)).collect()
    }

    /// Whether another worker can repeat the first result of one, now or once it has built the setup: the first worker that is ready
    /// may have done it all.
    pub(super) fn may_be_compared(&self, id: WorkerId, contributor: &Contributor) -> bool {
        let Some(batch) = &self.batch else { return false };
        let (job, setup) = (batch.job_number(contributor.index), batch.setup_of(contributor.index));
        let could = |w: &Worker| {
            w.id != id && w.will_take(setup) && !w.holds(job) && !contributor.tried.contains(&w.id)
        };
        self.workers.values().any(could)
    }
}
