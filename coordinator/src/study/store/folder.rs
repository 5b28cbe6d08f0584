//! The run folder: a frozen study, the store, and the files made from it.
//!
//! Result files are written beside their place and renamed into it, so a reader never sees half of one. Next file to read:
//! [`crate::study::store`].

use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use starlings_models::Role;

use crate::study::expand::INITIAL;
use crate::study::field::quantity_of;
use crate::study::store::{Purpose, Store, StoreError};
use crate::study::summary::Summary;
use crate::study::{Fit, Study, ThetaEntry, posterior};

pub use crate::study::store::folder_error::FolderError;

/// What the store keeps of the study so that a report needs nothing else.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StudyInfo {
    /// Study name.
    pub name: String,
    /// What the study says of itself.
    pub says: Option<String>,
    /// Model kind.
    pub model: String,
    /// Estimator in one line.
    pub estimator: String,
    /// `filter` or `batch`: what the steps of the store mean.
    pub batch: bool,
    /// Seed.
    pub seed: u64,
    /// Time unit.
    pub time_unit: String,
    /// Output names and units.
    pub outputs: Vec<(String, String)>,
    /// Names of parameters that are estimated through a logarithm.
    pub logarithmic: Vec<String>,
    /// Names of parameters that are a stiffness.
    #[serde(default)]
    pub stiffness: Vec<String>,
    /// Names of the model's states.
    #[serde(default)]
    pub states: Vec<String>,
    /// Record names and training spans; `None` for a record that is held out as a whole.
    pub records: Vec<(String, Option<[f64; 2]>)>,
    /// The command line of the run.
    pub command: String,
    /// When the run started, as text.
    pub started: String,
    /// Version of the program.
    pub version: String,
}

/// An open run folder.
pub struct RunFolder {
    /// The folder.
    pub path: PathBuf,
    /// Its database.
    pub store: Store,
    /// Held for as long as this process runs in the folder.
    _lock: Option<File>,
}

/// Name under which the store keeps the course of the innovations with and without the observer.
pub(crate) const OBSERVER: &str = "observer";

impl RunFolder {
    /// Makes the folder of a new run and freezes the study into it.
    ///
    /// # Errors
    /// When the folder holds a run or one of its files already, or cannot be written; nothing is left then.
    pub fn create(
        purpose: Purpose,
        path: &Path,
        study: &Study,
        command: &str,
        started: &str,
    ) -> Result<Self, FolderError> {
        let database = path.join("run.db");
        if database.exists() {
            return Err(FolderError::Occupied(path.to_owned()));
        }
        let mut files = purpose.files().iter().map(|name| path.join(name));
        if let Some(taken) = files.find(|file| file.exists()) {
            return Err(FolderError::InTheWay(taken));
        }
        let unwritable = |path: &Path| {
            let path = path.to_owned();
            move |source| FolderError::Unwritable { path, source }
        };
        std::fs::create_dir_all(path).map_err(unwritable(path))?;
        let frozen = path.join("study.toml");
        write(&frozen, &study.text).map_err(unwritable(&frozen))?;
        let lock = lock(path)?;
        let (recordings, info) = (fingerprint(study), json(&info(study, command, started)));
        let solver = solver_fingerprint(study);
        let meta = [
            ("study", &*study.text),
            ("recordings", &recordings),
            ("solver", &solver),
            ("info", &info),
            (Purpose::KEY, purpose.name()),
        ];
        let store = Store::create(&database, &meta).inspect_err(|_| {
            // Already failing: a frozen study that cannot be removed either stays.
            let _ = std::fs::remove_file(&frozen);
        })?;
        Ok(Self { path: path.to_owned(), store, _lock: Some(lock) })
    }

    /// Opens the folder of a run that was interrupted.
    ///
    /// # Errors
    /// When there is no run, another process runs in it, it serves another purpose, or it was started from another study or
    /// other recordings.
    pub fn resume(purpose: Purpose, path: &Path, study: &Study) -> Result<Self, FolderError> {
        let store = Store::open(&path.join("run.db"))?;
        let lock = lock(path)?;
        let found = Purpose::of(&store)?;
        if found != purpose {
            let (folder, holds, command) = (path.to_owned(), found.with_article(), found.command());
            return Err(FolderError::OtherPurpose { folder, holds, command });
        }
        let other = |what| FolderError::OtherStudy { folder: path.to_owned(), what };
        match store.meta("study")? {
            None => return Err(FolderError::NeverStarted(path.to_owned())),
            Some(text) if *text != *study.text => return Err(other("the study file")),
            Some(_) => {}
        }
        if store.meta("recordings")? != Some(fingerprint(study)) {
            return Err(other("the recordings"));
        }
        if store.meta("solver")?.unwrap_or_default() != solver_fingerprint(study) {
            return Err(other("the solver or one of its files"));
        }
        Ok(Self { path: path.to_owned(), store, _lock: Some(lock) })
    }

    /// Opens the folder of any run for reading.
    ///
    /// # Errors
    /// When there is no run.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        Ok(Self { path: path.to_owned(), store: Store::open_to_read(&path.join("run.db"))?, _lock: None })
    }

    /// What the folder is for.
    ///
    /// # Errors
    /// When the store fails.
    pub fn purpose(&self) -> Result<Purpose, StoreError> {
        Purpose::of(&self.store)
    }

    /// The summary, once the run is finished.
    ///
    /// # Errors
    /// When the store fails or its content is damaged.
    pub fn summary(&self) -> Result<Option<Summary>, StoreError> {
        let text = self.store.meta("summary")?;
        text.map(|t| serde_json::from_str(&t).map_err(|e| self.store.damaged("summary", e))).transpose()
    }

    pub(crate) fn finish(&mut self, study: &Study, fit: &Fit, summary: &Summary) -> Result<(), StoreError> {
        let posterior =
            posterior::to_csv(study, &fit.posterior).map_err(|e| self.store.damaged("posterior", e))?;
        self.store.set_meta("posterior", &posterior)?;
        self.store.set_meta("summary", &json(summary))?;
        // Somebody who reads the database right now keeps its log open; the run is finished all the same.
        let _ = self.store.close_log();
        Ok(())
    }
}

/// Locks the folder through its frozen study until the file is dropped.
fn lock(path: &Path) -> Result<File, FolderError> {
    let frozen = path.join("study.toml");
    let file = File::open(&frozen).map_err(|source| FolderError::Unwritable { path: frozen, source })?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(FolderError::Locked(path.to_owned())),
        // Some network file systems know no locks; a run there is better than none.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
    }
}

/// Writes a file beside its place and renames it into it.
pub(crate) fn write(path: &Path, text: &str) -> io::Result<()> {
    let partial = path.with_extension("partial");
    std::fs::write(&partial, text)?;
    std::fs::rename(&partial, path)
}

pub(crate) fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

/// BLAKE3 of every number of every record: a resumed run must see the same data.
fn fingerprint(study: &Study) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut feed = |values: &[f64]| {
        for v in values {
            hasher.update(&v.to_le_bytes());
        }
    };
    for record in study.records.iter() {
        feed(&record.times);
        for channel in &record.channels {
            feed(&channel.values);
            if let Some(node) = &channel.node {
                feed(&[node.rest, node.normal].concat());
                feed(&node.seen.numbers);
            }
        }
        for input in &record.inputs {
            feed(&input.times);
            feed(&input.values);
        }
    }
    // Initial values may come from a file as well.
    for (name, value) in study.setup.model.constants.range(INITIAL.to_owned()..) {
        if let Some(state) = name.strip_prefix(INITIAL) {
            hasher.update(state.as_bytes());
            hasher.update(&value.to_le_bytes());
        }
    }
    hasher.finalize().to_hex().to_string()
}

/// BLAKE3 of what a solver says of itself and of the files that go to it, templates and copies; empty for other models.
fn solver_fingerprint(study: &Study) -> String {
    let Some(solver) = &study.setup.model.solver else { return String::new() };
    let mut hasher = blake3::Hasher::new();
    hasher.update(json(&solver.described).as_bytes());
    if let Some(files) = &solver.files {
        hasher.update(json(files).as_bytes());
        for path in files.copies.values() {
            // A copy that cannot be read now is told by the run that needs it.
            hasher.update(&std::fs::read(path).unwrap_or_default());
        }
    }
    hasher.finalize().to_hex().to_string()
}

/// Names in the estimated vector of parameters that the model calls a stiffness.
fn stiffness(study: &Study) -> Vec<String> {
    let is_one = |entry: &&ThetaEntry| {
        let name = &study.parameters[entry.parameter].name;
        quantity_of(&study.spec.parameters, name).is_some_and(|q| q.role == Role::Stiffness)
    };
    study.theta.iter().filter(is_one).map(|entry| entry.name.clone()).collect()
}

fn info(study: &Study, command: &str, started: &str) -> StudyInfo {
    use starlings_estimators::Transform;
    let unit = |output: &String| {
        let mut channels = study.records.iter().flat_map(|r| &r.channels).filter(|c| &c.output == output);
        let of_model = || quantity_of(&study.spec.outputs, output).map(|q| q.unit.clone());
        channels.find_map(|c| c.unit.clone()).or_else(of_model).unwrap_or_default()
    };
    StudyInfo {
        name: study.name.clone(),
        says: Some(study.says.clone()).filter(|s| !s.is_empty()),
        model: study.setup.model.kind.clone(),
        estimator: study.describe_estimator(),
        batch: study.estimator.kind == crate::study::EstimatorKind::Batch,
        seed: study.seed,
        time_unit: study.time_unit.clone(),
        outputs: study.setup.outputs.iter().map(|o| (o.clone(), unit(o))).collect(),
        logarithmic: study
            .theta
            .iter()
            .filter(|t| matches!(t.transform, Transform::Log | Transform::Log2))
            .map(|t| t.name.clone())
            .collect(),
        stiffness: stiffness(study),
        states: study.spec.states.iter().map(|q| q.name.clone()).collect(),
        records: study.records.iter().map(|r| (r.name.clone(), r.train_span())).collect(),
        command: command.to_owned(),
        started: started.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}
