//! The result of an explanation, as it is written to `explain.json`. Its field names are a contract with readers of that file.
//!
//! Plain data; nothing is computed here. Next file to read: [`super`].

use serde::{Deserialize, Serialize};

pub use super::correlated::CorrelatedChannel;
use crate::fit::kind::Kind;
use crate::judge::held_out::HeldOut;
use crate::judge::probability::Probabilities;
use crate::judge::verdict::Verdict;
use crate::locate::MisfitPlace;
use crate::screen::not_tried::NotTried;

/// The answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Explanation {
    /// Study name.
    pub study: String,
    /// Model kind.
    pub model: String,
    /// Seed of every random choice.
    pub seed: u64,
    /// The verdict.
    pub verdict: Verdict,
    /// The verdict in one or two sentences.
    pub headline: String,
    /// How probable each answer is; none where there is no gap.
    #[serde(default)]
    pub probabilities: Option<Probabilities>,
    /// Where simulation and data disagree, worst first.
    #[serde(rename = "where")]
    pub places: Vec<MisfitPlace>,
    /// The effects that were added; empty unless named or tied (then the best of the class).
    pub effects: Vec<NamedEffect>,
    /// Terms of the model that the effects replace.
    pub replaced: Vec<String>,
    /// Every set of effects that explains the gap about as well as `effects`, by their names.
    pub tied_with: Vec<Vec<String>>,
    /// The errors with each of these sets; none for one that was not refitted.
    #[serde(default)]
    pub tied_gap: Vec<Vec<GapRow>>,
    /// What else explains it as well and has no name of its own, in words: a limiting or another form of `effects`.
    #[serde(default)]
    pub tied_forms: Vec<String>,
    /// The experiment that would best separate the tied sets.
    pub experiment: Option<Experiment>,
    /// Where nothing explains the gap, the effects of what came nearest.
    pub closest: Vec<NamedEffect>,
    /// Every candidate that was screened, best first.
    pub screened: Vec<Screened>,
    /// Candidates that were refitted and refused, with the reason in words.
    pub rejected: Vec<Rejected>,
    /// Root mean square error before and after, by channel and use: with what was added, or with what came nearest; the same twice
    /// where nothing was refitted.
    pub gap: Vec<GapRow>,
    /// Errors on held-out data, by record and channel, with the effects that were named or came nearest.
    #[serde(default)]
    pub held_out: Vec<HeldOut>,
    /// Kinds of physics of which nothing was tried, and why.
    #[serde(default)]
    pub not_tried: Vec<NotTried>,
    /// The channels whose noise is correlated in time; what is said of all residuals counts in units of that noise.
    #[serde(default)]
    pub correlated_noise: Vec<CorrelatedChannel>,
    /// What is left of the gap.
    pub remaining: Remaining,
    /// How often this search would name an effect where none is missing.
    pub false_alarm: FalseAlarm,
    /// What the added effects did to the model's own parameters.
    pub parameter_shifts: Vec<ParameterShift>,
    /// Candidates that the budget left untried.
    pub untried: Vec<String>,
    /// The study with the effects in it, relative to the run folder.
    pub explained_study: Option<String>,
    /// The conditions under which the intervals and the verdict hold.
    pub conditional_on: String,
    /// Runs of the model: one particle over one record each.
    pub runs: u64,
    /// Runs by stage, in the order of the stages.
    pub runs_by_stage: Vec<(String, u64)>,
    /// Workers that answered.
    pub workers: usize,
    /// Wall time in s.
    pub wall_s: f64,
    /// Warnings.
    pub warnings: Vec<String>,
}

impl Explanation {
    /// Everything that explains the gap about as well, in words: the tied sets, then other forms of what is told.
    pub fn ties(&self) -> Vec<String> {
        let sets = self.tied_with.iter().map(|set| set.join(" + "));
        sets.chain(self.tied_forms.iter().cloned()).collect()
    }
}

/// An effect with its coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedEffect {
    /// Name.
    pub name: String,
    /// One plain sentence.
    pub says: String,
    /// Where it enters and by which term: (to, term).
    pub adds: Vec<(String, String)>,
    /// Its own states with their rates: (name, rate).
    #[serde(default)]
    pub states: Vec<(String, String)>,
    /// Its parameters, the amplitude first.
    pub parameters: Vec<Coefficient>,
    /// What can look the same in data.
    pub confounders: Vec<String>,
    /// Where the form of the term comes from.
    pub source: String,
    /// Where the effect comes from.
    #[serde(default)]
    pub kind: Kind,
}

impl NamedEffect {
    /// Its terms as equations: a term is added to the rate of a state, and to the value of anything else. Its own states follow.
    ///
    /// `states` are the names of the model's states.
    pub fn equations(&self, states: &[String]) -> Vec<String> {
        let left = |to: &String| if states.contains(to) { format!("d {to}/dt") } else { to.clone() };
        let terms = self.adds.iter().map(|(to, term)| format!("{} += {term}", left(to)));
        terms.chain(self.states.iter().map(|(name, rate)| format!("d {name}/dt = {rate}"))).collect()
    }
}

/// An estimated parameter of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coefficient {
    /// Name.
    pub name: String,
    /// Unit label.
    pub unit: String,
    /// Estimate.
    pub estimate: f64,
    /// Standard deviation.
    pub sd: f64,
    /// Central 95 % interval.
    pub interval95: [f64; 2],
}

/// One candidate in the screening.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Screened {
    /// Name of the effect.
    pub name: String,
    /// Values of its inner parameters at which it scored best, as `name = value`; empty without any.
    pub at: String,
    /// Share of the gap (χ² above its expectation) that it would explain, to first order.
    pub share: f64,
    /// Fall of χ², to first order.
    pub gain: f64,
    /// Amplitude, to first order; none where nothing of its influence is its own, or none was measured.
    pub amplitude: Option<f64>,
    /// Part of its influence that the model's parameters cannot imitate, from 0 to 1.
    pub identifiable: f64,
    /// What became of it: `named`, `tied`, `refitted`, `not refitted`, `wrong sign`, `absorbed by the parameters`,
    /// `no influence`, `failed`.
    pub fate: String,
}

/// A candidate that was refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rejected {
    /// Name, or names joined by ` + `.
    pub name: String,
    /// The gate that it did not pass: `sign`, `range`, `held-out span`, `held-out channel`, `evidence`, `failed`, `absorbed`.
    pub gate: String,
    /// Why, in words with numbers.
    pub reason: String,
}

/// Root mean square error of one channel before and after.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GapRow {
    /// Record name.
    pub record: String,
    /// Output name.
    pub channel: String,
    /// Unit label of the errors and of the noise.
    #[serde(default)]
    pub unit: String,
    /// `train`, `held-out` or `held-out-channel`.
    #[serde(rename = "use")]
    pub usage: String,
    /// Before.
    pub before: f64,
    /// After.
    pub after: f64,
    /// Noise sd.
    pub noise: f64,
}

/// What is left of the gap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Remaining {
    /// Root mean square of the residuals of the training data over their noise.
    pub rmse_over_noise: f64,
    /// Probability of residuals at least as autocorrelated if they were white (Ljung & Box 1978); 1 where that was not tested.
    pub whiteness_p: f64,
    /// Whether the residuals are long and varied enough to be tested for it.
    #[serde(default)]
    pub whiteness_tested: bool,
    /// Factor that size and correlation of the residuals make on the variance of a smooth signal's coefficient.
    pub inflation: f64,
    /// Fall of χ² that all candidates and modulated forms of the effect together would still bring, to first order, in units of
    /// the effective noise.
    pub form_gain: f64,
    /// The same on the held-out span.
    pub form_gain_held_out: f64,
    /// Share of what remains above the noise that these would take away.
    pub form_share: f64,
    /// Largest fall of χ² that a fully modulated form of the effect would bring if it were the truth.
    pub form_power: f64,
    /// The shape of what remains, in words.
    pub shape: String,
}

/// How often the search would name an effect where none is missing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FalseAlarm {
    /// The rate, for this study.
    pub rate: f64,
    /// Upper end of its 95 % interval.
    pub upper95: f64,
    /// How it was found.
    pub how: String,
    /// Simulations behind it.
    pub runs: u64,
    /// Fall of χ², in units of the effective noise, that the search must exceed.
    pub threshold: f64,
    /// Share of decoys (candidates with their time reversed or shifted) that score as well as the best candidate.
    pub decoys: f64,
    /// The rate as measured by the whole search on simulated recordings, where that was asked for.
    pub nulls: Option<Nulls>,
}

/// The whole search on recordings in which nothing is missing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Nulls {
    /// Recordings with a name, alone or tied.
    pub names: usize,
    /// Recordings.
    pub of: usize,
    /// Upper end of the 95 % interval of the rate (Wilson 1927).
    pub upper95: f64,
    /// Runs of the model.
    pub runs: u64,
}

/// What happened to one of the model's own parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterShift {
    /// Name in the estimated vector.
    pub name: String,
    /// Unit label.
    pub unit: String,
    /// Estimate without the effects.
    pub before: f64,
    /// Estimate with the effects.
    pub after: f64,
    /// Standard deviation of the latter.
    pub sd: f64,
    /// The shift and the standard deviation in units of the prior's, where estimates are Gaussian; absent in results of earlier
    /// versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub in_prior_sd: Option<[f64; 2]>,
}

/// An experiment that separates tied effects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Experiment {
    /// What to do, in one sentence; of several the one with the largest separation.
    pub says: String,
    /// The two sets of effects that it is about.
    #[serde(default)]
    pub between: Vec<String>,
    /// Expected difference in χ² between the two sets hardest to separate, in that experiment.
    pub separation: f64,
    /// The same in the data at hand.
    pub separation_now: f64,
    /// All experiments that were simulated: (what, separation), best first.
    pub tried: Vec<(String, f64)>,
}
