//! A fit of sums, with what its residuals say of errors of the measurement.
//!
//! Next file to read: `answer.rs`.

use starlings_estimators::inference::{
    Basis, Coefficient, Fit, InferenceError, NoiseCheck, NoiseForm, Pairs, Posterior, Structure, Sums,
    Verdict, lag_spread, noise_checks, noise_form, varying,
};
use starlings_study::infer_choice::{InferChoice, MeasuredChoice};

use crate::varying::FALSE_ALARM;

/// What there is beside sums.
#[derive(Clone, Copy)]
pub(crate) enum Given<'a> {
    /// An earlier posterior, from whose noise that of this one settles.
    Earlier(Option<&'a Posterior>),
    /// Pairs of steps of the recordings.
    Recording(&'a Basis, &'a Pairs),
}

/// The posterior of sums, freed of errors of the measurement where the residuals show them and the study leaves it to them.
pub(crate) struct Fitted {
    pub(crate) posterior: Posterior,
    pub(crate) checks: Vec<NoiseCheck>,
    /// In what the noise has not the form that the study holds it to have.
    pub(crate) departs: Vec<NoiseForm>,
    /// How it was made in the end.
    pub(crate) fit: Fit,
}

impl Fitted {
    /// Fits.
    pub(crate) fn of(
        choice: &InferChoice,
        fit: &Fit,
        structure: &Structure,
        sums: &Sums,
        given: Given<'_>,
    ) -> Result<Self, InferenceError> {
        if choice.priors.is_empty() {
            enough(sums, structure)?;
        }
        let mut posterior = match given {
            Given::Earlier(Some(earlier)) => fit.update(sums, structure, earlier)?,
            _ => fit.posterior(sums, structure)?,
        };
        let mut checks = checked(sums, structure, &posterior, given)?;
        let matters = checks.iter().any(|check| check.verdict == Verdict::Matters);
        let is_auto = choice.measured == MeasuredChoice::Auto;
        // What interpolation takes out of single steps, neighbouring ones have together.
        let first = posterior.drift().clone();
        let mut fit = Fit { lag_corrected: (matters && is_auto) || choice.resample, ..fit.clone() };
        let freed = Fit { lag_corrected: true, ..fit.clone() };
        if fit.lag_corrected {
            posterior = freed.posterior(sums, structure)?;
        } else if is_auto && checks.iter().any(NoiseCheck::is_sure) {
            // A long recording knows its coefficients so well that small errors matter too.
            let without = freed.posterior(sums, structure).ok();
            if let Some(without) = without.filter(|without| is_moved(&posterior, without)) {
                (posterior, fit) = (without, freed);
            }
        }
        let mut departs = noise_form(&fit.diffusion, sums, structure, &posterior, FALSE_ALARM)?;
        if !departs.is_empty() && fit.prefactor {
            fit.whole_in_jacobian = true;
            posterior = fit.posterior(sums, structure)?;
            departs = noise_form(&fit.diffusion, sums, structure, &posterior, FALSE_ALARM)?;
        }
        if posterior.drift() != &first {
            // Errors of the measurement bias the coefficients that leave them in the noise, and residuals of those show too few of them.
            checks = checked(sums, structure, &posterior, given)?;
        }
        Ok(Self { posterior, checks, departs, fit })
    }
}

/// What residuals of a posterior show at lag one, where there are neighbouring steps; with the sampling errors of noise that is not
/// constant where pairs of steps say that it is not.
fn checked(
    sums: &Sums,
    structure: &Structure,
    posterior: &Posterior,
    given: Given<'_>,
) -> Result<Vec<NoiseCheck>, InferenceError> {
    if sums.n_pair() == 0 {
        return Ok(Vec::new());
    }
    let checks = noise_checks(sums, structure, posterior)?;
    match given {
        Given::Recording(basis, pairs)
            if checks.iter().any(|check| check.is_sure() || check.verdict == Verdict::Matters) =>
        {
            if_any(checks, basis, pairs, posterior, sums.step())
        }
        _ => Ok(checks),
    }
}

/// Part of its standard deviation by which a coefficient is moved by small errors of the measurement where they count.
const MOVED: f64 = 0.5;

/// Whether a coefficient moves by much of its standard deviation from one posterior to the other.
fn is_moved(from: &Posterior, to: &Posterior) -> bool {
    let values = from.estimates.iter().zip(&to.estimates).filter_map(|(a, b)| a.value.zip(b.value));
    values.into_iter().any(|(a, b)| (a.mean - b.mean).abs() > MOVED * a.sd)
}

/// Checks of residuals at lag one, whose sampling error is larger where the noise is not constant.
fn if_any(
    checks: Vec<NoiseCheck>,
    basis: &Basis,
    pairs: &Pairs,
    posterior: &Posterior,
    step: f64,
) -> Result<Vec<NoiseCheck>, InferenceError> {
    if varying(pairs, basis, posterior.drift(), step, FALSE_ALARM)?.is_empty() {
        return Ok(checks);
    }
    let spread = lag_spread(pairs, basis, posterior.drift(), step)?;
    Ok(checks.into_iter().zip(spread).map(|(check, spread)| check.widened(spread)).collect())
}

/// Whether there are more steps than unknowns in every equation; fewer look like terms that cannot be told apart.
fn enough(sums: &Sums, structure: &Structure) -> Result<(), InferenceError> {
    for (l, equation) in structure.equations().iter().enumerate() {
        let enters = |c: &&Coefficient| c.places.iter().any(|place| place.equation == l);
        let n_unknown = structure.coefficients().iter().filter(enters).count();
        if sums.n_step() <= n_unknown as u64 {
            let equation = equation.clone();
            return Err(InferenceError::TooFew { n_step: sums.n_step(), n_unknown, equation });
        }
    }
    Ok(())
}
