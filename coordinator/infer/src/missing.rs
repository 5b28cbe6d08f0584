//! Which terms the drift lacks: candidates scored by the sums that are there already, and compared on recordings that nothing was inferred from.
//!
//! What is decided and at which rate of false alarms is the estimators' (`estimators/src/inference/missing.rs`). Next file to read: `words.rs`.

use starlings_estimators::inference::{
    Candidate, Fit, InferenceError, Missing, Named, Posterior, Prior, Score, Search, Structure, Sums, joint,
    missing_terms,
};
use starlings_study::infer_choice::{InferChoice, MissingChoice};

use crate::answer::coefficient;
use crate::error::InferError;
use crate::result::{CoefficientFound, HeldOut, JointScore, LEVEL, MissingFound, NamedTerm, ScoredTerm};

/// Scores of single candidates that are listed, the strongest first.
const LISTED: usize = 10;

/// The structure with all candidates, and the fit over it.
pub(crate) struct Wider<'a> {
    pub(crate) structure: &'a Structure,
    /// Coefficients of the model, which come first.
    pub(crate) n_own: usize,
    pub(crate) fit: Fit,
}

impl<'a> Wider<'a> {
    /// The fit of the model's coefficients, with candidates of which nothing is known beforehand.
    pub(crate) fn new(structure: &'a Structure, fit: &Fit) -> Result<Self, InferError> {
        let (n, n_own) = (structure.n_coefficient(), fit.prior.n_coefficient());
        let mean = fit.prior.mean().clone().resize_vertically(n, 0.0);
        let precision = fit.prior.precision().clone().resize(n, n, 0.0);
        let fit = Fit { prior: Prior::with_precision(mean, precision)?, ..fit.clone() };
        Ok(Self { structure, n_own, fit })
    }

    /// What the sums of all recordings say, and those of the recordings that were held out.
    pub(crate) fn look(
        &self,
        choice: &InferChoice,
        settings: MissingChoice,
        sums: &Sums,
        held_out: Option<(&Sums, Vec<String>)>,
    ) -> Result<MissingFound, InferError> {
        let free = [f64::NEG_INFINITY, f64::INFINITY];
        let all = self.n_own..self.structure.n_coefficient();
        let candidates: Vec<Candidate> =
            all.map(|coefficient| Candidate { coefficient, range: free }).collect();
        let search = Search { false_alarm: settings.false_alarm, most: settings.most };
        let found = missing_terms(&self.fit, sums, self.structure, &candidates, search)?;
        let score = |score: &Score| ScoredTerm {
            name: self.name(score.coefficients[0]),
            chi_squared: score.chi_squared,
            by_chance: score.by_chance,
        };
        Ok(MissingFound {
            candidates: candidates.len(),
            false_alarm: settings.false_alarm,
            named: found.named.iter().map(|named| self.named(&found, named)).collect(),
            strongest: found.alone.iter().take(LISTED).map(score).collect(),
            left: self.left(sums, &found)?,
            held_out: held_out.map(|(sums, records)| self.held_out(&found, sums, records)).transpose()?,
            coefficients: self.coefficients(choice, &found),
        })
    }

    fn name(&self, coefficient: usize) -> String {
        self.structure.coefficients()[coefficient].name.clone()
    }

    fn named(&self, found: &Missing, named: &Named) -> NamedTerm {
        let p = named.coefficient;
        let value = found.posterior.estimates[p].value;
        NamedTerm {
            name: self.name(p),
            estimate: value.map_or(f64::NAN, |value| value.mean),
            sd: value.map_or(f64::NAN, |value| value.sd),
            interval90: found.posterior.interval(p, LEVEL).unwrap_or([f64::NAN; 2]),
            chi_squared: named.score.chi_squared,
            by_chance: named.score.by_chance,
            ties: named.ties.iter().map(|p| self.name(*p)).collect(),
        }
    }

    /// Whether anything of the candidates' kind is left beside the model and what was named.
    fn left(&self, sums: &Sums, found: &Missing) -> Result<Option<JointScore>, InferenceError> {
        let is_named = |p: &usize| found.named.iter().any(|named| named.coefficient == *p);
        let family: Vec<usize> =
            (self.n_own..self.structure.n_coefficient()).filter(|p| !is_named(p)).collect();
        let score = joint(&self.fit, sums, self.structure, &family)?;
        Ok(score.map(|score| JointScore {
            terms: score.coefficients.len(),
            chi_squared: score.chi_squared,
            by_chance: score.by_chance,
        }))
    }

    /// How much better recordings that nothing was inferred from are predicted with the named terms.
    fn held_out(&self, found: &Missing, sums: &Sums, records: Vec<String>) -> Result<HeldOut, InferError> {
        let log = |posterior: &Posterior| self.fit.log_likelihood(sums, posterior);
        let with = log(&found.posterior)?;
        let without = log(&found.model)?;
        let overflow = || InferError::Setting("the held-out records have no finite likelihood".to_owned());
        let gain = with.zip(without).map(|(with, without)| with - without).ok_or_else(overflow)?;
        Ok(HeldOut { records, n_step: sums.n_step(), gain })
    }

    /// The model's coefficients with the named terms.
    fn coefficients(&self, choice: &InferChoice, found: &Missing) -> Vec<CoefficientFound> {
        let is_named = |p: usize| found.named.iter().any(|named| named.coefficient == p);
        let shown = (0..found.posterior.estimates.len()).filter(|p| *p < self.n_own || is_named(*p));
        shown.map(|p| coefficient(choice, &found.posterior, p, None)).collect()
    }
}
