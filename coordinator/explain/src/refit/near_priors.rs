//! A second start, where the model as it is fits best far from its priors.
//!
//! A model without its effect may bend its parameters so far that nothing in it is left where it was meant, and there an effect does something
//! else than where it acts: an epidemic without recoveries fits as one that has hardly begun. The candidates are scored once more with every
//! parameter held near its prior, and those that do most are refitted from there. Next file to read: [`super::race`].

use nalgebra::DVector;
use starlings_models::SetupError;
use starlings_study::FAR_FROM_PRIOR;

use super::ranking::largest_of_each;
use super::search::Searcher;
use crate::error::ExplainError;
use crate::fit::drive::{drive, drive_rounds};
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::model_variant::ModelVariant;
use crate::judge::search_result::SearchResult;

/// Prior standard deviations within which the parameters are held for it.
const NEAR: f64 = 1.0;
/// Candidates that begin there at most.
const MOST: usize = 24;
/// Rounds of runs after which the parameters are free ...
const ROUNDS: usize = 12;
/// ... for so many of those that promise most.
const FINAL: usize = 4;

/// Whether any parameter stands far from its prior.
fn is_far(fit: &FittedVariant<'_>) -> bool {
    fit.z().iter().any(|z| z.abs() > FAR_FROM_PRIOR)
}

/// The model as it is, every parameter of which is held near its prior, where it is not yet fitted.
fn held<'c>(base: &FittedVariant<'c>) -> Result<FittedVariant<'c>, SetupError> {
    let mut variant = ModelVariant::new(base.variant.base, Vec::new(), &[])?;
    variant.scaled.bounds.fill([-NEAR, NEAR]);
    let start = DVector::zeros(variant.n_param());
    Ok(FittedVariant::begin(variant, start))
}

impl<'c> Searcher<'_, '_, 'c> {
    /// Refits what does most with the parameters near their priors, where the fit of the model as it is lies far from them. Of two fits of
    /// one effect the better counts.
    pub(super) fn refit_near_priors(&mut self, found: &mut SearchResult<'c>) -> Result<(), ExplainError> {
        if !is_far(&found.base) || self.cut_short {
            return Ok(());
        }
        self.cache.stage("screen", "the same near the priors, from which the model as it is lies far");
        let mut near = [held(&found.base)?];
        self.cut_short |= !drive(self.cache, &mut near)?;
        let [near] = near;
        if near.residual().is_empty() || near.jacobian.of_train.is_empty() || near.optimum().is_err() {
            return Ok(());
        }
        let screening = self.screen_all(&near)?;
        let mut best = largest_of_each(screening.iter().filter(|h| h.failure.is_none()), |h| h.score.gain);
        best.truncate(MOST);
        let mut fits = best.iter().map(|h| self.with_candidate(&near, h)).collect::<Result<Vec<_>, _>>()?;
        for fit in &mut fits {
            fit.hold_own(NEAR);
        }
        self.cache.stage("refit", &format!("{} candidates near the priors", fits.len()));
        self.cut_short |= !drive_rounds(self.cache, &mut fits, ROUNDS)?;
        fits.sort_by(|a, b| a.promised().total_cmp(&b.promised()));
        fits.truncate(FINAL);
        for fit in &mut fits {
            fit.hold_own(f64::INFINITY);
        }
        let mut fits = self.refit(fits)?;
        fits.retain(|fit| {
            !fit.residual().is_empty() && found.judged.iter().all(|j| !is_as_good(&j.fit, fit))
        });
        found.judged.retain(|j| !fits.iter().any(|fit| is_same(&j.fit, fit)));
        self.judge_all(found, fits)
    }
}

/// Whether two fits are of the same single effect.
fn is_same(one: &FittedVariant<'_>, other: &FittedVariant<'_>) -> bool {
    let [a, b] = [&one.variant, &other.variant];
    a.left_out == b.left_out && a.effects.len() == 1 && b.has_just(&[a.effects[0].index])
}

/// Whether a fit of the same effect ended as low.
fn is_as_good(known: &FittedVariant<'_>, fit: &FittedVariant<'_>) -> bool {
    is_same(known, fit) && known.cost() <= fit.cost()
}
