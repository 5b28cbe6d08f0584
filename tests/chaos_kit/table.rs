//! The page of results: how many faults of every kind in every sort of study, and what came of them.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::campaign::Done;
use super::studies::{SORTS, Sort};

/// Where the page stands.
pub(crate) const PAGE: &str = "docs/chaos.md";

/// What stands before the table.
const HEAD: &str = include_str!("head.md");

/// Faults that happened.
#[derive(Default)]
pub(crate) struct Table {
    faults: BTreeMap<Done, BTreeMap<Sort, usize>>,
    campaigns: BTreeMap<Sort, usize>,
    acknowledged: usize,
}

impl Table {
    /// Counts the faults of a campaign that ended well.
    pub(crate) fn add(&mut self, sort: Sort, done: &[Done], acknowledged: usize) {
        self.acknowledged += acknowledged;
        *self.campaigns.entry(sort).or_default() += 1;
        for done in done {
            *self.faults.entry(*done).or_default().entry(sort).or_default() += 1;
        }
    }

    /// Faults of all campaigns.
    pub(crate) fn n(&self) -> usize {
        self.faults.values().flat_map(BTreeMap::values).sum()
    }

    /// Campaigns.
    pub(crate) fn n_campaign(&self) -> usize {
        self.campaigns.values().sum()
    }

    /// The table.
    pub(crate) fn text(&self) -> String {
        let mut text = "| fault |".to_owned();
        for sort in SORTS {
            write!(text, " {} |", sort.says()).unwrap();
        }
        writeln!(text, " all |\n|---|{}---|", "---|".repeat(SORTS.len())).unwrap();
        for (done, by_sort) in &self.faults {
            let long = if done.long { ", for longer than the limit of silence" } else { "" };
            line(&mut text, &format!("{}{long}", done.kind.says()), |sort| {
                by_sort.get(&sort).copied().unwrap_or(0)
            });
        }
        let sum = |sort| self.faults.values().filter_map(|by_sort| by_sort.get(&sort)).sum();
        line(&mut text, "all", sum);
        line(&mut text, "studies", |sort| self.campaigns.get(&sort).copied().unwrap_or(0));
        text
    }

    /// The page.
    pub(crate) fn page(&self, wrong: usize) -> String {
        let (n, campaigns) = (self.n(), self.n_campaign());
        format!(
            "{HEAD}{n} faults in {campaigns} studies that ended as they must; {wrong} studies hung, lost an acknowledged run, had another \
             posterior or left something behind. {} runs were acknowledged and in no analysis yet when a coordinator ended; all of \
             them were used.\n\n{}",
            self.acknowledged,
            self.text()
        )
    }
}

fn line(text: &mut String, name: &str, of: impl Fn(Sort) -> usize) {
    write!(text, "| {name} |").unwrap();
    for sort in SORTS {
        write!(text, " {} |", of(sort)).unwrap();
    }
    writeln!(text, " {} |", SORTS.into_iter().map(of).sum::<usize>()).unwrap();
}
