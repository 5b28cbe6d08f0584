//! Which programs the numbers of a run come from: this one by version and build, and the solver by its command and files.
//!
//! Two builds may differ in the last digits, or by more where a model was changed between them, so a run that was begun with
//! one is not silently continued with another. Next file to read: [`super::folder`].

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

use serde::{Deserialize, Serialize};
use starlings_models::SolverDef;
use starlings_proto::{VERSION, own_build};

use super::{Store, StoreError};
use crate::Study;

/// This program and the solver of a study, part by part.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Program(BTreeMap<String, String>);

const VERSION_OF: &str = "version";
const BUILD: &str = "build";

/// Digits of a build that are displayed.
const SHOWN: usize = 12;

impl Program {
    /// Name under which the store keeps it.
    pub(super) const KEY: &'static str = "program";

    /// This program, and the solver that a study names.
    pub(super) fn of(study: &Study) -> Self {
        let mut parts = BTreeMap::from([(VERSION_OF.to_owned(), VERSION.to_owned())]);
        if let Some(build) = own_build() {
            let mut digits = String::new();
            for byte in build {
                // Writing to a text cannot fail.
                let _ = write!(digits, "{byte:02x}");
            }
            parts.insert(BUILD.to_owned(), digits);
        }
        if let Some(solver) = study.setup.model.solver.as_deref() {
            parts.extend(solver_parts(solver));
        }
        Self(parts)
    }

    /// Its version; empty where the store does not know.
    pub fn version(&self) -> &str {
        self.0.get(VERSION_OF).map_or("", String::as_str)
    }

    /// Its build, as it is displayed.
    pub fn build(&self) -> &str {
        let build = self.0.get(BUILD).map_or("", String::as_str);
        build.get(..SHOWN).unwrap_or(build)
    }

    /// The part of it in keys of remembered runs.
    pub fn digest(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        for (name, value) in &self.0 {
            // Lengths keep neighbouring texts apart.
            for text in [name, value] {
                hasher.update(&(text.len() as u64).to_le_bytes());
                hasher.update(text.as_bytes());
            }
        }
        *hasher.finalize().as_bytes()
    }

    /// Whether this program itself is another build; a build that is not known differs from none.
    pub(super) fn is_other_build(&self, other: &Self) -> bool {
        self.0.get(BUILD).zip(other.0.get(BUILD)).is_some_and(|(a, b)| a != b)
    }

    /// What differs in the solver, in words.
    pub(super) fn solver_changes(&self, now: &Self) -> Vec<String> {
        let names: BTreeSet<&String> = self.0.keys().chain(now.0.keys()).collect();
        let of_solver = names.into_iter().filter(|name| ![VERSION_OF, BUILD].contains(&name.as_str()));
        of_solver.filter_map(|name| change(name, self.0.get(name), now.0.get(name))).collect()
    }
}

fn change(name: &str, before: Option<&String>, now: Option<&String>) -> Option<String> {
    if before == now {
        return None;
    }
    if let Some(file) = name.strip_prefix(FILE) {
        return Some(format!("its file `{file}` is another"));
    }
    let shown = |value: Option<&String>| value.map_or_else(|| "nothing".to_owned(), |v| format!("`{v}`"));
    Some(format!("its {name} was {} and is {}", shown(before), shown(now)))
}

/// Before the name of a file of the solver's command.
const FILE: &str = "file ";

/// How a solver is started, and a digest of every file that its command names.
fn solver_parts(solver: &SolverDef) -> Vec<(String, String)> {
    let mut parts = vec![
        ("command".to_owned(), solver.command.join(" ")),
        ("threads".to_owned(), solver.threads.to_string()),
        ("ranks".to_owned(), solver.ranks.to_string()),
    ];
    parts.extend(solver.address.iter().map(|address| ("address".to_owned(), address.clone())));
    parts.extend(
        solver.environment.iter().map(|(name, value)| (format!("environment `{name}`"), value.clone())),
    );
    for word in &solver.command {
        let file = Path::new(&solver.folder).join(word);
        // Words that are no files, and programs that the system finds elsewhere, are not read.
        if let Some(bytes) = file.is_file().then(|| std::fs::read(&file).ok()).flatten() {
            parts.push((format!("{FILE}{word}"), blake3::hash(&bytes).to_hex().to_string()));
        }
    }
    parts
}

impl Store {
    /// The programs that the run's numbers come from; empty where the store does not say.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn program(&self) -> Result<Program, StoreError> {
        let text = self.meta(Program::KEY)?;
        Ok(text.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default())
    }
}
