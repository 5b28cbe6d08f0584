//! The page of results: how many faults of every kind, and what came of them.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::judge::Outcome;
use super::plan::{Case, Lasts, Reached};

/// Where the page stands.
pub(crate) const PAGE: &str = "docs/faults.md";

/// What stands before the table.
const HEAD: &str = include_str!("head.md");

/// Cases of one line of the table.
#[derive(Default)]
pub(crate) struct Line {
    went_on: usize,
    resumed: usize,
}

/// The lines, by the fault and how the solver is reached.
#[derive(Default)]
pub(crate) struct Table(BTreeMap<(String, &'static str), Line>);

impl Table {
    /// Counts a case.
    pub(crate) fn add(&mut self, case: &Case, outcome: Outcome) {
        let again = if case.fault.lasts == Lasts::UntilRepaired { " (lasting)" } else { "" };
        let reached = match case.reached {
            Reached::Command => "command",
            Reached::Grpc => "gRPC",
            Reached::Mpi => "MPI",
        };
        self.line(format!("{}: {}{again}", case.fault.kind, case.fault.says), reached, outcome);
    }

    /// Counts a case of a full disk.
    pub(crate) fn add_disk(&mut self, outcome: Outcome) {
        self.line("full-store: the disk of the run folder is full".to_owned(), "command", outcome);
    }

    fn line(&mut self, name: String, reached: &'static str, outcome: Outcome) {
        let line = self.0.entry((name, reached)).or_default();
        match outcome {
            Outcome::WentOn => line.went_on += 1,
            Outcome::Resumed => line.resumed += 1,
        }
    }

    /// Cases of all lines.
    pub(crate) fn n(&self) -> usize {
        self.0.values().map(|line| line.went_on + line.resumed).sum()
    }

    /// The page.
    pub(crate) fn page(&self) -> String {
        let mut text = HEAD.to_owned();
        text.push_str(
            "| fault | solver | cases | went on | stopped, then resumed |\n|---|---|---|---|---|\n",
        );
        for ((name, reached), line) in &self.0 {
            let (on, resumed) = (line.went_on, line.resumed);
            writeln!(text, "| {name} | {reached} | {} | {on} | {resumed} |", on + resumed).unwrap();
        }
        let sum = |of: fn(&Line) -> usize| self.0.values().map(of).sum::<usize>();
        let (on, resumed) = (sum(|line| line.went_on), sum(|line| line.resumed));
        writeln!(text, "| all | | {} | {on} | {resumed} |", on + resumed).unwrap();
        text
    }
}
