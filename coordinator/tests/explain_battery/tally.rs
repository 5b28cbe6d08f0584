//! Counts outcomes and writes them as tables.
//!
//! Next file to read: [`crate::reliability`], how often what was told as probable is so.

use std::fmt::Write as _;

use crate::case::{Kind, Outcome, Result};
use crate::reliability;
use crate::runner::UNFELT;
use crate::systems::System;

/// χ² above which the data carry the information.
pub const INFORMATION: f64 = 100.0;

/// A selection of results.
pub struct Group<'a> {
    pub name: String,
    pub results: Vec<&'a Result>,
}

impl<'a> Group<'a> {
    /// Those that `takes` picks.
    pub fn of(name: impl Into<String>, results: &'a [Result], takes: impl Fn(&Result) -> bool) -> Self {
        Self { name: name.into(), results: results.iter().filter(|result| takes(result)).collect() }
    }

    pub fn count(&self, outcome: Outcome) -> usize {
        self.results.iter().filter(|result| result.outcome == outcome).count()
    }

    /// Share of these outcomes; NaN for an empty group.
    pub fn share(&self, outcomes: &[Outcome]) -> f64 {
        let n: usize = outcomes.iter().map(|outcome| self.count(*outcome)).sum();
        n as f64 / self.results.len() as f64
    }

    /// Share of the intervals that hold the true amplitude, and their number.
    pub fn coverage(&self) -> (f64, usize) {
        let covered: Vec<bool> = self.results.iter().filter_map(|result| result.covered()).collect();
        (covered.iter().filter(|covered| **covered).count() as f64 / covered.len() as f64, covered.len())
    }

    /// Median of a figure over those that have it; NaN for none.
    pub fn median(&self, figure: impl Fn(&Result) -> Option<f64>) -> f64 {
        self.quantile(0.5, figure)
    }

    /// A quantile of a figure over those that have it; NaN for none.
    pub fn quantile(&self, at: f64, figure: impl Fn(&Result) -> Option<f64>) -> f64 {
        let mut values: Vec<f64> = self.results.iter().filter_map(|result| figure(result)).collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().saturating_sub(1);
        values.get((at * last as f64).round() as usize).copied().unwrap_or(f64::NAN)
    }

    fn row(&self) -> String {
        let mut row = format!("| {} | {} |", self.name, self.results.len());
        for outcome in Outcome::ALL {
            write!(row, " {} |", self.count(outcome)).unwrap();
        }
        let (coverage, n) = self.coverage();
        let or_dash = |value: f64, digits: usize| {
            if value.is_nan() { "–".to_owned() } else { format!("{value:.digits$}") }
        };
        let covered = if n == 0 { "–".to_owned() } else { format!("{coverage:.2} of {n}") };
        let held_out = or_dash(self.median(|result| result.held_out), 2);
        let runs = or_dash(self.median(|result| Some(result.runs as f64)), 0);
        let most = or_dash(self.quantile(1.0, |result| Some(result.runs as f64)), 0);
        write!(row, " {covered} | {held_out} | {runs} | {most} |").unwrap();
        row
    }

    /// Root mean square of the held-out RMSE over the noise, where the right effect was named, and the share above 1.1.
    fn held_out(&self) -> (f64, f64) {
        let values: Vec<f64> = self.results.iter().filter_map(|result| result.held_out).collect();
        let n = values.len() as f64;
        let above = values.iter().filter(|v| **v > 1.1).count() as f64;
        ((values.iter().map(|v| v * v).sum::<f64>() / n).sqrt(), above / n)
    }

    /// Wrong names, and those of them whose misfit to data without noise is below 30.
    fn undetectable(&self) -> (usize, usize) {
        let wrong = self.results.iter().filter(|result| result.outcome == Outcome::Wrong);
        let near = wrong.clone().filter(|result| result.rival.is_some_and(|rival| rival < UNFELT));
        (wrong.count(), near.count())
    }
}

/// A Markdown table, one row per group that is not empty.
pub fn table(groups: &[Group<'_>]) -> String {
    let words: Vec<&str> = Outcome::ALL.iter().map(|outcome| outcome.word()).collect();
    let head = format!(
        "| | cases | {} | interval holds the truth | held-out RMSE / noise | runs, median | runs, most |",
        words.join(" | ")
    );
    let rule = "|---".repeat(head.matches('|').count() - 1) + "|";
    let rows = groups.iter().filter(|group| !group.results.is_empty()).map(Group::row);
    [head, rule].into_iter().chain(rows).collect::<Vec<_>>().join("\n") + "\n"
}

/// All tables: by kind, and for effects of the library by information, noise and system.
pub fn report(results: &[Result], systems: &[System]) -> String {
    let informed = |result: &Result| result.lambda > INFORMATION;
    let mut text = String::new();
    for (is_white, title) in [(true, "By what is missing"), (false, "The same with correlated noise")] {
        let groups = by_kind(results, |r| (r.case.rho <= 0.0) == is_white);
        if groups.iter().any(|group| !group.results.is_empty()) {
            write!(text, "### {title}\n\n{}\n", table(&groups)).unwrap();
            text += &in_words(&groups[0], &groups[6]);
            let of: Vec<Result> =
                results.iter().filter(|r| (r.case.rho <= 0.0) == is_white).cloned().collect();
            write!(text, "### Probabilities\n\n{}\n", reliability::table(&of)).unwrap();
        }
    }
    let results: Vec<Result> = results.iter().filter(|r| r.case.rho <= 0.0).cloned().collect();
    let results = results.as_slice();
    if results.is_empty() {
        return text;
    }
    for kind in [Kind::Library, Kind::Generic, Kind::LeftOut] {
        let is = |result: &Result| result.case.kind == kind && informed(result);
        let mut groups = Vec::new();
        for system in systems {
            let in_system = |result: &Result| systems[result.case.system].name == system.name;
            groups.push(Group::of(system.name, results, |r| is(r) && in_system(r)));
        }
        for level in [0.01, 0.03, 0.1] {
            let at = |result: &Result| (result.case.level - level).abs() < 1e-9;
            groups.push(Group::of(format!("noise {:.0} %", 100.0 * level), results, |r| is(r) && at(r)));
        }
        for (name, auto) in [("noise given", false), ("noise found", true)] {
            groups.push(Group::of(name, results, |r| is(r) && r.case.auto == auto));
        }
        for (name, inner) in [("no value inside the term", false), ("inner values off the grid", true)] {
            groups.push(Group::of(name, results, |r| is(r) && (r.n_inner > 0) == inner));
        }
        write!(text, "### {}, λ > 100\n\n{}\n", kind.word(), table(&groups)).unwrap();
    }
    let mut groups = Vec::new();
    for system in systems {
        for truth in system.truths {
            let is = |r: &Result| {
                r.case.kind == Kind::Library
                    && informed(r)
                    && systems[r.case.system].name == system.name
                    && r.case.effect.as_deref() == Some(truth.name)
            };
            groups.push(Group::of(format!("{} {}", system.name, truth.name), results, is));
        }
    }
    write!(text, "### Library effects one by one, λ > 100\n\n{}\n", table(&groups)).unwrap();
    text
}

/// The rows of a table by what is missing, of those results that `takes` picks.
fn by_kind(results: &[Result], takes: impl Fn(&Result) -> bool) -> Vec<Group<'_>> {
    use Kind::{Absorbed, Alien, Generic, LeftOut, Library, Null, Pair, Unlisted};
    let informed = |result: &Result| result.lambda > INFORMATION;
    let mut groups = Vec::new();
    for kind in [Library, Generic, Unlisted, LeftOut, Pair, Absorbed, Alien, Null] {
        let is = |result: &Result| result.case.kind == kind && takes(result);
        let word = kind.word();
        if kind == Kind::Null || kind == Kind::Absorbed {
            groups.push(Group::of(word, results, is));
        } else {
            groups.push(Group::of(format!("{word}, λ > 100"), results, |r| is(r) && informed(r)));
            groups.push(Group::of(format!("{word}, λ < 100"), results, |r| is(r) && !informed(r)));
        }
    }
    groups
}

/// What the first table does not say of effects that the library holds, and of those left out.
fn in_words(library: &Group<'_>, left_out: &Group<'_>) -> String {
    let ((rms, above), (wrong, near)) = (library.held_out(), left_out.undetectable());
    format!(
        "Held-out RMSE over the noise where the right effect was named, λ > 100: root mean square {rms:.3}; {:.0} % of the cases \
         are above 1.1.\n\nOf the {wrong} wrong names of effects left out, λ > 100, {near} have a `rival` below 30: the data hold next \
         to nothing against them.\n\n",
        100.0 * above
    )
}

/// One line per case.
pub fn csv(results: &[Result], systems: &[System]) -> String {
    let mut text = String::from(
        "system,kind,effect,noise,rho,n,seed,auto,lambda,outcome,named,rival,replaced,amplitude,estimate,lo,hi,held_out,runs,false_alarm,wall_s,none,rmse,white_p,inflation,left,truth\n",
    );
    for r in results {
        let (estimate, [lo, hi]) = r.estimate.unwrap_or((f64::NAN, [f64::NAN; 2]));
        let case = &r.case;
        writeln!(
            text,
            "{},{},{},{},{},{},{},{},{:.4e},{},\"{}\",{:.3e},{},{:e},{estimate:e},{lo:e},{hi:e},{:.4},{},{:.4},{:.3},{:.3},{:.3},{:.2e},{:.2},{:.3},\"{}\"",
            systems[case.system].name,
            case.kind.word(),
            case.effect.iter().chain(&case.second).map(String::as_str).collect::<Vec<_>>().join(" + "),
            case.level,
            case.rho,
            case.n,
            case.seed,
            case.auto,
            r.lambda,
            r.outcome.word(),
            r.named.replace('"', "'"),
            r.rival.unwrap_or(f64::NAN),
            r.replaced,
            r.amplitude,
            r.held_out.unwrap_or(f64::NAN),
            r.runs,
            r.false_alarm,
            r.wall_s,
            r.none,
            r.left[0],
            r.left[1],
            r.left[2],
            r.left[3],
            r.truth.replace('"', "'"),
        )
        .unwrap();
    }
    text
}
