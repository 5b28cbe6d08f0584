//! Runs that fail for one reason: the first is told, the others are counted and told in one line at the end.
//!
//! Two reasons are one where they differ by numbers only, such as the time at which an integration stopped. Next file to read:
//! [`mod@super::relay`].

use starlings_coordinator::fleet::FleetEvent;

/// What was told of runs that failed, and how many were like it.
#[derive(Default)]
pub(super) struct Repeated(Vec<Reason>);

struct Reason {
    /// Without what numbers are written with.
    words: String,
    /// The first of them, as it was given.
    first: String,
    more: u64,
}

impl Repeated {
    /// Whether an event is a failure like one before; it is counted then.
    pub(super) fn is_known(&mut self, event: &FleetEvent) -> bool {
        let FleetEvent::JobFailed { reason, .. } = event else { return false };
        let words: String = reason.chars().filter(|c| !c.is_ascii_digit() && !".-+e".contains(*c)).collect();
        if let Some(known) = self.0.iter_mut().find(|known| known.words == words) {
            known.more += 1;
            return true;
        }
        self.0.push(Reason { words, first: reason.clone(), more: 0 });
        false
    }

    /// One line for each reason of which more than one run failed.
    pub(super) fn told(&self) -> impl Iterator<Item = String> + '_ {
        self.0.iter().filter(|reason| reason.more > 0).map(|Reason { first, more, .. }| {
            let runs = if *more == 1 { "run was" } else { "runs were" };
            format!("{more} more {runs} given up for the same reason: {first}")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_that_fail_for_one_reason_are_told_once_with_their_number() {
        let failed = |particle, reason: &str| FleetEvent::JobFailed {
            particle,
            record: 0,
            parameters: Vec::new(),
            attempts: 1,
            reason: reason.to_owned(),
        };
        let mut seen = Repeated::default();
        assert!(!seen.is_known(&failed(0, "more than 1000 steps of integration, at t = 0.25")));
        assert!(!seen.is_known(&failed(1, "state `x` is not a finite number at t = 3")));
        for particle in 2..230 {
            let time = 1e-9 * f64::from(particle);
            let reason = format!("more than 1000 steps of integration, at t = {time:e}");
            assert!(seen.is_known(&failed(particle, &reason)), "{particle}");
        }
        assert!(!seen.is_known(&FleetEvent::Progress { done: 1, total: 2 }));
        let told: Vec<String> = seen.told().collect();
        let first = "more than 1000 steps of integration, at t = 0.25";
        assert_eq!(told, [format!("228 more runs were given up for the same reason: {first}")]);
    }
}
