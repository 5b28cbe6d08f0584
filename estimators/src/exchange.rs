//! Exchanges the prior under which a Gaussian posterior was computed.
//!
//! A second pass of a filter starts from a narrow prior around the first estimate, so that its particles stay where the
//! model is nearly linear. What it learned is then combined with the prior that was meant: in information form,
//! posterior - used + wanted. Deliberately Gaussian: no data is seen again. Read next: `gaussian.rs`.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::data::same;
use crate::{EstimatorError, Gaussian};

/// The posterior that the prior `wanted` would have given instead of `used`, and what to add to the log-likelihood (log
/// evidence) so that it too refers to `wanted`. Exact for a linear Gaussian problem without drift.
///
/// Works in coordinates whitened by `used` around the posterior mean, where the data's information is diagonal.
/// Directions in which the posterior is no sharper than `used` carry no information and return to `wanted`.
///
/// # Errors
/// `Shape`, and `NotPositiveDefinite` for a singular covariance.
pub fn exchange_prior(
    posterior: &Gaussian,
    used: &Gaussian,
    wanted: &Gaussian,
) -> Result<(Gaussian, f64), EstimatorError> {
    for (what, g) in [("used prior", used), ("wanted prior", wanted)] {
        same(what, posterior.n_param(), g.n_param())?;
    }
    let (l2, l) = (root(posterior, "posterior")?.unpack(), root(used, "used prior")?.unpack());
    let l0 = root(wanted, "wanted prior")?.unpack();
    let singular = EstimatorError::NotPositiveDefinite { what: "posterior" };
    // Information of the data in coordinates y, theta = m2 + L V y: diagonal, (L2^-1 L)^T (L2^-1 L) - 1.
    let ratio = l2.solve_lower_triangular(&l).ok_or_else(|| singular.clone())?;
    let svd = ratio.svd(false, true);
    let v = svd.v_t.ok_or_else(|| singular.clone())?.transpose();
    let information = svd.singular_values.map(|s| (s - 1.0) * (s + 1.0)).map(|e| e.max(0.0));
    let whiten =
        |x: &DMatrix<f64>| l.solve_lower_triangular(x).map(|y| v.tr_mul(&y)).ok_or_else(|| singular.clone());
    let column = |x: DVector<f64>| DMatrix::from_column_slice(x.len(), 1, x.as_slice());
    let at = |g: &Gaussian| whiten(&column(&g.mean - &posterior.mean)).map(|y| y.column(0).clone_owned());
    let (y_used, y_wanted) = (at(used)?, at(wanted)?);
    // The posterior mean is the origin: there the slope of the log-likelihood balances that of the used prior.
    let slope = y_used.zip_map(&information, |y, e| if e > 0.0 { -y } else { 0.0 });
    let p = slope.len();
    let likelihood = Likelihood { information, slope };
    let (_, _, before) = likelihood.update(&y_used, &DMatrix::identity(p, p))?;
    let (y, factor, after) = likelihood.update(&y_wanted, &whiten(&l0)?)?;
    let back = &l * v;
    let factor = &back * factor;
    let mean = &posterior.mean + back * y;
    Ok((Gaussian { mean, covariance: &factor * factor.transpose() }, after - before))
}

fn root(g: &Gaussian, what: &'static str) -> Result<Cholesky<f64, Dyn>, EstimatorError> {
    g.covariance.clone().cholesky().ok_or(EstimatorError::NotPositiveDefinite { what })
}

/// exp(slope . y - y . E y / 2), E diagonal.
struct Likelihood {
    information: DVector<f64>,
    slope: DVector<f64>,
}

impl Likelihood {
    /// Mean, a factor of the covariance, and log evidence under the prior N(m, F F^T).
    fn update(
        &self,
        m: &DVector<f64>,
        f: &DMatrix<f64>,
    ) -> Result<(DVector<f64>, DMatrix<f64>, f64), EstimatorError> {
        let p = m.len();
        let em = self.information.component_mul(m);
        let u = DMatrix::identity(p, p) + f.tr_mul(&(DMatrix::from_diagonal(&self.information) * f));
        let u = u.cholesky().ok_or(EstimatorError::NotPositiveDefinite { what: "exchanged posterior" })?;
        let b = f.tr_mul(&(&self.slope - &em));
        let step = u.solve(&b);
        let log_det = 2.0 * u.l_dirty().diagonal().iter().map(|v| v.ln()).sum::<f64>();
        let evidence = self.slope.dot(m) - 0.5 * em.dot(m) + 0.5 * (b.dot(&step) - log_det);
        let factor = u
            .l()
            .solve_lower_triangular(&f.transpose())
            .ok_or(EstimatorError::NotPositiveDefinite { what: "exchanged posterior" })?
            .transpose();
        Ok((m + f * step, factor, evidence))
    }
}
