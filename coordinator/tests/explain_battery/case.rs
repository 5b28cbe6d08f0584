//! One case: what is missing, how it is recorded, and what the search said of it.
//!
//! Next file to read: [`crate::runner`].

use starlings_coordinator::explain::{Explanation, Kind as EffectKind, Verdict};

/// What is put into the data, and what the search may name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An effect of the library or of the study, which the search may name.
    Library,
    /// An effect that no name of a field describes in this system: the search reaches it by its form only.
    Generic,
    /// An effect of a form that only a proposal has.
    Unlisted,
    /// One of the library, but the search may name neither it nor its equals.
    LeftOut,
    /// Two of the library at once.
    Pair,
    /// An effect that the parameters imitate.
    Absorbed,
    /// An effect that no search knows.
    Alien,
    /// None.
    Null,
}

impl Kind {
    /// The word of the tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Library => "library",
            Self::Generic => "generic",
            Self::Unlisted => "unlisted",
            Self::LeftOut => "left out",
            Self::Pair => "pair",
            Self::Absorbed => "absorbed",
            Self::Alien => "alien",
            Self::Null => "null",
        }
    }
}

/// A data set and a search.
#[derive(Clone, Debug)]
pub struct Case {
    /// Index of the system.
    pub system: usize,
    pub kind: Kind,
    /// Name of the effect in the data.
    pub effect: Option<String>,
    /// Name of the one beside it.
    pub second: Option<String>,
    /// Names that are right.
    pub accepted: Vec<String>,
    /// Names that are right for the one beside it.
    pub accepted_second: Vec<String>,
    /// Names that are right by themselves where the data feel one of two only.
    pub alone: Vec<String>,
    /// Names that the search may not try.
    pub without: Vec<String>,
    /// Noise in standard deviations of the channels.
    pub level: f64,
    /// Correlation of the noise of neighbouring samples; 0 where it is white.
    pub rho: f64,
    /// Samples.
    pub n: usize,
    pub seed: u64,
    /// Whether the study leaves the noise to be found.
    pub auto: bool,
}

impl Case {
    /// Whether these effects are what is missing, and nothing else.
    pub fn is_right<T: AsRef<str>>(&self, set: &[T]) -> bool {
        let is_in = |name: &T, list: &[String]| list.iter().any(|known| known == name.as_ref());
        match set {
            [one] if self.second.is_some() => is_in(one, &self.alone),
            [one] => is_in(one, &self.accepted),
            [one, other] => [(one, other), (other, one)]
                .iter()
                .any(|(one, other)| is_in(one, &self.accepted) && is_in(other, &self.accepted_second)),
            _ => false,
        }
    }
}

/// What became of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The one right name.
    Right,
    /// A tie that holds the right name alone.
    RightInTie,
    /// A proposal of another form, alone or tied: told as made from the data, and as no name.
    Proposed,
    /// A wrong name, or the right one with more beside it.
    Wrong,
    /// A tie without the right name.
    TieWithout,
    Unexplained,
    NoGap,
    /// No explanation.
    Failed,
}

impl Outcome {
    pub const ALL: [Self; 8] = [
        Self::Right,
        Self::RightInTie,
        Self::Proposed,
        Self::Wrong,
        Self::TieWithout,
        Self::Unexplained,
        Self::NoGap,
        Self::Failed,
    ];

    /// The word of the tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::RightInTie => "right in tie",
            Self::Proposed => "proposed",
            Self::Wrong => "wrong",
            Self::TieWithout => "tie without",
            Self::Unexplained => "unexplained",
            Self::NoGap => "no gap",
            Self::Failed => "failed",
        }
    }

    /// Judges an explanation against what is right.
    pub fn of(found: &Explanation, case: &Case) -> Self {
        let named: Vec<&str> = found.effects.iter().map(|effect| effect.name.as_str()).collect();
        let is_right = |set: &[&str]| case.is_right(set);
        let tied = |set: &Vec<String>| case.is_right(set);
        let is_made = found.effects.iter().any(|effect| effect.kind == EffectKind::Proposal);
        match found.verdict {
            Verdict::NoGap => Self::NoGap,
            Verdict::Unexplained => Self::Unexplained,
            Verdict::Named if is_right(&named) => Self::Right,
            Verdict::Tie if is_right(&named) || found.tied_with.iter().any(tied) => Self::RightInTie,
            Verdict::Named | Verdict::Tie if is_made => Self::Proposed,
            Verdict::Named => Self::Wrong,
            Verdict::Tie => Self::TieWithout,
        }
    }
}

/// A case with its outcome and the figures of the tables.
#[derive(Clone, Debug)]
pub struct Result {
    pub case: Case,
    pub outcome: Outcome,
    /// χ² of the wrong model refitted to data without noise; of a pair, that of the model with the better one of the two.
    pub lambda: f64,
    /// The true amplitude.
    pub amplitude: f64,
    /// The estimated amplitude with its interval, where the very effect in the data was named alone.
    pub estimate: Option<(f64, [f64; 2])>,
    /// What was named, and what tied with it.
    pub named: String,
    /// What was told as a probability, with whether it is so: of every set that it is the truth alone, and that the truth is none of them.
    pub told: Vec<(f64, bool)>,
    /// Probability that was told of *none of these*.
    pub none: f64,
    /// Of what is left: root mean square over the noise, probability of its correlation in white noise, effective variance, share of the gap.
    pub left: [f64; 4],
    /// χ² of the model with what was named, refitted to data without noise: below a few units the data hold nothing against it.
    pub rival: Option<f64>,
    /// What became of the true effect in the search: its fate among the screened, or why it was refused.
    pub truth: String,
    /// Parameters inside the term of the true effect.
    pub n_inner: usize,
    /// Terms of the model that it replaces.
    pub replaced: usize,
    /// RMSE after over the true noise, on the span that was held out.
    pub held_out: Option<f64>,
    pub runs: u64,
    pub false_alarm: f64,
    pub wall_s: f64,
}

impl Result {
    /// Whether the interval of the amplitude holds the truth.
    pub fn covered(&self) -> Option<bool> {
        self.estimate.map(|(_, [lo, hi])| (lo..=hi).contains(&self.amplitude))
    }
}
