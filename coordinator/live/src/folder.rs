//! A run seen from its folder alone: whether it runs, is done or was ended, and what its store says.
//!
//! Next file to read: [`super::course`].

use std::path::{Path, PathBuf};

use serde::Deserialize;
use starlings_study::store::StoreError;
use starlings_study::store::folder::FolderError;
use starlings_study::{RunFolder, Work, progress};

use super::course::Course;
use super::pace::{Pace, Reach};
use super::view::{Counted, EventView, Head, Standing, State, View};

/// Events that are shown.
const EVENTS: usize = 12;

/// A run folder that is looked at again and again.
pub struct Watched {
    folder: RunFolder,
    course: Course,
    pace: Pace,
}

/// What the store keeps of how far a run is, or an explanation.
#[derive(Deserialize)]
#[serde(untagged)]
enum Noted {
    Run(Analysed),
    Explanation(Staged),
}

#[derive(Deserialize)]
struct Staged {
    name: String,
    says: String,
    runs: u64,
    workers: usize,
    work: Work,
}

#[derive(Deserialize)]
struct Analysed {
    stage: String,
    pass: usize,
    passes: Option<usize>,
    step: usize,
    steps: usize,
    runs: u64,
    workers: usize,
    work: Work,
}

impl Watched {
    /// Opens a run folder to look at it.
    ///
    /// # Errors
    /// When there is no run in it.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        Ok(Self { folder: RunFolder::open(path)?, course: Course::default(), pace: Pace::default() })
    }

    /// The folder.
    pub fn path(&self) -> PathBuf {
        self.folder.path.clone()
    }

    /// What is known now.
    ///
    /// # Errors
    /// When the store fails or its content is damaged.
    pub fn look(&mut self) -> Result<View, StoreError> {
        // Before the store: a run that ends meanwhile is done, and not one that nobody runs.
        let holder = self.folder.holder();
        let (command, info) = self.folder.about()?;
        let state = match (self.folder.is_done()?, &holder) {
            (true, _) => State::Finished,
            (false, Some(_)) => State::Running,
            (false, None) => State::Ended,
        };
        let store = &self.folder.store;
        self.course.read_all(store)?;
        let mut view = View {
            head: Head {
                study: info.name,
                command: command.trim_start_matches("starlings ").to_owned(),
                model: info.model,
                version: info.version,
                units: Vec::new(),
            },
            state,
            elapsed_s: store.elapsed_s()?,
            ..View::default()
        };
        self.course.show(&mut view);
        let noted = store.meta(progress::PROGRESS)?.map(|text| serde_json::from_str::<Noted>(&text));
        if let Some(noted) = noted.transpose().map_err(|error| store.damaged("progress", error))? {
            view.standing = self.standing(noted, view.elapsed_s, state);
        }
        let select = format!("SELECT at_s, kind, text FROM events ORDER BY id DESC LIMIT {EVENTS}");
        let store = &self.folder.store;
        view.events = store
            .rows(&select, |row| Ok(EventView { at_s: row.get(0)?, kind: row.get(1)?, text: row.get(2)? }))?;
        view.ended = match state {
            State::Ended => {
                let path = self.folder.path.display();
                format!("nobody runs it: it was killed or broke off; --out {path} --resume goes on")
            }
            State::Running => holder.unwrap_or_default(),
            State::Finished => String::new(),
        };
        Ok(view)
    }

    fn standing(&mut self, noted: Noted, elapsed_s: f64, state: State) -> Standing {
        let Staged { name: stage, says, runs, workers, work } = noted.in_words();
        let is_running = state == State::Running;
        let Reach { share, left_s } = self.pace.at(elapsed_s, &work);
        let share = share.map(|share| if state == State::Finished { 1.0 } else { share });
        Standing {
            stage,
            says,
            share,
            left_s: left_s.filter(|_| is_running),
            runs,
            counted: Counted::Runs,
            workers: if is_running { workers } else { 0 },
        }
    }
}

impl Noted {
    fn in_words(self) -> Staged {
        let of = match self {
            Self::Explanation(staged) => return staged,
            Self::Run(analysed) => analysed,
        };
        let name = progress::title(&of.stage, of.pass, of.passes);
        let says = progress::says(&of.stage, of.step, of.steps);
        Staged { name, says, runs: of.runs, workers: of.workers, work: of.work }
    }
}
