//! Whether every effect of a variant contributes its share to the narrowing of the gap.
//!
//! A further effect that contributes less is not named. It shows that the form of its partner is not quite right, or that a
//! discrepancy of another kind remains; unless it settles that one, so that nothing but noise is left, however small it is beside what its
//! partner takes away. Next file to read: [`super::verdict`].

use super::adequacy::{AS_STATED, Adequacy};
use super::gates::JudgedFit;
use super::held_out::HeldOut;
use super::misfit::Misfit;
use super::search_result::SearchResult;

/// Share of the fall of χ² that a further effect must contribute.
pub(crate) const SECOND_SHARE: f64 = 0.1;
/// Share below which what a further effect adds is something small that remains, and says nothing against its partner, and below which an
/// effect alone takes nothing of a gap away.
pub(crate) const SMALL_SHARE: f64 = 0.01;
/// Effective variance of the residuals above which they count as a discrepancy of another kind, not as a wrong form of the
/// effect.
pub(crate) const DISCREPANT: f64 = 20.0;

/// What the check of the contributions leaves.
pub(crate) struct ContributionCheck {
    /// The best variant each of whose effects contributes its share, on the training data and on the held-out span.
    pub(crate) best: usize,
    /// The variant whose form is checked; it may have a further effect that accounts for a discrepancy of another kind.
    pub(crate) checked: usize,
    /// Why nothing may be named, where a further effect contributes too little and so shows a wrong form of its partner.
    pub(crate) because: Option<String>,
}

/// Leaves out a further effect that does not contribute its share. `passing` are the positions of the variants that pass the
/// gates.
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
    let Some((train, held_out)) = lacking_shares(found, whole, part) else { return all };
    // A contribution that does not recur in the held-out span does not come from the form of the effect.
    let is_small = train.max(held_out.unwrap_or(0.0)) < SMALL_SHARE;
    if is_small || held_out.is_some_and(|h| h < 0.3 * train) || found.judged[alone].inflation > DISCREPANT {
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

/// The shares of a whole's fall of χ² that a further effect contributes beyond a part of it, where they are too small to name it.
pub(crate) fn lacking_shares(
    found: &SearchResult<'_>,
    whole: &JudgedFit<'_>,
    part: &JudgedFit<'_>,
) -> Option<(f64, Option<f64>)> {
    let (train, held_out) = shares(found, &whole.misfit, &part.misfit);
    (!carries_its_share(train, held_out) && !settles(whole, part)).then_some((train, held_out))
}

/// Whether a further effect settles what its partner leaves: a discrepancy of another kind, or held-out data that fail, of which nothing is
/// left but noise of the stated size, held out or not. How uncertain a noise is that was found excuses nothing here.
pub(crate) fn settles(whole: &JudgedFit<'_>, part: &JudgedFit<'_>) -> bool {
    let leaves = part.inflation > DISCREPANT || part.held_out.iter().any(|h| h.fails);
    leaves && leaves_noise(whole)
}

/// Whether a variant leaves nothing but noise of the stated size, held out or not.
pub(crate) fn leaves_noise(of: &JudgedFit<'_>) -> bool {
    is_noise(&of.adequacy, &of.held_out)
}

fn is_noise(left: &Adequacy, held_out: &[HeldOut]) -> bool {
    !left.is_gap() && left.rmse_over_noise.powi(2) <= AS_STATED[1] && !held_out.iter().any(|h| h.fails)
}

/// The share of a whole's fall of χ² that a part of it lacks: of the training rows, and of the held-out span where there is one.
fn shares(found: &SearchResult<'_>, whole: &Misfit, part: &Misfit) -> (f64, Option<f64>) {
    let share = |of: fn(&Misfit) -> f64| {
        let fall = of(&found.before) - of(whole);
        (of(part) - of(whole)) / fall.max(f64::MIN_POSITIVE)
    };
    (share(|m| m.train), (whole.n_held_out > 0).then(|| share(|m| m.held_out)))
}

/// Whether a further effect carries its share of the fall of χ²: a tenth of what was held out, and of both on average. No fit has seen what was
/// held out: what it shows makes up for a small share of the rest.
fn carries_its_share(train: f64, held_out: Option<f64>) -> bool {
    match held_out {
        None => train >= SECOND_SHARE,
        Some(h) => h >= SECOND_SHARE && train >= SMALL_SHARE && 0.5 * (train + h) >= SECOND_SHARE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_noise_of_its_size_is_settled_however_uncertain_that_size_and_nothing_held_out_may_fail() {
        let left = |rmse_over_noise: f64, whiteness: f64, noise_freedom: f64| Adequacy {
            n: 200,
            rmse_over_noise,
            whiteness: Some(whiteness),
            inflation: rmse_over_noise.powi(2),
            over_spread: 0.1,
            noise_freedom,
        };
        let held_out = |fails: bool| HeldOut {
            record: "record".to_owned(),
            channel: "channel".to_owned(),
            usage: "held-out".to_owned(),
            n: 80,
            before: 40.0,
            after: 1.0,
            beyond: 1.0,
            fails,
            mended: 1.0,
            noise: 1.0,
        };
        let (white, known) = (0.4, f64::INFINITY);
        assert!(is_noise(&left(1.01, white, known), &[held_out(false)]));
        assert!(!is_noise(&left(1.01, 1e-9, known), &[held_out(false)]), "correlated");
        assert!(!is_noise(&left(1.01, white, known), &[held_out(false), held_out(true)]));
        let uncertain = left(1.48, white, 3.0);
        assert!(!uncertain.is_gap() && !is_noise(&uncertain, &[]), "a size that was found");
    }

    #[test]
    fn what_was_held_out_makes_up_for_a_small_share_of_what_was_fitted_and_not_the_other_way_round() {
        for (train, held_out, carries) in [
            (0.2, None, true),
            (0.05, None, false),
            (0.2, Some(0.2), true),
            (0.067, Some(0.55), true),
            (0.05, Some(0.12), false),
            (0.005, Some(0.9), false),
            (0.5, Some(0.05), false),
        ] {
            assert_eq!(carries_its_share(train, held_out), carries, "{train} {held_out:?}");
        }
    }
}
