//! Runs that are known to work, by record and window: what control runs are made of.
//!
//! Only names stand here; whoever holds the jobs keeps the copies. Next file to read: [`super::doubt`].

use std::collections::{BTreeMap, BTreeSet};

use starlings_proto::SetupId;

use super::message::{Command, ControlId};
use crate::job_name::JobName;

/// Kept runs of one record and window, each of another setup.
const KEPT: usize = 2;

/// Record and window of a run.
type RecordWindow = (u32, [u64; 2]);

/// Runs that are known to work.
#[derive(Debug, Default)]
pub(super) struct Proven {
    kept: BTreeMap<RecordWindow, Vec<(SetupId, ControlId)>>,
    next: u64,
}

impl Proven {
    /// Takes note of a run that worked; what has to be kept and forgotten for it.
    pub(super) fn learn(&mut self, name: JobName, setup: &SetupId, index: usize, out: &mut Vec<Command>) {
        let of_window = self.kept.entry((name.record, name.span)).or_default();
        if of_window.iter().any(|(known, _)| known == setup) {
            return;
        }
        if of_window.len() == KEPT {
            // The first one is kept: most studies have one model, and explanations begin with the one without effects.
            let (_, control) = of_window.remove(KEPT - 1);
            out.push(Command::Forget { control });
        }
        self.next += 1;
        let control = ControlId(self.next);
        of_window.push((*setup, control));
        out.push(Command::Keep { control, index });
    }

    /// Forgets runs over windows that no job of a new batch has.
    pub(super) fn keep_only<'a>(&mut self, names: impl Iterator<Item = &'a JobName>, out: &mut Vec<Command>) {
        if self.kept.is_empty() {
            return;
        }
        let wanted: BTreeSet<RecordWindow> = names.map(|name| (name.record, name.span)).collect();
        self.kept.retain(|window, kept| {
            let wanted_still = wanted.contains(window);
            if !wanted_still {
                out.extend(kept.iter().map(|&(_, control)| Command::Forget { control }));
            }
            wanted_still
        });
    }

    /// Whether any run over the record and window of this job is known to work.
    pub(super) fn knows(&self, name: JobName) -> bool {
        self.kept.contains_key(&(name.record, name.span))
    }

    /// A run over the record and window of this job whose setup `is_ready`: of the same setup, if there is one.
    pub(super) fn find(
        &self,
        name: JobName,
        setup: &SetupId,
        is_ready: impl Fn(&SetupId) -> bool,
    ) -> Option<ControlId> {
        let kept = self.kept.get(&(name.record, name.span))?;
        let same = kept.iter().find(|(known, _)| known == setup);
        same.or_else(|| kept.iter().find(|(known, _)| is_ready(known))).map(|&(_, control)| control)
    }
}
