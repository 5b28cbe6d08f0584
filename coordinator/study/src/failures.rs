//! Failed runs by what they said and where they lie: how many, and which parameter tells them from the runs that worked.
//!
//! Messages that differ in numbers alone are of one class. Only sums are kept, however many runs there are. Next file to read:
//! [`crate::fit::runner`].

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Classes of messages kept; what comes later counts as another failure.
const CLASSES: usize = 50;

/// Letters of a message that make its class.
const LONGEST: usize = 200;

/// Class of the messages beyond [`CLASSES`].
const OTHERS: &str = "other failures";

/// Distance of two means, in standard deviations, from which a parameter is said to separate.
const SEPARATES: f64 = 1.0;

/// The same in standard errors, without which a few runs would separate by chance.
const SIGNIFICANT: f64 = 3.0;

/// Failed runs of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FailureCluster {
    /// What they said, with `#` for numbers.
    pub message: String,
    /// How many.
    pub runs: u64,
    /// Where they lie.
    pub parameters: Vec<FailedRange>,
    /// The parameter that tells them best from the runs that worked; absent where none does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub separates: Option<String>,
}

/// The values of one parameter in failed runs and in those that worked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FailedRange {
    /// Its name.
    pub parameter: String,
    /// Smallest and largest value of the runs that failed so, physical units.
    pub failed: [f64; 2],
    /// The same of those that worked; absent where none did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worked: Option<[f64; 2]>,
}

/// Sums over the values of a parameter. They are kept as bits, so that a resume goes on with the same sums.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[u64; 5]", into = "[u64; 5]")]
struct Spread {
    n: f64,
    mean: f64,
    squares: f64,
    range: [f64; 2],
}

impl Default for Spread {
    fn default() -> Self {
        Self { n: 0.0, mean: 0.0, squares: 0.0, range: [f64::INFINITY, f64::NEG_INFINITY] }
    }
}

impl Spread {
    /// Welford's update.
    fn add(&mut self, value: f64) {
        self.n += 1.0;
        let off = value - self.mean;
        self.mean += off / self.n;
        self.squares += off * (value - self.mean);
        self.range = [self.range[0].min(value), self.range[1].max(value)];
    }

    /// Distance of the means in standard deviations within both; zero where it could be chance (the two-sample t statistic).
    fn distance(&self, other: &Self) -> f64 {
        let apart = (self.mean - other.mean).abs();
        let sd = ((self.squares + other.squares) / (self.n + other.n - 2.0).max(1.0)).sqrt();
        let standard_error = sd * (1.0 / self.n + 1.0 / other.n).sqrt();
        if apart > SIGNIFICANT * standard_error { apart / sd } else { 0.0 }
    }
}

impl From<[u64; 5]> for Spread {
    fn from(bits: [u64; 5]) -> Self {
        let [n, mean, squares, low, high] = bits.map(f64::from_bits);
        Self { n, mean, squares, range: [low, high] }
    }
}

impl From<Spread> for [u64; 5] {
    fn from(Spread { n, mean, squares, range: [low, high] }: Spread) -> Self {
        [n, mean, squares, low, high].map(f64::to_bits)
    }
}

/// Runs by how they ended.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Failures {
    worked: Vec<Spread>,
    classes: BTreeMap<String, Vec<Spread>>,
}

impl Failures {
    /// Takes note of a run with these parameters and of what it said when it failed.
    pub(crate) fn learn(&mut self, theta: &[f64], failure: Option<&str>) {
        let spreads = match failure {
            None => &mut self.worked,
            Some(message) => {
                let class = masked(message);
                let known = self.classes.contains_key(&class) || self.classes.len() < CLASSES;
                self.classes.entry(if known { class } else { OTHERS.to_owned() }).or_default()
            }
        };
        spreads.resize(theta.len().max(spreads.len()), Spread::default());
        spreads.iter_mut().zip(theta).for_each(|(spread, value)| spread.add(*value));
    }

    /// The clusters, the largest first.
    pub(crate) fn clusters(&self, names: &[String]) -> Vec<FailureCluster> {
        let cluster = |(message, spreads): (&String, &Vec<Spread>)| {
            let worked = |i: usize| self.worked.get(i).filter(|spread| spread.n > 0.0);
            let range = |(i, (name, spread)): (usize, (&String, &Spread))| FailedRange {
                parameter: name.clone(),
                // A value beyond the largest number ends there: infinity does not survive JSON.
                failed: spread.range.map(|v| v.clamp(f64::MIN, f64::MAX)),
                worked: worked(i).map(|spread| spread.range),
            };
            let distances = names.iter().zip(spreads).enumerate();
            let distances = distances.filter_map(|(i, (name, s))| Some((name, s.distance(worked(i)?))));
            let best = distances.max_by(|(_, a), (_, b)| a.total_cmp(b));
            FailureCluster {
                message: message.clone(),
                runs: spreads.first().map_or(0, |spread| spread.n as u64),
                parameters: names.iter().zip(spreads).enumerate().map(range).collect(),
                separates: best.filter(|(_, d)| *d >= SEPARATES).map(|(name, _)| name.clone()),
            }
        };
        let mut clusters = self.classes.iter().map(cluster).collect::<Vec<_>>();
        clusters.sort_by_key(|cluster| std::cmp::Reverse(cluster.runs));
        clusters
    }
}

impl FailureCluster {
    /// One sentence for a reader of the result.
    pub(crate) fn told(&self) -> String {
        let Self { message, runs, parameters, separates } = self;
        let (s, range) =
            (if *runs == 1 { "" } else { "s" }, |[lo, hi]: [f64; 2]| format!("{lo:.4} to {hi:.4}"));
        let best = parameters.iter().find(|p| Some(&p.parameter) == separates.as_ref());
        let place = best.map_or_else(
            || "no parameter tells them from the runs that worked".to_owned(),
            |p| {
                let worked = p.worked.map(|worked| format!(", and {} where it worked", range(worked)));
                format!(
                    "{} tells them best from the others: {}{}",
                    p.parameter,
                    range(p.failed),
                    worked.unwrap_or_default()
                )
            },
        );
        format!("{runs} run{s} failed with \"{message}\"; {place}.")
    }
}

/// A message with `#` for each number in it, and not too long.
fn masked(message: &str) -> String {
    let mut text = String::new();
    let mut letters = message.lines().next().unwrap_or_default().chars().peekable();
    while let Some(letter) = letters.next() {
        let begins =
            letter.is_ascii_digit() && !text.ends_with(|c: char| c.is_ascii_alphabetic() || c == '_');
        if !begins {
            text.push(letter);
            continue;
        }
        while letters.next_if(|c| c.is_ascii_digit() || "._eE+-".contains(*c)).is_some() {}
        if text.ends_with('-') {
            text.pop();
        }
        text.push('#');
    }
    text.chars().take(LONGEST).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_message_do_not_make_its_class() {
        assert_eq!(
            masked("the step fell to 1e-12 at t = 0.25: too stiff"),
            "the step fell to # at t = #: too stiff"
        );
        assert_eq!(masked("x1 is -3.5\nmore"), "x1 is #");
    }

    #[test]
    fn failures_are_counted_by_message_and_the_parameter_that_separates_them_is_named() {
        let names = ["k", "c"].map(str::to_owned);
        let mut failures = Failures::default();
        for i in 0..100 {
            let (k, c) = (f64::from(i), f64::from(i % 7));
            let late = format!("more than {i} steps");
            let failure = match i {
                0..10 => Some(late.as_str()),
                50 => Some("not finite"),
                _ => None,
            };
            failures.learn(&[k, c], failure);
        }
        let clusters = failures.clusters(&names);
        let of =
            |i: usize| (clusters[i].message.as_str(), clusters[i].runs, clusters[i].separates.as_deref());
        let kept = serde_json::to_string(&failures).expect("numbers");
        assert_eq!(serde_json::from_str::<Failures>(&kept).expect("the same"), failures);
        assert_eq!(of(0), ("more than # steps", 10, Some("k")));
        assert_eq!(of(1), ("not finite", 1, None));
        let k = &clusters[0].parameters[0];
        assert_eq!((k.failed, k.worked), ([0.0, 9.0], Some([10.0, 99.0])));
        let told = clusters[0].told();
        assert!(told.contains("10 runs failed with \"more than # steps\"; k tells them best"), "{told}");
        assert!(clusters[1].told().contains("no parameter"), "{}", clusters[1].told());
    }

    #[test]
    fn a_thousand_kinds_of_messages_are_kept_as_few() {
        let mut failures = Failures::default();
        for i in 0..1000_u32 {
            let word: String = format!("{i:04}").bytes().map(|b| char::from(b - b'0' + b'a')).collect();
            failures.learn(&[1.0], Some(&word));
        }
        let clusters = failures.clusters(&["k".to_owned()]);
        assert_eq!((clusters.len(), clusters[0].message.as_str()), (CLASSES + 1, OTHERS));
        assert_eq!(clusters.iter().map(|cluster| cluster.runs).sum::<u64>(), 1000);
    }
}
