//! Why variants and candidates were rejected, in words with numbers.
//!
//! Nothing is decided here; the gates and the verdict have decided. Next file to read: [`crate::judge::gates`].

use starlings_models::units::spaced;

use super::result::Rejected;
use crate::fit::candidate::Candidate;
use crate::judge::contribution::lacking_shares;
use crate::judge::gates::JudgedFit;
use crate::judge::search_result::SearchResult;
use crate::judge::verdict::Decision;
use crate::number::three;
use crate::screen::screening_result::ScreeningResult;

/// What was refused, with reasons: refitted variants first, then candidates that failed, have no influence of their own, or
/// would need the wrong sign.
pub(crate) fn rejected(
    found: &SearchResult<'_>,
    candidates: &[Candidate],
    decision: &Decision,
) -> Vec<Rejected> {
    let mut list = Vec::new();
    let keep: Vec<usize> = decision.best.iter().copied().chain(decision.rivals.clone()).collect();
    // Another start of what is told is no other answer.
    let is_told = |judged: &JudgedFit<'_>| {
        let variant = |j: &JudgedFit<'_>| (j.names(), j.fit.variant.left_out.clone());
        keep.iter().any(|k| variant(&found.judged[*k]) == variant(judged))
    };
    let others = found.judged.iter().enumerate().filter(|(i, judged)| !keep.contains(i) && !is_told(judged));
    for (i, judged) in others {
        let (gate, reason) = match &judged.refusal {
            Some(refusal) => (refusal.gate.to_owned(), refusal.reason.clone()),
            None => ("evidence".to_owned(), behind(found, decision, i)),
        };
        list.push(Rejected { name: judged.fit.variant.name(), gate, reason });
    }
    for (index, candidate) in candidates.iter().enumerate() {
        let of = || found.screening.iter().filter(|h| h.candidate == index);
        let name = candidate.name().to_owned();
        if let Some(failure) =
            of().find_map(|h| h.failure.as_ref()).filter(|_| of().all(|h| h.failure.is_some()))
        {
            list.push(Rejected { name, gate: failure.gate().to_owned(), reason: failure.reason() });
        } else if of().count() > 0 && of().all(ScreeningResult::is_absorbed) {
            let reason =
                "the model's parameters imitate it: it cannot be told from them, which does not mean absent";
            list.push(Rejected { name, gate: "absorbed".to_owned(), reason: reason.to_owned() });
        } else if let Some(result) = wrong_sign(found, index, candidate) {
            let parameter = &candidate.def.parameters[0];
            let reason = format!(
                "{} would have to be {} ± {}{}, a sign that physics does not allow",
                parameter.name,
                three(result.score.amplitude),
                three(result.score.sd),
                spaced(&parameter.unit)
            );
            list.push(Rejected { name, gate: "sign".to_owned(), reason });
        }
    }
    list
}

/// The best screening result of a candidate that would gain more than chance if physics allowed its sign, at every point of its
/// grid.
fn wrong_sign<'f>(
    found: &'f SearchResult<'_>,
    index: usize,
    candidate: &Candidate,
) -> Option<&'f ScreeningResult> {
    let of = || found.screening.iter().filter(|h| h.candidate == index && h.failure.is_none());
    let never = of().all(|h| h.allowed_gain(candidate.sign()) <= 0.0);
    of().filter(|h| never && h.score.gain > found.null_distribution.threshold)
        .max_by(|a, b| a.score.gain.total_cmp(&b.score.gain))
}

/// Why a variant that passes the gates is not named.
fn behind(found: &SearchResult<'_>, decision: &Decision, i: usize) -> String {
    let Some(best) = decision.best.map(|b| &found.judged[b]) else { return String::new() };
    let judged = &found.judged[i];
    let name = best.fit.variant.name();
    if judged.fit.variant.effects.len() > best.fit.variant.effects.len()
        && let Some((train, held_out)) = lacking_shares(found, judged, best)
    {
        return format!(
            "beyond `{name}` it takes away {:.1} % of the gap on the training data{}: a further effect must carry a tenth of {}, or \
             settle a discrepancy that the first leaves",
            100.0 * train,
            held_out.map_or_else(String::new, |h| format!(" and {:.1} % on the held-out span", 100.0 * h)),
            if held_out.is_some() { "what was held out, and of both on average" } else { "it" }
        );
    }
    format!(
        "with it χ² of all data together, less the price of its further parameters, falls by {:.1}, with `{name}` by {:.1}, in \
         units of the effective noise",
        judged.rank() / best.inflation,
        best.rank() / best.inflation
    )
}
