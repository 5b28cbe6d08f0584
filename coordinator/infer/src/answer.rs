//! From sums to the tables: the fit, what the residuals say of the measurement, the extrapolation, the reduced model.
//!
//! Next file to read: `words.rs`.

use nalgebra::{DMatrix, DVector};
use starlings_estimators::inference::{
    Basis, Diffusion, Estimate, Extrapolated, Fit, InferenceError, NoiseCheck, NoiseForm, Posterior, Prior,
    Strength, Structure, Sums, Verdict, extrapolate, noise_checks,
};
use starlings_study::infer_choice::{DiffusionChoice, InferChoice, MeasuredChoice};

use crate::blocks::Cut;
use crate::error::InferError;
use crate::fitted::{Fitted, Given};
use crate::gather::Gathered;
use crate::hidden;
use crate::progress::Teller;
use crate::result::{CoefficientFound, DiffusionFound, LEVEL, RichardsonFound};
use crate::run::Asked;
use crate::smoothed::{not_converged, smoothed};

/// The fit that a study asks for.
pub(crate) fn fit(choice: &InferChoice, structure: &Structure) -> Result<Fit, InferError> {
    let form = match choice.diffusion {
        DiffusionChoice::Full => Diffusion::Full,
        DiffusionChoice::Diagonal => Diffusion::Diagonal,
        DiffusionChoice::Isotropic => Diffusion::Isotropic,
    };
    let names = || structure.coefficients().iter().map(|c| c.name.as_str());
    let prior = |name: &str| choice.priors.iter().find(|(known, _, _)| known == name);
    let mean: Vec<f64> = names().map(|name| prior(name).map_or(0.0, |(_, mean, _)| *mean)).collect();
    let sd: Vec<f64> = names().map(|name| prior(name).map_or(f64::INFINITY, |(_, _, sd)| *sd)).collect();
    let fit = Fit::new(form, structure.n_coefficient());
    Ok(Fit { prefactor: choice.prefactor, prior: Prior::independent(&mean, &sd)?, ..fit })
}

/// How many times as many steps as were sampled are many more.
const MANY: u64 = 4;

/// A matrix row by row.
fn rows(matrix: &DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

/// A row of the table of coefficients; `moved` is the estimate at no step, where it was extrapolated to that.
pub(crate) fn coefficient(
    choice: &InferChoice,
    posterior: &Posterior,
    p: usize,
    moved: Option<f64>,
) -> CoefficientFound {
    let found = &posterior.estimates[p];
    let at_step = found.value.map(|value| value.mean);
    let shift = moved.zip(at_step).map_or(0.0, |(moved, at_step)| moved - at_step);
    let interval = posterior.interval(p, LEVEL).map(|ends| ends.map(|end| end + shift));
    let prior = choice.priors.iter().find(|(name, _, _)| *name == found.name);
    CoefficientFound {
        name: found.name.clone(),
        observed: found.observed,
        estimate: moved.or(at_step),
        sd: found.value.map(|value| value.sd),
        interval90: interval,
        may_be_zero: interval.map(|[lo, hi]| lo <= 0.0 && hi >= 0.0),
        at_step: moved.and(at_step),
        prior: prior.map(|(_, mean, sd)| [*mean, *sd]),
    }
}

/// What the sums of all blocks say.
pub(crate) struct Answer {
    pub(crate) posterior: Posterior,
    pub(crate) checks: Vec<NoiseCheck>,
    /// How it was made.
    pub(crate) fit: Fit,
    /// In what the noise has not the form that the study holds it to have.
    pub(crate) departs: Vec<NoiseForm>,
    pub(crate) extrapolated: Option<Extrapolated>,
    /// What went less well than was asked for.
    pub(crate) doubts: Vec<String>,
    /// What the posterior was before, where its intervals hold for noise of any size.
    constant: Option<Constant>,
}

/// What noise of one size gives.
struct Constant {
    estimates: Vec<Estimate>,
    /// Steps that the intervals of any noise were told from, where the recordings have many more.
    sampled: Option<u64>,
}

impl Answer {
    /// The posterior from what recordings add up to.
    pub(crate) fn of(
        choice: &InferChoice,
        fit: &Fit,
        structure: &Structure,
        (basis, gathered): (&Basis, &Gathered),
    ) -> Result<Self, InferError> {
        let Gathered { levels, pairs, .. } = gathered;
        let Some(sums) = levels.first() else {
            return Err(InferError::Setting("no block of any recording was summed".to_owned()));
        };
        let fitted = Fitted::of(choice, fit, structure, sums, Given::Recording(basis, pairs));
        let Fitted { posterior, checks, departs, fit } =
            fitted.map_err(|error| hidden::told(error, sums, structure))?;
        let (extrapolated, doubts) = match to_no_step(&fit, structure, &posterior, &levels[1..]) {
            Ok(extrapolated) => (extrapolated, Vec::new()),
            Err(doubt) => (None, vec![doubt]),
        };
        Ok(Self { posterior, checks, fit, departs, extrapolated, doubts, constant: None })
    }

    /// The posterior from a smoothed path, where the standard deviation of the measurement is known. The recording as it was measured
    /// need not have a fit by itself.
    pub(crate) fn smoothed(
        asked: &Asked<'_>,
        cut: Cut,
        sd: f64,
        levels: &[Sums],
        teller: &mut Teller<'_>,
    ) -> Result<Self, InferError> {
        let Asked { choice, question, fit, .. } = asked;
        let mut checks = match levels
            .first()
            .map(|sums| Fitted::of(choice, fit, &question.structure, sums, Given::Earlier(None)))
        {
            Some(Ok(raw)) => raw.checks,
            None
            | Some(Err(InferenceError::DiffusionNotDefinite { .. } | InferenceError::NotSettled { .. })) => {
                Vec::new()
            }
            Some(Err(error)) => return Err(error.into()),
        };
        let found = smoothed(question, fit, &choice.records, cut, sd, teller)
            .map_err(|error| hidden::lost(error, sd, levels.first(), &question.structure))?;
        let doubts = not_converged(found.converged, found.log_likelihood.len()).into_iter().collect();
        let posterior = found.posterior;
        if let Some(sums) = levels.first().filter(|_| !checks.is_empty()) {
            // Coefficients of the recording as it was measured are biased by the errors, and residuals of those show too few of them.
            checks = noise_checks(sums, &question.structure, &posterior)?;
        }
        let fit = fit.clone();
        Ok(Self { posterior, checks, fit, departs: Vec::new(), extrapolated: None, doubts, constant: None })
    }

    /// Whether errors of the measurement matter, or were taken out.
    pub(crate) fn has_errors(&self) -> bool {
        self.fit.lag_corrected || self.checks.iter().any(|check| check.verdict == Verdict::Matters)
    }

    /// Takes a posterior that holds for noise of any size, told from so many of all steps.
    pub(crate) fn take_robust(&mut self, robust: Posterior, (sampled, all): (u64, u64)) {
        let estimates = std::mem::replace(&mut self.posterior, robust).estimates;
        self.constant = Some(Constant { estimates, sampled: (sampled < all / MANY).then_some(sampled) });
    }

    /// Steps that intervals of any noise were told from, where the recordings have many more.
    pub(crate) fn sampled(&self) -> Option<u64> {
        self.constant.as_ref()?.sampled
    }

    /// How many times as wide as of constant noise the interval of a coefficient is; 1 where it is that.
    pub(crate) fn widening(&self, name: &str) -> f64 {
        let sd = |estimates: &[Estimate]| estimates.iter().find(|e| e.name == name)?.value.map(|v| v.sd);
        let constant = self.constant.as_ref().and_then(|constant| sd(&constant.estimates));
        constant.zip(sd(&self.posterior.estimates)).map_or(1.0, |(constant, sd)| sd / constant)
    }

    /// The least and the most of that over the coefficients; `None` where the intervals are those of constant noise.
    pub(crate) fn widened(&self) -> Option<[f64; 2]> {
        let estimates = self.constant.as_ref()?.estimates.iter().filter(|estimate| estimate.value.is_some());
        let all: Vec<f64> = estimates.map(|estimate| self.widening(&estimate.name)).collect();
        let most = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Some([all.iter().copied().fold(f64::INFINITY, f64::min), most])
    }

    /// Means of the coefficients that have a value, at no step where they were extrapolated.
    pub(crate) fn means(&self) -> DVector<f64> {
        let mean = |(k, p): (usize, &usize)| {
            let moved = self.extrapolated.as_ref().and_then(|e| e.estimates.get(*p)?.value);
            moved.map_or(self.posterior.mean()[k], |value| value.mean)
        };
        let active = self.posterior.active();
        DVector::from_iterator(active.len(), active.iter().enumerate().map(mean))
    }

    /// The table of the coefficients.
    pub(crate) fn coefficients(&self, choice: &InferChoice) -> Vec<CoefficientFound> {
        let all = 0..self.posterior.estimates.len();
        all.map(|p| {
            let moved = self.extrapolated.as_ref().and_then(|e| e.estimates.get(p)?.value).map(|v| v.mean);
            coefficient(choice, &self.posterior, p, moved)
        })
        .collect()
    }

    /// Covariance of the coefficients that have a value.
    pub(crate) fn covariance(&self) -> Vec<Vec<f64>> {
        rows(self.posterior.covariance())
    }

    /// The table of the noise.
    pub(crate) fn diffusion(&self, choice: &InferChoice) -> DiffusionFound {
        let n = self.posterior.diffusion.nrows();
        let form = match choice.diffusion {
            DiffusionChoice::Full => "full",
            DiffusionChoice::Diagonal => "diagonal",
            DiffusionChoice::Isotropic => "isotropic",
        };
        DiffusionFound {
            form: form.to_owned(),
            matrix: rows(&self.posterior.diffusion),
            // What the form holds at zero is known to be.
            sd: rows(
                &self
                    .posterior
                    .diffusion_sd()
                    .zip_map(&self.posterior.diffusion, |sd, d| if d.abs() > 0.0 { sd } else { 0.0 }),
            ),
            interval90: (0..n).map(|l| self.posterior.diffusion_interval(l, LEVEL)).collect(),
            degrees: self.posterior.least_degrees(),
            lag_corrected: self.fit.lag_corrected,
            measured_sd: if let MeasuredChoice::Known(sd) = choice.measured { Some(sd) } else { None },
        }
    }

    /// The order of the extrapolation.
    pub(crate) fn richardson(&self) -> Option<RichardsonFound> {
        let found = self.extrapolated.as_ref()?;
        let order = if found.used == Strength::Weak { 2 } else { 1 };
        Some(RichardsonFound { order, ratio: found.ratio })
    }
}

/// The extrapolation from sums at 2h and 4h, `None` without them; why there is none where they cannot be fitted.
fn to_no_step(
    fit: &Fit,
    structure: &Structure,
    posterior: &Posterior,
    longer: &[Sums],
) -> Result<Option<Extrapolated>, String> {
    if longer.is_empty() {
        return Ok(None);
    }
    let missing = |of: &str, error: &InferenceError| {
        format!("the error of the sampling step is not taken out, as `richardson` asks: {of}{error}")
    };
    let mut all = vec![posterior.clone()];
    for (k, sums) in longer.iter().enumerate() {
        let found = fit.posterior(sums, structure);
        all.push(found.map_err(|error| missing(&format!("at steps of {}h ", 2 << k), &error))?);
    }
    extrapolate(&all, None).map(Some).map_err(|error| missing("between steps of h, 2h and 4h ", &error))
}
