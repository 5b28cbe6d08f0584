//! Small studies on disk, fleets that misbehave on purpose, and the closed form that a linear problem is compared with.
#![allow(dead_code, missing_docs, unreachable_pub, clippy::unwrap_used)]

pub mod fleets;
pub mod linear;
pub mod rcr;
pub mod tube;

use std::cell::Cell;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_coordinator::fleet::{Fleet, InProcess};
use starlings_coordinator::study::posterior::Estimate;
use starlings_coordinator::study::store::Purpose;
use starlings_coordinator::study::store::folder::Call;
use starlings_coordinator::study::{RunContext, RunError, RunFolder, Study, Summary, run::run};

/// A study and its recordings in a folder of their own.
pub struct Case {
    folder: tempfile::TempDir,
    runs: Cell<usize>,
}

/// A finished run.
pub struct Done {
    pub summary: Summary,
    /// The posterior as it is exported.
    pub csv: String,
    pub folder: RunFolder,
}

impl Case {
    /// Writes the study and its files.
    pub fn new(study: &str, files: &[(&str, String)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("study.toml"), study).unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        Self { folder, runs: Cell::new(0) }
    }

    pub fn study(&self) -> Study {
        Study::load(&self.folder.path().join("study.toml")).unwrap_or_else(|error| panic!("{error}"))
    }

    /// What is wrong with the study, if anything.
    pub fn refusal(&self) -> Option<String> {
        Study::load(&self.folder.path().join("study.toml")).err().map(|error| error.to_string())
    }

    /// A run folder that no run has used.
    pub fn fresh(&self) -> PathBuf {
        self.runs.set(self.runs.get() + 1);
        self.folder.path().join(format!("run-{}", self.runs.get()))
    }

    /// Starts a run, or continues one, and keeps whatever came of it.
    pub fn go(&self, path: &Path, fleet: &mut dyn Fleet) -> Result<Done, RunError> {
        let study = self.study();
        let mut folder = if path.exists() {
            RunFolder::resume(Purpose::Run, path, &study, &Call::default()).unwrap()
        } else {
            RunFolder::create(Purpose::Run, path, &study, "test", "today").unwrap()
        };
        let mut context =
            RunContext { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0, threads: 2 };
        let summary = run(&study, fleet, &mut folder, &mut context)?;
        let csv = folder.store.meta("posterior").unwrap().unwrap();
        Ok(Done { summary, csv, folder })
    }

    pub fn run_on(&self, fleet: &mut dyn Fleet) -> Result<Done, RunError> {
        self.go(&self.fresh(), fleet)
    }

    /// A run that must succeed, on two threads.
    pub fn run(&self) -> Done {
        self.run_on(&mut InProcess::new(2)).unwrap_or_else(|error| panic!("{error}\n{}", self.study().text))
    }
}

/// One run of a study in a folder of its own.
pub fn run_once(study: &str, files: &[(&str, String)]) -> Done {
    Case::new(study, files).run()
}

impl Done {
    pub fn estimate(&self, name: &str) -> &Estimate {
        self.summary.parameters.iter().find(|p| p.name == name).unwrap()
    }

    pub fn warns(&self, text: &str) -> bool {
        self.summary.warnings.iter().any(|w| w.contains(text))
    }

    /// Rows of a table, every cell as text.
    pub fn table(&self, name: &str, columns: &str) -> Vec<Vec<String>> {
        starlings_coordinator::study::store::table(&self.folder.store, name, columns).unwrap()
    }

    /// (time, value) of the free run's predictions of a record.
    pub fn predicted(&self, record: &str) -> Vec<(f64, f64)> {
        let rows = self.table("predictions", "record, time, predicted");
        let of_record = rows.into_iter().filter(|row| row[0] == record);
        of_record.map(|row| (row[1].parse().unwrap(), row[2].parse().unwrap())).collect()
    }
}

/// A recording of columns; NaN is an empty cell.
pub fn csv(names: &str, columns: &[&[f64]]) -> String {
    let mut text = format!("{names}\n");
    for row in 0..columns[0].len() {
        let cell = |v: f64| if v.is_nan() { String::new() } else { format!("{v:?}") };
        let cells: Vec<String> = columns.iter().map(|c| cell(c[row])).collect();
        writeln!(text, "{}", cells.join(",")).unwrap();
    }
    text
}

/// Standard normal numbers.
pub fn normals(n: usize, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| StandardNormal.sample(&mut rng)).collect()
}

/// n times from 0 on, a step apart.
pub fn grid(n: usize, step: f64) -> Vec<f64> {
    (0..n).map(|i| step * i as f64).collect()
}

/// |a − b| relative to the larger of |b| and a scale.
pub fn off(a: f64, b: f64, scale: f64) -> f64 {
    (a - b).abs() / b.abs().max(scale)
}
