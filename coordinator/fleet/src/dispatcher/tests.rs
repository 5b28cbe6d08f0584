//! Events in, commands compared.

mod aside;
mod belief;
mod canary;
mod chaos;
mod doubt;
mod duplicate;
mod held;
mod leases;
mod losses;
mod mixed;
pub(super) mod plain;
mod recall;
mod repeats;
mod waiting;

use std::time::Duration;

use starlings_models::{ModelFailure, ParticleError};
use starlings_proto::{Lease, LeaseOutcome, SetupId};

use super::{BatchError, Command, ControlId, Dispatcher, Event, Joining, Rules, Worker, WorkerId};
use crate::FleetEvent;
use crate::job_name::JobName;
use crate::wire::{Outcome, Prediction};

const SETUP: SetupId = [7; 32];

impl Dispatcher {
    /// Number of leases that a worker holds.
    fn in_flight(&self, worker: WorkerId) -> usize {
        self.workers.get(worker).map_or(0, Worker::load)
    }
}

const RULES: Rules = Rules {
    heartbeat: Duration::from_secs(8),
    patience: Duration::from_secs(60),
    max_attempts: 3,
    comparing: None,
    timeout_factor: None,
};

fn joining(id: u64, slots: u32) -> Joining {
    Joining {
        id: WorkerId(id),
        name: format!("w{id}"),
        host: "here".to_owned(),
        pid: id as u32,
        slots,
        cores: slots,
        nonce: id,
        build: None,
    }
}

fn names(n: u32) -> Vec<JobName> {
    (0..n).map(|particle| JobName { particle, record: 0, span: [0, 1] }).collect()
}

fn submit(n: u32) -> Event {
    Event::Submit { jobs: names(n).into_iter().map(|name| (SETUP, name)).collect() }
}

/// Another setup than [`SETUP`].
fn setup(i: u8) -> SetupId {
    [i; 32]
}

/// Jobs with these setups.
fn submit_mixed(setups: &[u8]) -> Event {
    let jobs = names(setups.len() as u32).into_iter().zip(setups).map(|(name, &i)| (setup(i), name));
    Event::Submit { jobs: jobs.collect() }
}

fn prediction(index: usize) -> Prediction {
    Prediction { outputs: vec![index as f64], state: vec![].into(), cost: 0.0 }
}

fn answered(lease: Lease, answer: LeaseOutcome, cost: f64) -> Event {
    Event::Answered { worker: WorkerId(lease.epoch), lease, answer, cost }
}

fn left(id: u64, clean: bool) -> Event {
    Event::Left { worker: WorkerId(id), reason: "gone".to_owned(), clean }
}

/// A dispatcher with its clock.
struct Stage {
    dispatcher: Dispatcher,
    now: Duration,
}

impl Stage {
    /// Workers 1.. with these slots, the setup built, nothing submitted.
    fn with(slots: &[u32]) -> Self {
        let mut stage = Self { dispatcher: Dispatcher::new(RULES), now: Duration::ZERO };
        for (i, &slots) in slots.iter().enumerate() {
            let worker = i as u64 + 1;
            stage.step(Event::Joined(joining(worker, slots)));
            stage.step(Event::SetupDone { worker: WorkerId(worker), setup: SETUP });
        }
        stage
    }

    fn step(&mut self, event: Event) -> Vec<Command> {
        self.dispatcher.step(self.now, event)
    }

    fn jobs(&mut self, event: Event) -> Vec<(Lease, usize)> {
        sent(&self.step(event))
    }

    /// Ticks once a second, as heartbeats arrive from `alive`.
    fn seconds(&mut self, n: u64, alive: &[u64]) -> Vec<Command> {
        let mut commands = vec![];
        for _ in 0..n {
            self.now += Duration::from_secs(1);
            for &id in alive {
                commands.extend(self.step(Event::Heard { worker: WorkerId(id) }));
            }
            commands.extend(self.step(Event::Tick));
        }
        commands
    }
}

fn sent(commands: &[Command]) -> Vec<(Lease, usize)> {
    let jobs = commands.iter().filter_map(|command| match command {
        Command::SendJob { lease, index, .. } => Some((*lease, *index)),
        _ => None,
    });
    jobs.collect()
}

fn outcomes(commands: &[Command]) -> Option<&[Outcome]> {
    commands.iter().find_map(|command| match command {
        Command::BatchDone(outcomes) => Some(outcomes.as_slice()),
        _ => None,
    })
}

/// A failure of the model, as a worker tells it.
fn solver(text: &str) -> ParticleError {
    failed(text).into()
}

/// A failure of the model.
fn failed(text: &str) -> ModelFailure {
    ModelFailure::Solver(text.to_owned())
}

/// An abnormal end.
fn crash(text: &str) -> ParticleError {
    ParticleError::Undecided(text.to_owned())
}

/// A failure of the place.
fn place(text: &str) -> ParticleError {
    ParticleError::Infrastructure(text.to_owned())
}

fn ran(lease: Lease, result: Result<Prediction, ParticleError>) -> Event {
    answered(lease, LeaseOutcome::Ran(result), 1.0)
}

/// The control runs among commands.
fn controls(commands: &[Command]) -> Vec<(Lease, ControlId)> {
    let sent = commands.iter().filter_map(|command| match command {
        Command::SendControl { lease, control, .. } => Some((*lease, *control)),
        _ => None,
    });
    sent.collect()
}
