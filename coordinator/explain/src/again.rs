//! The second look of the search: what is left after the best, which replacement and which pair to try.
//!
//! Next files to read: [`super::form`], then [`super::verdict`].

use starlings_study::{Record, Study};

use super::bent::{bent, constants};
use super::candidate::Candidate;
use super::carried::carried;
use super::fit::Fitted;
use super::form::{Leftover, Measured, leftover};
use super::judge::Judged;
use super::screen::{Hit, screen};
use super::search::{Found, Searcher};
use super::version::{Member, Version};
use super::{ExplainError, Options};

impl<'c> Searcher<'_, '_, 'c> {
    /// Scores the candidates again at the best version: what is left, and which replacements and pairs to try. The version that
    /// the verdict will be about has been looked at in the end.
    pub(super) fn look_again(
        &mut self,
        found: &mut Found<'c>,
        options: &Options,
    ) -> Result<(), ExplainError> {
        for _ in 1..=options.max_effects {
            if found.judged.first().is_none_or(|j| j.refusal.is_some()) {
                return Ok(());
            }
            let hits = self.look_at(found, 0)?;
            let best = &found.judged[0];
            let name = best.fit.version.name();
            let seconds: Vec<Hit> = self
                .best_of_each(&hits)
                .into_iter()
                .filter(|h| h.score.gain / best.inflation > found.background.threshold)
                .take(2)
                .collect();
            if seconds.is_empty() {
                break;
            }
            let fits = self.further(found, best, &seconds, options)?;
            let n = fits.len();
            self.judge_all(found, fits)?;
            let same = found.judged.first().is_some_and(|j| j.fit.version.name() == name);
            if n == 0 || same {
                break;
            }
        }
        let passing = found.passing();
        if let Some(chosen) = (!passing.is_empty()).then(|| carried(found, &passing).checked)
            && found.judged[chosen].leftover.is_none()
        {
            self.look_at(found, chosen)?;
        }
        Ok(())
    }

    /// Scores the candidates at a refitted version, by its position, and notes what they and bent forms of its effect could still take away.
    fn look_at(&mut self, found: &mut Found<'c>, place: usize) -> Result<Vec<Hit>, ExplainError> {
        let judged = &found.judged[place];
        self.laboratory.stage("screen", &format!("again, with {}", judged.fit.version.name()));
        let hits = self.screen(&judged.fit, &self.best_points(&found.hits))?;
        let left = self.left(judged, &hits)?;
        let version = |j: &Judged<'_>| (j.fit.version.name(), j.fit.version.left_out.clone());
        let of_place = version(judged);
        if let Some(first) = found.judged.iter_mut().find(|j| version(j) == of_place) {
            first.leftover = Some(left);
        }
        Ok(hits)
    }

    /// What the candidates and the bent forms of the best could still take away.
    fn left(&mut self, best: &Judged<'c>, library: &[Hit]) -> Result<Leftover, ExplainError> {
        let forms = bent(best, self.tracks, span(self.laboratory.study));
        let (bent, constants) = (self.measure(best, forms)?, self.measure(best, constants(best))?);
        let measured = Measured { library, bent: &bent, constants: &constants };
        leftover(self.laboratory, &best.fit, &measured)
    }

    /// The influence of additions that are no candidates, as far as the budget goes.
    fn measure(&mut self, best: &Judged<'c>, mut forms: Vec<Candidate>) -> Result<Vec<Hit>, ExplainError> {
        // Not every term can be bent in every way: an own state may not read what the term reads.
        forms.retain(|form| {
            let mut members: Vec<Member<'_>> = best.fit.version.members.clone();
            members.push(Member { candidate: form, index: 0, unit: 1.0 });
            Version::new(best.fit.version.base, members, &best.fit.version.left_out).is_ok()
        });
        let of: Vec<(usize, usize)> = (0..forms.len()).map(|i| (i, 0)).collect();
        if !self.laboratory.affords(of.len()) {
            return Ok(Vec::new());
        }
        screen(self.laboratory, &best.fit, &forms, &of, self.tracks)
    }

    /// Replacements (a second effect alone, where it was not refitted yet) and pairs.
    fn further(
        &mut self,
        found: &Found<'c>,
        best: &Judged<'c>,
        seconds: &[Hit],
        options: &Options,
    ) -> Result<Vec<Fitted<'c>>, ExplainError> {
        let tried = |indices: &[usize]| {
            found.judged.iter().any(|j| {
                let members: Vec<usize> = j.fit.version.members.iter().map(|m| m.index).collect();
                members.len() == indices.len() && indices.iter().all(|i| members.contains(i))
            })
        };
        let mut fits = Vec::new();
        for second in seconds {
            if !tried(&[second.candidate])
                && let Some(alone) =
                    self.best_of_each(&found.hits).iter().find(|h| h.candidate == second.candidate)
            {
                fits.push(self.with(&found.base, alone)?);
            }
            let mut pair: Vec<usize> = best.fit.version.members.iter().map(|m| m.index).collect();
            pair.push(second.candidate);
            if pair.len() <= options.max_effects && !tried(&pair) {
                fits.push(self.with(&best.fit, second)?);
            }
        }
        self.laboratory.stage("refit", &format!("{} replacements and pairs", fits.len()));
        self.refit(fits)
    }

    /// The best point of the grid of every candidate, as far as the first screening tells.
    fn best_points(&self, hits: &[Hit]) -> Vec<(usize, usize)> {
        let best = self.best_of_each(hits);
        let point = |hit: &Hit| {
            let points = &self.candidates[hit.candidate].points;
            points.iter().position(|p| *p == hit.point).map(|p| (hit.candidate, p))
        };
        let mut of: Vec<(usize, usize)> = best.iter().filter_map(point).collect();
        for c in 0..self.candidates.len() {
            let sound = hits.iter().any(|h| h.candidate == c && h.failure.is_none());
            if sound && !of.iter().any(|(known, _)| *known == c) {
                of.push((c, 0));
            }
        }
        of
    }
}

/// First and last training time of a study.
fn span(study: &Study) -> [f64; 2] {
    let spans = || study.records.iter().filter_map(Record::train_span);
    let from = spans().map(|s| s[0]).fold(f64::INFINITY, f64::min);
    [from, spans().map(|s| s[1]).fold(f64::NEG_INFINITY, f64::max)]
}
