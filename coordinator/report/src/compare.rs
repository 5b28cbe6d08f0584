//! Runs side by side, from their stores alone: settings that differ, parameters, errors, and log evidence where it compares.
//!
//! Nothing is fitted or run; a run that is not finished shows what it has. Next files to read: [`settings`], [`page`].

mod page;
mod settings;
#[cfg(test)]
mod tests;

use std::path::Path;

use serde::Serialize;
use starlings_study::RunFolder;
use starlings_study::posterior::Estimate;
use starlings_study::store::{Purpose, Store, StoreError};
use starlings_study::summary::{ChannelFit, Summary};

pub use page::compare_page;
use settings::Setting;

/// Several runs side by side; every list of values has one per run, in the order of `runs`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The runs.
    pub runs: Vec<Compared>,
    /// Settings of the studies that are not the same in all of them.
    pub settings: Vec<Setting>,
    /// Estimated parameters, by name.
    pub parameters: Vec<ParameterAcross>,
    /// Errors of the predictions, by output.
    pub errors: Vec<ErrorAcross>,
    /// Log evidence.
    pub evidence: Evidence,
}

/// One run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// Its folder.
    pub folder: String,
    /// Study name.
    pub study: String,
    /// Model kind.
    pub model: String,
    /// Whether it is finished: only then it has numbers.
    pub finished: bool,
    /// `finished`, `running` with the process that does, or `not finished`.
    pub state: String,
    /// Version of the program.
    pub version: String,
    /// Runs of the model.
    pub runs: Option<u64>,
    /// Wall time, s.
    pub wall_s: Option<f64>,
    /// Its warnings.
    pub warnings: Vec<String>,
}

/// One parameter in every run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterAcross {
    /// Its name.
    pub name: String,
    /// Unit label; where runs differ in it one after the other, in the order of the runs.
    pub unit: String,
    /// `null` where a run does not estimate it.
    pub values: Vec<Option<Estimate>>,
    /// The largest difference between two runs over the root of the sum of their variances at the stated noise; `null` with fewer
    /// than two values or another unit.
    pub apart: Option<f64>,
}

/// The error of one output in every run, over all records.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorAcross {
    /// Output name.
    pub output: String,
    /// `null` where a run has no such output.
    pub values: Vec<Option<ChannelFit>>,
}

/// Whether log evidence compares, and what it says.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evidence {
    /// Natural logarithm of the evidence; `null` of a run that is not finished.
    pub values: Vec<Option<f64>>,
    /// Below the best, so that exp of the difference is a Bayes factor; `null` where it does not compare.
    pub below_best: Option<Vec<f64>>,
    /// Why it compares or does not.
    pub says: String,
}

/// Record, output, time, measured value and noise of a value that was fitted, to the bit.
type Fitted = (String, String, u64, Option<u64>, u64);

/// What of a run is read once.
struct Read {
    compared: Compared,
    study: String,
    summary: Option<Summary>,
    /// All that was fitted.
    fitted: Vec<Fitted>,
}

/// Why runs cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The folder is of another command.
    #[error(
        "{0} is the folder of an explanation: compare takes runs; its before and after stand side by side in its report"
    )]
    Explanation(String),
    /// The store failed or is damaged.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Puts runs side by side.
///
/// # Errors
/// [`CompareError`] for a folder that is no run's, and for a store that fails.
pub fn compare(folders: &[RunFolder]) -> Result<Comparison, CompareError> {
    let all = folders.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let studies: Vec<&str> = all.iter().map(|run| run.study.as_str()).collect();
    Ok(Comparison {
        settings: settings::differing(&studies),
        parameters: parameters(&all),
        errors: errors(&all),
        evidence: evidence(&all),
        runs: all.into_iter().map(|run| run.compared).collect(),
    })
}

fn read(folder: &RunFolder) -> Result<Read, CompareError> {
    let path = folder.path.display().to_string();
    if folder.purpose()? == Purpose::Explanation {
        return Err(CompareError::Explanation(path));
    }
    let (_, info) = folder.about()?;
    let summary = folder.summary()?;
    let state = match (&summary, folder.holder()) {
        (Some(_), _) => "finished".to_owned(),
        (None, Some(holder)) => format!("running, {holder}"),
        (None, None) => "not finished: --resume goes on".to_owned(),
    };
    let compared = Compared {
        folder: path,
        study: info.name,
        model: info.model,
        finished: summary.is_some(),
        state,
        version: info.version,
        runs: summary.as_ref().map(|s| s.runs.total),
        wall_s: summary.as_ref().map(|s| s.wall_s),
        warnings: summary.as_ref().map(|s| s.warnings.clone()).unwrap_or_default(),
    };
    let study = folder.store.meta("study")?.unwrap_or_default();
    Ok(Read { compared, study, summary, fitted: fitted(&folder.store)? })
}

fn fitted(store: &Store) -> Result<Vec<Fitted>, StoreError> {
    store.rows(
        "SELECT record, output, time, observed, noise FROM predictions WHERE use = 'train' ORDER BY record, output, time",
        |row| {
            let observed: Option<f64> = row.get(3)?;
            let bits = |at| row.get(at).map(f64::to_bits);
            Ok((row.get(0)?, row.get(1)?, bits(2)?, observed.map(f64::to_bits), bits(4)?))
        },
    )
}

/// Every name of any run once, in the order in which they come.
fn names<'a>(all: &'a [Read], of: impl Fn(&'a Summary) -> Vec<&'a str>) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for name in all.iter().filter_map(|run| run.summary.as_ref()).flat_map(of) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

fn parameters(all: &[Read]) -> Vec<ParameterAcross> {
    let row = |name: &str| {
        let find = |run: &Read| run.summary.as_ref()?.parameters.iter().find(|p| p.name == name).cloned();
        let values: Vec<Option<Estimate>> = all.iter().map(find).collect();
        let known: Vec<&Estimate> = values.iter().flatten().collect();
        let mut units: Vec<&str> = known.iter().map(|e| e.unit.as_str()).collect();
        units.dedup();
        let apart = apart(&known).filter(|_| units.len() == 1);
        ParameterAcross { name: name.to_owned(), unit: units.join(", "), values, apart }
    };
    names(all, |s| s.parameters.iter().map(|p| p.name.as_str()).collect()).into_iter().map(row).collect()
}

/// The largest difference in standard deviations of the difference.
fn apart(known: &[&Estimate]) -> Option<f64> {
    let pairs = known.iter().enumerate().flat_map(|(k, a)| known[k + 1..].iter().map(move |b| (*a, *b)));
    pairs
        .map(|(a, b)| (a.estimate - b.estimate).abs() / a.sd.hypot(b.sd))
        .filter(|d| d.is_finite())
        .reduce(f64::max)
}

fn errors(all: &[Read]) -> Vec<ErrorAcross> {
    let row = |name: &str| {
        let find = |run: &Read| run.summary.as_ref()?.fit.channels.iter().find(|c| c.name == name).cloned();
        ErrorAcross { output: name.to_owned(), values: all.iter().map(find).collect() }
    };
    names(all, |s| s.fit.channels.iter().map(|c| c.name.as_str()).collect()).into_iter().map(row).collect()
}

fn evidence(all: &[Read]) -> Evidence {
    let values: Vec<Option<f64>> =
        all.iter().map(|run| Some(run.summary.as_ref()?.fit.log_likelihood)).collect();
    let finite: Option<Vec<f64>> = values.iter().map(|v| v.filter(|v| v.is_finite())).collect();
    let same = all.windows(2).all(|pair| pair[0].fitted == pair[1].fitted);
    let (below_best, says) = match finite {
        None => (None, "Log evidence does not compare: not every run is finished with a finite one."),
        Some(_) if !same => (
            None,
            "Log evidence does not compare: the runs were not fitted to the same values with the same stated noise.",
        ),
        Some(known) => {
            let best = known.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let says = "All runs were fitted to the same values with the same stated noise: exp of a difference is a Bayes factor. It \
                        depends on the priors.";
            (Some(known.iter().map(|v| v - best).collect()), says)
        }
    };
    Evidence { values, below_best, says: says.to_owned() }
}

/// The name of a run where several stand side by side: its folder's, or the whole path where two are called the same.
pub(super) fn labels(runs: &[Compared]) -> Vec<String> {
    let short = |run: &Compared| {
        let name = Path::new(&run.folder).file_name();
        name.map_or_else(|| run.folder.clone(), |name| name.to_string_lossy().into_owned())
    };
    let names: Vec<String> = runs.iter().map(short).collect();
    let is_twice = |name: &String| names.iter().filter(|other| *other == name).count() > 1;
    runs.iter()
        .zip(&names)
        .map(|(run, name)| if is_twice(name) { run.folder.clone() } else { name.clone() })
        .collect()
}

impl Comparison {
    /// What the runs are called side by side.
    pub fn labels(&self) -> Vec<String> {
        labels(&self.runs)
    }

    /// The whole in a sentence or two.
    pub fn verdict(&self) -> String {
        let far = self.parameters.iter().filter(|p| p.apart.is_some_and(|d| d > 2.0)).count();
        let known = self.parameters.iter().filter(|p| p.apart.is_some()).count();
        let agree = match (known, far) {
            (0, _) if self.runs.iter().any(|run| !run.finished) => {
                let unfinished = self.labels().into_iter().zip(&self.runs).filter(|(_, run)| !run.finished);
                let names: Vec<String> = unfinished.map(|(label, _)| label).collect();
                format!("Not finished, and so without estimates to compare: {}.", names.join(", "))
            }
            (0, _) => "The runs share no estimated parameter.".to_owned(),
            (n, 0) => {
                format!("{n} shared parameters agree within two standard deviations of their difference.")
            }
            (n, far) => format!(
                "{far} of {n} shared parameters differ by more than two standard deviations of their difference."
            ),
        };
        let labels = self.labels();
        let best = self.evidence.below_best.as_ref().and_then(|below| {
            let at = below.iter().position(|v| v.abs() <= 0.0)?;
            let next =
                below.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, v)| -v).reduce(f64::min)?;
            Some(format!(" The evidence is largest for {}, by {next:.1} in its logarithm.", labels[at]))
        });
        agree + &best.unwrap_or_default()
    }
}
