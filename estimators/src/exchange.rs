//! Exchanges the prior under which a Gaussian posterior was computed.
//!
//! A second pass of a filter starts from a narrow prior around the first estimate, so that its particles stay where the
//! model is nearly linear. Its result is then combined with the prior that was meant: in information form, posterior - used +
//! wanted. It works on Gaussians only: the data are not used again. Read next: `gaussian.rs`.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::data::same;
use crate::{EstimatorError, Gaussian, spectral};

/// Information of a direction, in units of that of the used prior, up to which it counts as none; from there to ten times as
/// much its weight rises linearly from 0 to 1.
///
/// Rounding of a covariance that went through thousands of analyses stays below 1e-11. A direction of which the data
/// know a hundredth of what the wanted prior does still has 1e-8 under a used prior of a thousandth of its sd.
const NO_INFORMATION: f64 = 1e-9;

/// A posterior under another prior, and what that does to the figures of the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Exchanged {
    /// The posterior that the wanted prior would have given.
    pub posterior: Gaussian,
    /// To be added to the log-likelihood (log evidence).
    pub log_likelihood: f64,
    /// To be added to the summed normalised innovation squared: see [`Exchanged::corrected_nis`].
    pub nis: f64,
}

impl Exchanged {
    /// The summed normalised innovation squared `nis` of the used prior, corrected to the wanted one.
    ///
    /// It is a sum of squares. Where the used prior was so narrow that nearly all of `nis` came from it, the difference
    /// of two large numbers may round to less than nothing; then it is zero.
    pub fn corrected_nis(&self, nis: f64) -> f64 {
        (nis + self.nis).max(0.0)
    }
}

/// The posterior that the prior `wanted` would have given instead of `used`, with the corrections of log-likelihood and NIS
/// that make them refer to `wanted` too. Exact for a linear Gaussian problem without drift.
///
/// Works in coordinates whitened by `used` around the posterior mean, where the data's information is diagonal.
/// Directions in which the posterior is no sharper than `used`, up to rounding, carry no information and return to
/// `wanted`, wherever their mean went: a slope of the likelihood without curvature would move it without bound.
///
/// # Errors
/// `Shape`, `NotPositiveDefinite` for a singular covariance, `NotFinite` and `NotDecomposed` when the scales of the two differ
/// too much.
pub fn exchange_prior(
    posterior: &Gaussian,
    used: &Gaussian,
    wanted: &Gaussian,
) -> Result<Exchanged, EstimatorError> {
    for (what, g) in [("used prior", used), ("wanted prior", wanted)] {
        same(what, posterior.n_param(), g.n_param())?;
    }
    let (l2, l) = (root(posterior, "posterior")?.unpack(), root(used, "used prior")?.unpack());
    let l0 = root(wanted, "wanted prior")?.unpack();
    let singular = EstimatorError::NotPositiveDefinite { what: "posterior" };
    // Information of the data in coordinates y, theta = m2 + L V y: diagonal, (L2^-1 L)^T (L2^-1 L) - 1.
    let ratio = l2.solve_lower_triangular(&l).ok_or_else(|| singular.clone())?;
    let (_, singular_values, v_t) = spectral::svd(&ratio, "ratio of used prior to posterior")?;
    let v = v_t.transpose();
    // Singular values have the rounding of the largest.
    let none = NO_INFORMATION.max(100.0 * f64::EPSILON * singular_values.max());
    let sharpening = singular_values.map(|s| (s - 1.0) * (s + 1.0));
    let share = sharpening.map(|e| ((e - none) / (9.0 * none)).clamp(0.0, 1.0));
    let information = sharpening.component_mul(&share);
    let whiten =
        |x: &DMatrix<f64>| l.solve_lower_triangular(x).map(|y| v.tr_mul(&y)).ok_or_else(|| singular.clone());
    let column = |x: DVector<f64>| DMatrix::from_column_slice(x.len(), 1, x.as_slice());
    let at = |g: &Gaussian| whiten(&column(&g.mean - &posterior.mean)).map(|y| y.column(0).clone_owned());
    let (y_used, y_wanted) = (at(used)?, at(wanted)?);
    // The posterior mean is the origin: there the slope of the log-likelihood balances that of the used prior.
    let slope = -y_used.component_mul(&share);
    let p = slope.len();
    let likelihood = Likelihood { information: DMatrix::from_diagonal(&information), slope };
    let before = likelihood.update(&y_used, &DMatrix::identity(p, p))?;
    let after = likelihood.update(&y_wanted, &whiten(&l0)?)?;
    let back = &l * v;
    let factor = &back * after.factor;
    let mean = &posterior.mean + back * after.mean;
    Ok(Exchanged {
        posterior: Gaussian { mean, covariance: &factor * factor.transpose() },
        log_likelihood: after.fit - before.fit - 0.5 * (after.log_det - before.log_det),
        nis: 2.0 * (before.fit - after.fit),
    })
}

pub(crate) fn root(g: &Gaussian, what: &'static str) -> Result<Cholesky<f64, Dyn>, EstimatorError> {
    g.covariance.clone().cholesky().ok_or(EstimatorError::NotPositiveDefinite { what })
}

/// exp(slope . y - y . E y / 2).
pub(crate) struct Likelihood {
    /// E, p x p, symmetric.
    pub(crate) information: DMatrix<f64>,
    /// Length p.
    pub(crate) slope: DVector<f64>,
}

/// The posterior under one prior, and the two parts of its log evidence, fit − log_det / 2.
pub(crate) struct Update {
    /// Length p.
    pub(crate) mean: DVector<f64>,
    /// F, p x p, whose F F^T is the covariance.
    pub(crate) factor: DMatrix<f64>,
    /// Of the exponent at the mean.
    pub(crate) fit: f64,
    /// Of prior over posterior covariance.
    pub(crate) log_det: f64,
}

impl Likelihood {
    /// Under the prior N(m, F F^T).
    pub(crate) fn update(&self, m: &DVector<f64>, f: &DMatrix<f64>) -> Result<Update, EstimatorError> {
        let p = m.len();
        let em = &self.information * m;
        let u = DMatrix::identity(p, p) + f.tr_mul(&(&self.information * f));
        let u = u.cholesky().ok_or(EstimatorError::NotPositiveDefinite { what: "exchanged posterior" })?;
        let b = f.tr_mul(&(&self.slope - &em));
        let step = u.solve(&b);
        let log_det = 2.0 * u.l_dirty().diagonal().iter().map(|v| v.ln()).sum::<f64>();
        let fit = self.slope.dot(m) - 0.5 * em.dot(m) + 0.5 * b.dot(&step);
        let factor = u
            .l()
            .solve_lower_triangular(&f.transpose())
            .ok_or(EstimatorError::NotPositiveDefinite { what: "exchanged posterior" })?
            .transpose();
        Ok(Update { mean: m + f * step, factor, fit, log_det })
    }
}
