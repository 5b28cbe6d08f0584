//! Other forms of what is named.
//!
//! A name is worth as much as the forms that it was compared with. Where one effect explains the gap down to the noise, the forms that
//! describe a dependence and no cause (generic terms, and terms that nobody listed) are scored in its place, and those that come as near as a
//! tie allows are refitted: what the data do not tell apart is told as a tie. They are the forms of its own equations; of a term of no
//! field, and of an instrument's error, which can imitate almost anything, those of every equation that the data feel. Next file to read:
//! [`crate::judge::verdict`].

use super::search::Searcher;
use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::fit::kind::Kind;
use crate::fit::model_variant::AddedEffect;
use crate::judge::gates::JudgedFit;
use crate::judge::search_result::SearchResult;
use crate::locate::Track;
use crate::options::Options;
use crate::run_cache::{Course, RunCache};
use crate::screen::screening_result::ScreeningResult;

/// Kinds that describe a dependence and no cause.
const FORMS: &[Kind] = &[Kind::Generic, Kind::Proposal];
/// How far the score of a form may lie below that of what is named, in units of the effective noise: what keeps two versions tied at most ...
const BAND: f64 = 12.0;
/// ... and as a share of it: scores of the first order are off by as much.
const FIRST_ORDER: f64 = 0.05;

/// The effect of a variant of which there may be other forms: the only one, which takes no term's place and leaves nothing but noise. A form
/// of no field is not named where more is left.
pub(crate) fn sole_effect<'j, 'c>(judged: &'j JudgedFit<'c>) -> Option<&'j AddedEffect<'c>> {
    let [effect] = judged.fit.variant.effects.as_slice() else { return None };
    (judged.adequacy.could_be_white() && judged.fit.variant.left_out.is_empty()).then_some(effect)
}

/// Scores the forms that may stand in place of what is named, at the model as it is, and refits those that come near. Whether any was.
///
/// # Errors
/// As [`super::search::search`].
pub(crate) fn search_other_forms<'c>(
    cache: &mut RunCache<'_>,
    found: &mut SearchResult<'c>,
    candidates: &'c [Candidate],
    tracks: &[Track],
    options: &Options,
    named: usize,
) -> Result<bool, ExplainError> {
    let Some(effect) = sole_effect(&found.judged[named]) else { return Ok(false) };
    let points = forms_of(found, candidates, effect.candidate);
    if points.is_empty() {
        return Ok(false);
    }
    let gain = |h: &ScreeningResult| h.allowed_gain(candidates[h.candidate].sign());
    let of_named =
        found.screening.iter().filter(|h| h.candidate == effect.index).map(gain).fold(0.0, f64::max);
    let least = of_named - BAND * found.judged[named].inflation - FIRST_ORDER * of_named;
    let stage = format!("other forms of {}", effect.candidate.name());
    let mut searcher = Searcher { cache, candidates, tracks, cut_short: false, asked: false, tried: FORMS };
    searcher.cache.foreseen.goes(Course::Open);
    searcher.cache.stage("screen", &stage);
    let screening = searcher.screen(&found.base, &points)?;
    let mut near = searcher.best_of_each(&screening);
    near.retain(|h| gain(h) > least);
    let is_any = !near.is_empty();
    if is_any {
        searcher.widen(found, screening.clone())?;
        let fits = searcher.race_and_refit(&found.base, &near, &screening)?;
        searcher.judge_all(found, fits)?;
        if found.judged.first().is_some_and(|first| first.leftover.is_none()) {
            searcher.second_pass(found, &Options { max_effects: 1, ..options.clone() })?;
        }
    } else {
        found.screening.extend(screening);
    }
    found.cut_short |= searcher.cut_short || searcher.cache.was_cut_short();
    Ok(is_any)
}

/// The points of the grids of the forms that may stand in place of an effect and were not scored yet.
fn forms_of(found: &SearchResult<'_>, candidates: &[Candidate], named: &Candidate) -> Vec<(usize, usize)> {
    let adds_to = |quantity: &str| named.def.adds.iter().any(|add| add.to == quantity);
    let is_in_place =
        |form: &Candidate| !named.kind.is_of_a_field() || form.def.adds.iter().all(|add| adds_to(&add.to));
    let is_scored = |index: usize| found.screening.iter().any(|h| h.candidate == index);
    let open = candidates
        .iter()
        .enumerate()
        .filter(|(index, c)| c.kind.is_of_no_field() && is_in_place(c) && !is_scored(*index));
    open.flat_map(|(index, c)| (0..c.points.len()).map(move |point| (index, point))).collect()
}
