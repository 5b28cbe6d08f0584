//! What campaigns run: models of this program with small and large states, a program in C, the Python package.
//!
//! Next file to read: [`super::campaign`].

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;
use std::sync::{Mutex, OnceLock};

pub(crate) use crate::common::python::has_python;
use crate::common::python::path;
use crate::common::studies::{long_tube, slow};
use crate::common::{output, starlings};
use crate::fault_kit::plan::{Reached, Verb};
use crate::fault_kit::study_folder::StudyFolder;

/// A sort of study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Sort {
    /// Equations.
    Native,
    /// A built-in model with states of 320 kB.
    Large,
    /// The same with memory for three of them at the coordinator.
    Spilled,
    /// A program in C, started for every run.
    Command,
    /// The Python package.
    Python,
}

/// All of them.
pub(crate) const SORTS: [Sort; 5] = [Sort::Native, Sort::Command, Sort::Spilled, Sort::Python, Sort::Large];

/// An undisturbed study.
#[derive(Clone, Debug)]
pub(crate) struct Clean {
    pub(crate) posterior: Vec<u8>,
    pub(crate) n_run: i64,
}

impl Sort {
    /// Whether the model is a program of its own.
    pub(crate) fn is_solver(self) -> bool {
        matches!(self, Self::Command | Self::Python)
    }

    pub(crate) fn says(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Large => "native, large states",
            Self::Spilled => "native, large states on disk",
            Self::Command => "command",
            Self::Python => "Python",
        }
    }

    /// More options of the coordinator.
    pub(crate) fn options(self) -> &'static [&'static str] {
        if self == Self::Spilled { &["--state-memory", "1 MB"] } else { &[] }
    }

    /// The study in a folder of its own.
    pub(crate) fn place(self) -> StudyFolder {
        let reached = if self == Self::Python { Reached::Grpc } else { Reached::Command };
        let settings = if self == Self::Python { "described = \"solver.json\"" } else { "" };
        let place = StudyFolder::new(Verb::Run, reached, &format!("{settings}\ntimeout = 8.0"));
        let folder = place.study().parent().unwrap().to_owned();
        let fleet = "max_attempts = 1000\npatience = 90.0\n";
        let file = match self {
            Self::Native => slow(&folder, 12),
            Self::Large | Self::Spilled => long_tube(&folder, 300),
            Self::Command | Self::Python => {
                let text = std::fs::read_to_string(place.study()).unwrap();
                let text = repeated(&text, 16).replace("patience = 20.0\n", fleet);
                std::fs::write(place.study(), text).unwrap();
                if self == Self::Python {
                    std::fs::write(place.path("solver.json"), described()).unwrap();
                }
                return place;
            }
        };
        let text = std::fs::read_to_string(&file).unwrap();
        std::fs::write(file, format!("{text}\n[fleet]\n{fleet}")).unwrap();
        place
    }

    /// What every process of it finds around it.
    pub(crate) fn furnish(self, place: &StudyFolder, command: &mut Command) {
        place.furnish(command);
        if self.is_solver() {
            command.env("FAULT_PAUSE", "60").env("PATH", path());
        }
    }

    /// The undisturbed study, run once.
    pub(crate) fn clean(self) -> Clean {
        type CleanRuns = BTreeMap<Sort, &'static OnceLock<Clean>>;
        static KNOWN: Mutex<CleanRuns> = Mutex::new(BTreeMap::new());
        let known = *KNOWN.lock().unwrap().entry(self).or_insert_with(|| Box::leak(Box::default()));
        known.get_or_init(|| self.undisturbed()).clone()
    }

    fn undisturbed(self) -> Clean {
        let place = self.place();
        let mut command = place.command(&["--workers", "2"]);
        self.furnish(&place, &mut command);
        let ended = place.to_the_end(&mut command).unwrap();
        assert_eq!(ended.code, Some(0), "undisturbed: {}", ended.stderr);
        let n_run = super::judge::count(&place.out(), "SELECT count(*) FROM jobs").unwrap();
        Clean { posterior: place.result().unwrap(), n_run }
    }
}

/// The study with its record so many times.
fn repeated(text: &str, n: usize) -> String {
    let (from, to) = (text.find("[[records]]").unwrap(), text.find("[[effects]]").unwrap());
    let record = |i| text[from..to].replace("name = \"decay\"", &format!("name = \"decay{i}\""));
    let records: String = (0..n).map(record).collect();
    format!("{}{records}{}", &text[..from], &text[to..])
}

/// What the solver in Python says of itself.
fn described() -> String {
    static TEXT: OnceLock<String> = OnceLock::new();
    let ask = || {
        let place = StudyFolder::new(Verb::Run, Reached::Grpc, "");
        let mut command = starlings();
        command.args(["worker", "--describe", "--solver", "python3 solver.py"]);
        place.furnish(command.env("PATH", path()).current_dir(place.study().parent().unwrap()));
        let (code, text, said) = output(&mut command);
        assert_eq!(code, 0, "{said}");
        text
    };
    TEXT.get_or_init(ask).clone()
}

/// The folder that workers of a study may use for their solvers.
pub(crate) fn permitted(sort: Sort, place: &StudyFolder) -> Option<PathBuf> {
    sort.is_solver().then(|| place.study())
}
