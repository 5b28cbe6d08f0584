//! Objections against naming a variant that passes every gate, and why no variant passes them, in words with numbers.
//!
//! Next file to read: [`super::held_out`].

use super::adequacy::{AS_STATED, Adequacy, Nature};
use super::contribution::{SECOND_SHARE, SMALL_SHARE};
use super::form::{Leftover, white_noise, white_share};
use super::gates::JudgedFit;
use super::held_out::{FAR, far_off, forbidding, listed};
use super::search_result::SearchResult;
use crate::fit::kind::Kind;
use crate::run_cache::RunCache;
use crate::screen::screening_result::ScreeningResult;

/// How the study says that a noise was given and not found.
const GIVEN: &str = "given";
/// Share of white noise in the residuals above which the rest of them must be white too ...
const AUDIBLE: f64 = 0.12;
/// ... if their effective variance is above this.
const STRUCTURED: f64 = 3.0;
/// Share of the gap of the held-out span that may stay unaccounted for where the training residuals are noise.
const UNACCOUNTED: f64 = 0.15;
/// Where the residuals stay correlated, an effect must take away this share of the excess of the training rows ...
pub(crate) const SHARE: f64 = 0.5;
/// ... and this share of that of the held-out span.
const SHARE_HELD_OUT: f64 = 0.4;
/// ... and no more than this share of the decoys may do as well.
const DECOYS: f64 = 0.05;

/// Which candidate came nearest and the gate that refused it.
pub(crate) fn nearest_refused(found: &SearchResult<'_>) -> String {
    let nearest = found.judged.first().and_then(|j| Some((j, j.refusal.as_ref()?)));
    nearest.map_or_else(
        || nothing_refitted(found),
        |(judged, refusal)| {
            let name = judged.fit.variant.name();
            if judged.share < SMALL_SHARE {
                return format!(
                    "none of the {} that were refitted takes away as much as {:.0} % of the gap on the training data, `{name}` least \
                     badly",
                    found.judged.len(),
                    100.0 * SMALL_SHARE
                );
            }
            format!(
                "`{name}` comes nearest and is refused by the gate `{}`: {}",
                refusal.gate, refusal.reason
            )
        },
    )
}

/// Why nothing was refitted.
fn nothing_refitted(found: &SearchResult<'_>) -> String {
    let of = |wanted: fn(&ScreeningResult) -> bool| found.screening.iter().all(wanted);
    let text = if found.cut_short {
        "the budget ended before a candidate was refitted"
    } else if of(|h| h.failure.is_some()) {
        "no candidate has an influence that could be measured"
    } else if of(|h| h.failure.is_some() || h.is_absorbed()) {
        "the model's own parameters imitate every candidate that has an influence"
    } else if found.adequacy.is_gap() {
        "no candidate lowers the error with a sign that physics allows"
    } else {
        "no candidate gains more than chance on the training data"
    };
    text.to_owned()
}

/// The first objection against naming a variant that passes the gates.
pub(crate) fn objection(
    cache: &RunCache<'_>,
    found: &SearchResult<'_>,
    judged: &JudgedFit<'_>,
    left: Leftover,
) -> Option<String> {
    let name = judged.fit.variant.name();
    if let Some(because) = too_little(judged, &name) {
        return Some(because);
    }
    if left.is_systematic && !is_remainder(cache, judged) {
        let unseen = judged.misfit.n_held_out > 0 || !judged.held_out.is_empty();
        let held_out = if unseen {
            format!(" and {:.0} on the held-out data", left.gain_held_out)
        } else {
            String::new()
        };
        return Some(format!(
            "`{name}` comes nearest, but other candidates or a bent form of it would still take away {:.0} of χ²{held_out}, in \
             units of the effective noise: its form is not right",
            left.gain
        ));
    }
    if judged.adequacy.could_be_white() && judged.unaccounted > UNACCOUNTED {
        return Some(format!(
            "with `{name}` the residuals of the training data could be white, yet at least {:.0} % of the gap of the held-out \
             span stays beyond the uncertainty of the estimate: its form does not carry on",
            100.0 * judged.unaccounted
        ));
    }
    if !forbidding(&judged.adequacy, &judged.held_out).is_empty() {
        return Some(format!("`{name}` comes nearest, but what was held out still fails with it"));
    }
    let far_off = far_off(&judged.adequacy, &judged.held_out);
    if judged.kinds().contains(&Kind::Proposal) && !far_off.is_empty() {
        return Some(format!(
            "`{name}` comes nearest, but it was made from the training data, and others do not speak for it, whatever the uncertainty of \
             its estimate explains: {}",
            listed(&far_off)
        ));
    }
    if judged.adequacy.could_be_white() {
        return leaves_most(&judged.adequacy, judged.share)
            .then(|| takes_only(&name, judged.share, "training data", "larger than the noise"));
    }
    if judged.kinds().iter().any(|kind| kind.is_of_no_field()) && !is_all_but_noise(cache, judged) {
        return Some(format!(
            "`{name}` comes nearest, but what is left is not noise: it describes a dependence and not its cause, and such a term is \
             named only where it leaves nothing else"
        ));
    }
    correlated(cache, found, judged)
}

/// Whether the noise is stated as a judgement, above any white noise that the residuals let be heard, what is left above it is less than a
/// further effect would have to bring, and nothing is far from it, held out or not: then it is a remainder, whatever could take it away. A
/// noise that was found is no judgement.
fn is_remainder(cache: &RunCache<'_>, judged: &JudgedFit<'_>) -> bool {
    let is_heard = white_noise(&cache.rows, judged.fit.residual()) >= AS_STATED[0];
    is_stated(cache) && !is_heard && is_next_to_nothing(judged)
}

/// Whether the noise was found, from differences in which a memory does not show, and what is left above it is next to nothing of the gap and
/// nowhere far from it: then it may be that noise.
fn may_be_noise_with_memory(cache: &RunCache<'_>, judged: &JudgedFit<'_>) -> bool {
    !is_stated(cache) && is_next_to_nothing(judged)
}

/// Whether what is left may be noise, and is too little for anything else: no larger than the noise, it leaves no room for something on top.
fn is_all_but_noise(cache: &RunCache<'_>, judged: &JudgedFit<'_>) -> bool {
    let is_within = judged.adequacy.rmse_over_noise <= 1.0 && is_next_to_nothing(judged);
    judged.share >= 1.0 - SMALL_SHARE
        && (is_within || is_remainder(cache, judged) || may_be_noise_with_memory(cache, judged))
}

/// Whether what is left above the noise is less than a further effect would have to bring, and nothing is far from it, held out or not.
fn is_next_to_nothing(judged: &JudgedFit<'_>) -> bool {
    let is_near = judged.adequacy.rmse_over_noise <= FAR && judged.held_out.iter().all(|h| h.beyond <= FAR);
    is_near && judged.share >= 1.0 - SECOND_SHARE
}

/// Whether the study gives the noise of every fitted channel.
fn is_stated(cache: &RunCache<'_>) -> bool {
    let records = cache.study.records.iter().filter(|r| r.is_trained());
    records.flat_map(|r| &r.channels).filter(|c| !c.held_out).all(|c| c.noise_how.starts_with(GIVEN))
}

/// The objection that the data are too few or constant, and so cannot tell one effect from another.
fn too_little(judged: &JudgedFit<'_>, name: &str) -> Option<String> {
    let (n, p) = (judged.adequacy.n, judged.fit.variant.n_param());
    if n <= p {
        let values = if n == 1 { "value is" } else { "values are" };
        return Some(format!(
            "`{name}` comes nearest, but {n} {values} fitted with {p} parameters: so few cannot tell one effect from another"
        ));
    }
    judged.adequacy.is_at_rest().then(|| {
        format!(
            "`{name}` comes nearest, but the recorded values do not vary: data at rest cannot tell one effect from another"
        )
    })
}

/// The objection against a variant whose training residuals are correlated.
fn correlated(cache: &RunCache<'_>, found: &SearchResult<'_>, judged: &JudgedFit<'_>) -> Option<String> {
    let name = judged.fit.variant.name();
    let (white, heard) =
        (white_share(&cache.rows, judged.fit.residual()), white_noise(&cache.rows, judged.fit.residual()));
    // Where the stated noise is the one that is heard, it is no judgement, and the more is left the less of it is noise.
    let is_audible = white > AUDIBLE || (heard >= AS_STATED[0] && is_stated(cache));
    if is_audible && judged.inflation > STRUCTURED && !may_be_noise_with_memory(cache, judged) {
        return Some(format!(
            "{}, but white noise makes {:.0} % of what is left and so shows that the rest is none: its form is not right, or \
             something else is missing too",
            takes_away(&name, judged.share),
            100.0 * white
        ));
    }
    if judged.share < SHARE {
        return Some(takes_only(&name, judged.share, "training data", "correlated"));
    }
    if let Some(share) = judged.share_held_out.filter(|s| *s < SHARE_HELD_OUT) {
        return Some(takes_only(&name, share, "held-out span", "correlated"));
    }
    let decoys = found.null_distribution.decoys_above(judged.gain);
    (decoys > DECOYS).then(|| {
        format!(
            "{:.0} % of the decoys take away as much as `{name}`, and what is left is not noise",
            100.0 * decoys
        )
    })
}

/// Whether white residuals are a gap again, and the larger part of what was to be explained. Larger than stated may be the noise, but no name
/// is worth more than what it explains.
fn leaves_most(adequacy: &Adequacy, share: f64) -> bool {
    adequacy.nature() == Nature::Larger && share < SHARE
}

/// That an effect takes away too small a share of a gap, in words.
fn takes_only(name: &str, share: f64, what: &str, left: &str) -> String {
    let taken = if share > 0.0 { format!("only {:.0} %", 100.0 * share) } else { "nothing".to_owned() };
    format!("`{name}` takes away {taken} of the gap on the {what}, and what is left is {left}")
}

/// How much of the gap of the training data an effect takes away, in words.
fn takes_away(name: &str, share: f64) -> String {
    if share >= 0.995 {
        format!("`{name}` brings the training data to their noise or below")
    } else {
        format!("`{name}` takes away {:.0} % of the gap", 100.0 * share.max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_residuals_that_are_most_of_a_gap_withhold_a_name_and_noise_stated_too_small_does_not() {
        let white = |rmse_over_noise: f64| Adequacy {
            n: 200,
            rmse_over_noise,
            whiteness: Some(0.4),
            inflation: rmse_over_noise.powi(2),
            over_spread: 0.1,
            noise_freedom: f64::INFINITY,
        };
        assert!(leaves_most(&white(1.4), 0.45));
        assert!(!leaves_most(&white(1.4), 0.9), "a noise stated too small beside a large gap");
        assert!(!leaves_most(&white(1.1), 0.45), "noise");
        assert!(
            !leaves_most(&Adequacy { whiteness: Some(1e-9), ..white(1.4) }, 0.45),
            "asked where residuals are correlated"
        );
    }
}
