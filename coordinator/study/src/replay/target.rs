//! Which run is meant by a particle, and perhaps a pass and an analysis.
//!
//! Next file to read: [`super::replay`].

use std::collections::BTreeSet;

use super::ReplayError;
use crate::RunFolder;
use crate::store::{Purpose, Store, StoreError};

/// What was asked for. Passes count from 1, particles and analyses from 0, as in the store and in `starlings why`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asked {
    /// Number of the particle.
    pub particle: u32,
    /// Pass; the last one without it.
    pub pass: Option<usize>,
    /// Analysis within the pass, or iteration of a batch fit; the last one whose inputs are stored without it.
    pub analysis: Option<usize>,
}

/// A run that can be made again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// Number of the particle.
    pub particle: u32,
    /// Pass, from 1.
    pub pass: usize,
    /// Analysis within the pass, from 0.
    pub analysis: usize,
    /// The analysis whose inputs are in the store: the same one, or the last one before it.
    pub from: usize,
}

impl Target {
    /// Finds the run in the store of a folder.
    ///
    /// # Errors
    /// When there is no such run, the store keeps no inputs, or it fails.
    pub fn find(folder: &RunFolder, asked: &Asked) -> Result<Self, ReplayError> {
        let name = folder.path.display().to_string();
        if folder.purpose()? == Purpose::Explanation {
            return Err(ReplayError::Explanation(name));
        }
        let store = &folder.store;
        let Some(kept) = store.kept_inputs()? else { return Err(ReplayError::NothingKept(name)) };
        let ran = Ran::read(store, asked.particle)?;
        let Some(last) = ran.last else { return Err(ReplayError::NoAnalysis(name)) };
        if ran.analyses.is_empty() {
            return Err(ReplayError::NoParticle { particle: asked.particle, last });
        }
        let fits = |at: &&(usize, usize)| {
            asked.pass.is_none_or(|pass| pass == at.0) && asked.analysis.is_none_or(|step| step == at.1)
        };
        let found = ran.analyses.iter().rev().find(|at| fits(at)).ok_or_else(|| ran.not_run(asked))?;
        // Unless an analysis is named, one that needs no others is the answer.
        let stored = || kept.iter().rev().find(|at| fits(at) && ran.analyses.contains(at));
        let &(pass, analysis) = if asked.analysis.is_none() { stored().unwrap_or(found) } else { found };
        let before = kept.iter().rev().find(|at| at.0 == pass && at.1 <= analysis);
        let &(_, from) = before.ok_or(ReplayError::NothingKept(name))?;
        Ok(Self { particle: asked.particle, pass, analysis, from })
    }

    /// Analyses that are made again before the run.
    pub fn n_before(&self) -> usize {
        self.analysis - self.from
    }
}

/// Where a particle was run.
struct Ran {
    /// Pass and analysis.
    analyses: BTreeSet<(usize, usize)>,
    /// Number of the last particle of any analysis; `None` where there is none.
    last: Option<usize>,
    /// Analyses that are stored: pass and step.
    stored: Vec<(usize, usize)>,
}

impl Ran {
    fn read(store: &Store, particle: u32) -> Result<Self, StoreError> {
        let pair = |row: &rusqlite::Row<'_>| Ok((row.get(0)?, row.get(1)?));
        let stored: Vec<(usize, usize)> =
            store.rows("SELECT pass, step FROM analyses ORDER BY pass, step", pair)?;
        let of = format!("SELECT DISTINCT pass, step FROM jobs WHERE pass > 0 AND particle = {particle}");
        let known: BTreeSet<(usize, usize)> = stored.iter().copied().collect();
        // Runs between two passes belong to no analysis.
        let analyses = store.rows(&of, pair)?.into_iter().filter(|at| known.contains(at)).collect();
        // Beside analyses there are runs that choose where a pass starts.
        let select = "SELECT max(particle) FROM jobs WHERE pass = 1 AND step = 0";
        let last: Vec<Option<usize>> = store.rows(select, |row| row.get(0))?;
        Ok(Self { analyses, last: last.into_iter().flatten().next(), stored })
    }

    fn not_run(&self, asked: &Asked) -> ReplayError {
        let passes = self.stored.last().map_or(0, |at| at.0);
        let pass = asked.pass.filter(|pass| (1..=passes).contains(pass)).unwrap_or(passes);
        let last = self.stored.iter().filter(|at| at.0 == pass).map(|at| at.1).max().unwrap_or(0);
        let words =
            [asked.pass.map(|n| format!("pass {n}")), asked.analysis.map(|n| format!("analysis {n}"))];
        let asked_for = words.into_iter().flatten().collect::<Vec<_>>().join(", ");
        ReplayError::NotRun { particle: asked.particle, asked: asked_for, passes, pass, last }
    }
}
