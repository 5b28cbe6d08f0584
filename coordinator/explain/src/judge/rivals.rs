//! Which variants come so close to the best that the data cannot tell them apart.
//!
//! Next file to read: [`super::verdict`].

use starlings_estimators::effective_sample_size;

use super::gates::JudgedFit;
use super::search_result::SearchResult;
use crate::fit::kind::Kind;
use crate::run_cache::RunCache;

/// A rival is tied within this difference in χ², in units of the effective noise.
pub(super) const MARGIN: f64 = 6.0;
/// A rival is tied where the difference in χ² is less than so many of its standard deviations.
const VUONG: f64 = 1.64;

/// Other variants that pass the gates and come as close as chance allows: by the fall of χ², or, up to twice that margin,
/// because the difference of their residuals is not clearly of one sign (Vuong 1989, with the autocorrelation of that
/// difference).
pub(super) fn rivals(
    cache: &RunCache<'_>,
    found: &SearchResult<'_>,
    passing: &[usize],
    best: usize,
) -> Vec<usize> {
    let of_best = &found.judged[best];
    let size = of_best.fit.variant.effects.len();
    let near = |i: &usize| {
        let judged = &found.judged[*i];
        // Neither the prior nor its absence breaks a tie.
        let apart = (of_best.rank() - judged.rank()).min(of_best.standing() - judged.standing());
        *i != best
            && judged.fit.variant.effects.len() == size
            && judged.names() != of_best.names()
            && (apart <= 0.0 || !elaborates(judged, of_best))
            && (apart < MARGIN * of_best.inflation
                || (apart < 2.0 * MARGIN * of_best.inflation
                    && apart < VUONG * scatter(cache, of_best, judged)))
    };
    passing.iter().copied().filter(near).collect()
}

/// Whether a variant of forms that stand for no cause has more values inside its terms than the best, but for widths that round a corner:
/// one that does no better with them is an elaboration of what is told, as a clamp beyond all values is of what it clamps, and no rival of it.
fn elaborates(judged: &JudgedFit<'_>, best: &JudgedFit<'_>) -> bool {
    let of = |judged: &JudgedFit<'_>| -> Vec<(Kind, usize)> {
        judged.fit.variant.effects.iter().map(|e| (e.candidate.kind, e.candidate.n_inner())).collect()
    };
    is_elaboration(&of(judged), &of(best))
}

/// The same by the kinds of the effects of both, and how many values each has inside its terms.
fn is_elaboration(form: &[(Kind, usize)], best: &[(Kind, usize)]) -> bool {
    let sum = |of: &[(Kind, usize)]| of.iter().map(|(_, inner)| inner).sum::<usize>();
    form.iter().all(|(kind, _)| kind.is_of_no_field()) && sum(form) > sum(best)
}

/// Standard deviation of the difference in χ² of two variants, over all rows.
fn scatter(cache: &RunCache<'_>, a: &JudgedFit<'_>, b: &JudgedFit<'_>) -> f64 {
    let rows = &cache.rows;
    let (of_a, of_b) = (rows.whitened(&a.fit.predicted), rows.whitened(&b.fit.predicted));
    let variance = |stretch: std::ops::Range<usize>| {
        let apart: Vec<f64> = stretch.map(|i| of_b[i].powi(2) - of_a[i].powi(2)).collect();
        let n = apart.len() as f64;
        let mean = apart.iter().sum::<f64>() / n;
        let square = apart.iter().map(|d| (d - mean).powi(2)).sum::<f64>();
        let effective = effective_sample_size(&apart);
        square * if effective > 0.0 { (n / effective).max(1.0) } else { 1.0 }
    };
    rows.stretches().into_iter().map(variance).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::candidate::Candidate;
    use starlings_models::effect::{EffectDef, EffectParameter};

    #[test]
    fn a_form_with_a_further_value_inside_elaborates_and_a_cause_or_a_rounded_corner_does_not() {
        let (drag, clamp) = ((Kind::Library, 0), (Kind::Proposal, 1));
        assert!(is_elaboration(&[clamp], &[drag]));
        assert!(!is_elaboration(&[(Kind::Proposal, 0)], &[drag]), "as simple a form is a rival");
        assert!(!is_elaboration(&[(Kind::Library, 1)], &[drag]), "so is a cause");
        assert!(!is_elaboration(&[clamp, drag], &[drag]), "and a set with a cause in it");
        let width = |is_rounding| EffectParameter { is_rounding, ..EffectParameter::default() };
        let parameters = vec![width(false), width(true), width(false)];
        assert_eq!(Candidate::new(EffectDef { parameters, ..EffectDef::default() }).n_inner(), 1);
    }
}
