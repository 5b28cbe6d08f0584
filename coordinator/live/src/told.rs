//! What is heard of a run: how far it is, and what the fleet tells. Bounded, however long the run.
//!
//! Next file to read: [`super::course`].

use std::collections::VecDeque;

use starlings_fleet::{FleetEvent, Load, Reading};

use super::view::{EventView, FleetView, StageView, Standing, State, View, WorkerView};

/// Events that are kept.
const EVENTS: usize = 40;
/// Lost workers that are kept.
const LOST: usize = 20;
/// Stages that are kept.
const STAGES: usize = 60;
/// Workers that are shown.
const WORKERS: usize = 200;

/// What was heard so far.
#[derive(Clone, Debug, Default)]
pub struct Told {
    /// Whether it still runs.
    pub state: State,
    /// Why it ended, where it did before it was done.
    pub ended: String,
    standing: Standing,
    stages: Vec<StageView>,
    events: VecDeque<EventView>,
    lost: VecDeque<WorkerView>,
    aside: Vec<(String, String)>,
    losses: u64,
}

impl Told {
    /// Something happened at this time, s since the command began.
    pub fn event(&mut self, at_s: f64, event: &FleetEvent) {
        let worker = event.worker().unwrap_or_default();
        match event {
            FleetEvent::WorkerLeft { reason, .. } => {
                self.aside.retain(|(name, _)| name != worker);
                if event.is_of_roster() {
                    self.losses += 1;
                    let lost = WorkerView {
                        name: worker.to_owned(),
                        state: "lost".to_owned(),
                        why: reason.clone(),
                        at_s: Some(at_s),
                        ..WorkerView::default()
                    };
                    self.lost.push_front(lost);
                    self.lost.truncate(LOST);
                }
            }
            FleetEvent::WorkerSetAside { reason, .. } => {
                self.aside.retain(|(name, _)| name != worker);
                self.aside.push((worker.to_owned(), reason.clone()));
            }
            FleetEvent::WorkerBack { .. } => self.aside.retain(|(name, _)| name != worker),
            _ => {}
        }
        if event.is_notable() || event.is_of_roster() {
            let (kind, text) = (event.kind().to_owned(), event.to_string());
            self.events.push_front(EventView { at_s, kind, text });
            self.events.truncate(EVENTS);
        }
    }

    /// The work stands here.
    pub fn stands(&mut self, standing: Standing) {
        self.standing = standing;
    }

    /// A stage goes on or begins at this time, s since the command began.
    pub fn stage(&mut self, at_s: f64, standing: Standing) {
        match self.stages.last_mut() {
            Some(last) if last.name == standing.stage => last.says.clone_from(&standing.says),
            _ => {
                if self.stages.len() == STAGES {
                    self.stages.remove(0);
                }
                let (name, says) = (standing.stage.clone(), standing.says.clone());
                self.stages.push(StageView { name, says, from_s: at_s, runs: standing.runs });
            }
        }
        self.standing = standing;
    }

    /// Puts it into a view, with a look at the fleet.
    pub fn show(&self, view: &mut View, fleet: Option<(Reading, Load)>) {
        view.state = self.state;
        view.ended.clone_from(&self.ended);
        view.standing = self.standing.clone();
        view.stages.clone_from(&self.stages);
        view.events = self.events.iter().cloned().collect();
        let Some((Reading { tally, census, .. }, load)) = fleet else {
            view.fleet = None;
            return;
        };
        view.failures = tally.failures.iter().map(|(kind, n)| ((*kind).to_owned(), *n)).collect();
        view.fleet = Some(FleetView {
            workers: census.workers,
            aside: census.aside,
            slots: census.slots,
            busy: census.busy,
            queued: census.queued,
            ahead: census.ahead,
            open: census.open,
            predictions: tally.predictions,
            losses: self.losses,
        });
        view.standing.workers = census.workers;
        let here = load.workers.into_iter().map(|worker| {
            let aside = self.aside.iter().find(|(name, _)| *name == worker.name);
            let state = match aside {
                Some(_) => "set aside",
                None if worker.jobs > 0 => "working",
                None => "idle",
            };
            WorkerView {
                slots: worker.slots,
                jobs: worker.jobs,
                state: state.to_owned(),
                why: aside.map(|(_, why)| why.clone()).unwrap_or_default(),
                name: worker.name,
                at_s: None,
            }
        });
        view.workers = self.lost.iter().cloned().chain(here).collect();
        view.workers_left_out = view.workers.len().saturating_sub(WORKERS);
        view.workers.truncate(WORKERS);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use starlings_fleet::WorkerLoad;

    fn left(worker: String, reason: &str) -> FleetEvent {
        FleetEvent::WorkerLeft { worker, reason: reason.to_owned(), requeued: 1 }
    }

    #[test]
    fn a_thousand_losses_are_counted_and_the_last_ones_are_shown() {
        let mut told = Told::default();
        for n in 0..1000 {
            told.event(f64::from(n), &left(format!("{n}@host/1"), "its connection closed"));
        }
        let load = Load {
            unfinished: 0,
            workers: vec![WorkerLoad { name: "1000@host/1".to_owned(), slots: 2, jobs: 1 }],
        };
        let mut view = View::default();
        told.show(&mut view, Some((Reading::default(), load)));
        assert_eq!(view.fleet.map(|fleet| fleet.losses), Some(1000));
        assert_eq!(view.workers.len(), LOST + 1);
        assert_eq!((view.workers[0].name.as_str(), view.workers[0].state.as_str()), ("999@host/1", "lost"));
        assert_eq!(view.workers[LOST].state, "working");
        assert_eq!(view.events.len(), EVENTS);
    }

    #[test]
    fn a_stage_that_goes_on_is_one_and_its_words_are_the_last() {
        let mut told = Told::default();
        let standing = |stage: &str, says: &str, runs| Standing {
            stage: stage.to_owned(),
            says: says.to_owned(),
            runs,
            ..Standing::default()
        };
        told.stage(1.0, standing("fit", "iteration 1", 3));
        told.stage(2.0, standing("fit", "iteration 2", 6));
        told.stage(3.0, standing("screen", "", 9));
        let mut view = View::default();
        told.show(&mut view, None);
        let stages: Vec<_> = view.stages.iter().map(|s| (s.name.as_str(), s.says.as_str(), s.runs)).collect();
        assert_eq!(stages, [("fit", "iteration 2", 3), ("screen", "", 9)]);
    }
}
