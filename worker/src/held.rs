//! Results that the coordinator may not have: those of runs that ended while nobody was connected, and those sent last.
//!
//! A coordinator that is killed loses what it had not written yet, and a connection that breaks what was on its way; both come back
//! from here by the keys of their jobs. In memory up to a limit, then in a file without a name in the scratch folder; when that is full
//! too, no further run is started. Results with large states are told of as runs that go on, and put when there is a lease for them
//! ([`large`]). Next file to read: [`crate::slots`].

mod kept;
pub(crate) mod large;
mod portions;

use std::collections::{HashMap, VecDeque};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use kept::Kept;
pub(crate) use kept::{Ended, Of};
use portions::Portions;
use starlings_proto::{HeldRun, JobKey, JobKeys};

/// How long a result that was sent may still be on its way, or in the coordinator and not written: above the silence at which either
/// side takes the other for gone.
const RECENT: Duration = Duration::from_secs(30);

/// What may be held, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HoldLimits {
    /// In memory.
    pub memory: usize,
    /// In a file, beyond that.
    pub disk: u64,
}

impl Default for HoldLimits {
    fn default() -> Self {
        Self { memory: 64 << 20, disk: 1 << 30 }
    }
}

/// A run and its start, as the coordinator told it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) id: [u8; 16],
    pub(crate) incarnation: u64,
}

/// Shared by the threads that compute and the one of the network.
pub(crate) struct Held {
    limits: HoldLimits,
    scratch: PathBuf,
    shared: Mutex<Shared>,
}

#[derive(Default)]
struct Shared {
    run: Option<Run>,
    /// Whether a coordinator of this run is connected.
    is_connected: bool,
    /// Oldest first.
    runs: VecDeque<Kept>,
    bytes: usize,
    file: Option<File>,
    on_disk: u64,
    n_on_disk: usize,
    /// Those whose states are in files of their own.
    spilled: Vec<Kept>,
}

impl Held {
    pub(crate) fn new(limits: HoldLimits, scratch: &Path) -> Self {
        Self { limits, scratch: scratch.to_owned(), shared: Mutex::default() }
    }

    /// The run that was connected last.
    pub(crate) fn run(&self) -> Option<Run> {
        self.lock().run
    }

    /// Notes a coordinator; says whether it is of the run that was connected before. What is held for another run is dropped.
    pub(crate) fn connected(&self, run: Run) -> bool {
        let mut shared = self.lock();
        let same = shared.run.is_some_and(|before| before.id == run.id);
        if !same {
            *shared = Shared::default();
        }
        (shared.run, shared.is_connected) = (Some(run), true);
        same
    }

    pub(crate) fn disconnected(&self) {
        self.lock().is_connected = false;
    }

    /// Keeps how a run ended. False when nothing more can be held.
    pub(crate) fn keep(&self, of: Of, ended: Ended) -> bool {
        let kept = Kept { at: Instant::now(), of, ended };
        let mut shared = self.lock();
        shared.bytes += kept.bytes();
        shared.runs.push_back(kept);
        if shared.is_connected {
            let recent = |kept: &Kept| kept.at.elapsed() < RECENT;
            while shared.bytes > self.limits.memory || shared.runs.front().is_some_and(|kept| !recent(kept)) {
                let Some(oldest) = shared.runs.pop_front() else { break };
                shared.bytes -= oldest.bytes();
            }
            return true;
        }
        while shared.bytes > self.limits.memory {
            if shared.on_disk() >= self.limits.disk || shared.spill(&self.scratch).is_err() {
                return false;
            }
        }
        true
    }

    /// All that is held, for a coordinator of the same run, in portions of about so many bytes; it is held for a while longer, as
    /// what is sent always is.
    pub(crate) fn portions(&self, bytes: usize) -> Vec<Vec<HeldRun>> {
        let mut shared = self.lock();
        let mut portions = Portions::of(bytes);
        if let Err(error) = shared.unspill(|run| portions.add(run)) {
            tracing::warn!(
                "results that were held on disk cannot be read, their runs are made again: {error}"
            );
        }
        let (now, mut keys) = (Instant::now(), JobKeys::default());
        let spilled = std::mem::take(&mut shared.spilled);
        shared.bytes += spilled.iter().map(Kept::bytes).sum::<usize>();
        shared.runs.extend(spilled);
        for kept in &mut shared.runs {
            kept.at = now;
            if let Ended::Inside(bytes) = &kept.ended {
                portions.add(HeldRun { key: kept.of.key(&mut keys), ended: Some(bytes.clone()) });
            }
        }
        portions.all()
    }

    /// The keys of all that is held with large states.
    pub(crate) fn large(&self) -> Vec<JobKey> {
        let (mut keys, shared) = (JobKeys::default(), self.lock());
        let large = shared.runs.iter().chain(&shared.spilled).filter(|kept| kept.large().is_some());
        large.map(|kept| kept.of.key(&mut keys)).collect()
    }

    /// How runs ended, by the keys of their jobs, as far as they are held in memory.
    pub(crate) fn ended(&self, wanted: &[JobKey]) -> HashMap<JobKey, Ended> {
        if wanted.is_empty() {
            return HashMap::new();
        }
        let (mut keys, shared) = (JobKeys::default(), self.lock());
        let all = shared.runs.iter().map(|kept| (kept.of.key(&mut keys), kept.ended.clone()));
        all.filter(|(key, _)| wanted.contains(key)).collect()
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Shared {
    /// Bytes in files.
    fn on_disk(&self) -> u64 {
        let large = self.runs.iter().chain(&self.spilled).filter_map(Kept::large);
        self.on_disk + large.map(|large| large.bytes().1).sum::<u64>()
    }

    /// Moves the oldest run to a file.
    fn spill(&mut self, scratch: &Path) -> io::Result<()> {
        let Some(oldest) = self.runs.front() else { return Ok(()) };
        let ended = match &oldest.ended {
            Ended::Inside(bytes) => bytes.clone(),
            Ended::Large(large) => {
                let bytes = oldest.bytes();
                large.spill(scratch)?;
                self.bytes -= bytes;
                self.spilled.extend(self.runs.pop_front());
                return Ok(());
            }
        };
        let file = match &mut self.file {
            Some(file) => file,
            none => none.insert(tempfile::tempfile_in(scratch)?),
        };
        let key = oldest.of.key(&mut JobKeys::default());
        file.write_all(&[&key[..], &(ended.len() as u64).to_le_bytes(), &ended].concat())?;
        self.on_disk += (key.len() + 8 + ended.len()) as u64;
        self.n_on_disk += 1;
        self.bytes -= oldest.bytes();
        self.runs.pop_front();
        Ok(())
    }

    /// Reads the file, and is rid of it.
    fn unspill(&mut self, mut take: impl FnMut(HeldRun)) -> io::Result<()> {
        let n = std::mem::take(&mut self.n_on_disk);
        self.on_disk = 0;
        let Some(mut file) = self.file.take() else { return Ok(()) };
        file.rewind()?;
        let mut file = BufReader::new(file);
        for _ in 0..n {
            let (mut key, mut length) = ([0; 32], [0; 8]);
            file.read_exact(&mut key)?;
            file.read_exact(&mut length)?;
            let mut ended = Vec::new();
            file.by_ref().take(u64::from_le_bytes(length)).read_to_end(&mut ended)?;
            take(HeldRun { key, ended: Some(ended.into()) });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use starlings_models::{Job, Prediction, Window};
    use starlings_proto::convert::ended;
    use starlings_proto::{State, job_key};

    use super::large::Large;
    use super::*;

    const RUN: Run = Run { id: [1; 16], incarnation: 1 };

    fn job(particle: u32) -> Arc<Job> {
        let window = Window { start: 0.0, times: vec![1.0], observed: vec![0.0], inputs: vec![] };
        Arc::new(Job { particle, record: 0, window: window.into(), theta: vec![0.5], state: None })
    }

    fn keep(held: &Held, particle: u32) -> bool {
        let outputs = vec![f64::from(particle); 100];
        let prediction = Prediction { outputs, state: State::default(), cost: 0.5 };
        held.keep(Of::Job([7; 32], job(particle)), Ended::inside(&Ok(prediction), 0.5))
    }

    fn particles(held: &Held) -> Vec<f64> {
        let runs = held.portions(2000).into_iter().inspect(|portion| assert!(portion.len() <= 2)).flatten();
        runs.map(|run| ended::decode(&run.ended.unwrap()).unwrap().0.unwrap().outputs[0]).collect()
    }

    #[test]
    fn what_does_not_fit_into_memory_waits_on_disk_and_comes_back_whole() {
        let folder = std::env::temp_dir();
        let held = Held::new(HoldLimits { memory: 5000, disk: 10_000 }, &folder);
        assert!(!held.connected(RUN), "the first one has no earlier one");
        held.disconnected();
        let most = (0..1000).take_while(|particle| keep(&held, *particle)).count();
        assert!((10..20).contains(&most), "{most}");
        assert!(held.connected(Run { incarnation: 2, ..RUN }));
        // The one that did not fit is in memory all the same: it was computed.
        let all: Vec<f64> = (0..=most).map(|i| i as f64).collect();
        assert_eq!(particles(&held), all);
        assert_eq!(held.ended(&[job_key(&[7; 32], &job(most as u32))]).len(), 1);
    }

    #[test]
    fn while_connected_the_last_ones_are_kept_and_another_run_gets_none() {
        let held = Held::new(HoldLimits { memory: 3000, disk: 0 }, &std::env::temp_dir());
        held.connected(RUN);
        assert!((0..50).all(|particle| keep(&held, particle)), "what was sent makes room");
        let last = particles(&held);
        assert_eq!(last.last(), Some(&49.0));
        assert!((1..4).contains(&last.len()), "{last:?}");
        assert!(!held.connected(Run { id: [2; 16], incarnation: 1 }));
        assert_eq!(held.portions(1000).len(), 0);
    }

    #[test]
    fn large_states_wait_in_files_of_their_own_and_count() {
        let held = Held::new(HoldLimits { memory: 9000, disk: 40_000 }, &std::env::temp_dir());
        let keep = |n: u8| {
            let prediction = Prediction { outputs: vec![1.0], state: vec![f64::from(n); 1000], cost: 0.5 };
            held.keep(Of::Key([n; 32]), Ended::Large(Arc::new(Large::new(prediction))))
        };
        held.connected(RUN);
        assert!((0..5).all(keep), "what was sent makes room");
        assert_eq!(held.large(), [[4; 32]]);
        held.disconnected();
        let most = (10..30).take_while(|n| keep(*n)).count();
        assert!((4..8).contains(&most), "{most}");
        held.connected(Run { incarnation: 2, ..RUN });
        assert_eq!(held.portions(1000).len(), 0, "none fits into a message");
        let mut all = held.large();
        all.sort_unstable();
        let last = 10 + most as u8;
        assert_eq!(all, std::iter::once(4).chain(10..=last).map(|n| [n; 32]).collect::<Vec<_>>());
        assert!(matches!(held.ended(&[[10; 32]]).get(&[10; 32]), Some(Ended::Large(_))));
    }
}
