//! Whether every effect of a variant carries its share of the gap: one that does not is no effect, but shows that its partner is
//! not quite right, or that a discrepancy of another kind remains. Next file to read: [`super::verdict`].

use super::misfit::Misfit;
use super::search_result::SearchResult;

/// A further effect must carry this share of the gap.
const SECOND_SHARE: f64 = 0.1;
/// Effective variance of the residuals above which what remains is a discrepancy of its own, not the form of an effect.
pub(crate) const DISCREPANT: f64 = 20.0;

/// What came first.
pub(crate) struct ContributionCheck {
    /// The best variant whose every effect carries its share of the gap, on the training data and again on the held-out span.
    pub(crate) best: usize,
    /// The variant whose form is checked: with a further effect that takes away what is not of the form of the best.
    pub(crate) checked: usize,
    /// Where a further effect carries too little of both, why its partner is not quite right.
    pub(crate) because: Option<String>,
}

/// Takes a further effect away that does not carry its share.
pub(crate) fn check_contributions(found: &SearchResult<'_>, passing: &[usize]) -> ContributionCheck {
    let first = passing[0];
    let whole = &found.judged[first];
    let all = ContributionCheck { best: first, checked: first, because: None };
    if whole.fit.variant.effects.len() < 2 {
        return all;
    }
    let alone = passing.iter().copied().find(|i| {
        let judged = &found.judged[*i];
        judged.fit.variant.effects.len() + 1 == whole.fit.variant.effects.len()
            && judged.names().iter().all(|name| whole.names().contains(name))
    });
    let Some(alone) = alone else { return all };
    let part = &found.judged[alone];
    let share = |of: fn(&Misfit) -> f64| {
        let whole_fall = of(&found.before) - of(&whole.misfit);
        (of(&part.misfit) - of(&whole.misfit)) / whole_fall.max(f64::MIN_POSITIVE)
    };
    let train = share(|m| m.train);
    let held_out = (whole.misfit.n_held_out > 0).then(|| share(|m| m.held_out));
    if train >= SECOND_SHARE && held_out.is_none_or(|h| h >= SECOND_SHARE) {
        return all;
    }
    // What does not come again in the held-out span is not the effect's form.
    if held_out.is_some_and(|h| h < 0.3 * train) || found.judged[alone].inflation > DISCREPANT {
        return ContributionCheck { best: alone, ..all };
    }
    let because = format!(
        "`{}` leaves {:.1} % of what `{}` takes away, too much for chance and too little for an effect of its own: its form is \
         not quite right",
        part.fit.variant.name(),
        100.0 * train,
        whole.fit.variant.name()
    );
    ContributionCheck { best: alone, checked: alone, because: Some(because) }
}
