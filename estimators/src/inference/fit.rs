//! The posterior of the coefficients and of the noise, from sums: coefficients given the noise, noise given the coefficients,
//! until both settle.
//!
//! For functions that all equations share this is C = (Z − ½ D V) Φ⁻¹ with covariance D ⊗ (hΦ)⁻¹ (Smelyanskiy, Luchinsky et al.,
//! eqs. 1.11 and 1.25); the term V is what the Jacobian of the map from noise to the next state leaves at the mid-point.
//! The noise is D = (h/N) (Σ rrᵀ + Σ F cov Fᵀ): the second sum takes away the bias of the mode, and is h/(N − B) Σ rrᵀ where all
//! equations share their functions (restricted likelihood, Patterson & Thompson, Biometrika 1971, by expectation and
//! maximisation). Read next: `normal.rs`, the equations of a pass, and `diffusion.rs`, the forms of the noise.

use nalgebra::{DMatrix, DVector};

use super::diffusion::{self, Diffusion};
use super::normal::{Moments, invert, invert_shared};
use super::pass_noise::Noise;
use super::residual_products::ResidualProducts;
use super::{InferenceError, Posterior, Prior, Structure, Sums, lagged};

/// Change of D, relative to itself, below which it has settled.
const SETTLED: f64 = 1e-11;
/// Passes at most. An error of D falls by the share of unknowns among the steps in each.
const PASSES: usize = 1000;
/// Growth of a variance beyond all of the movement, from which it runs away. Its share of the coefficients, ½ D V Φ⁻¹, then adds
/// more to the residuals than it explains: the Jacobian is of first order in h div f, and coefficients are so uncertain that this
/// is not small. More steps, fewer terms, a prior or the left point help.
const RUNAWAY: f64 = 10.0;

/// By how much D is moved, relative to itself, for the slope of the coefficients: rounding and curvature count as little.
const SLOPE: f64 = 1e-5;

/// How an inference is made.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Fit {
    /// The form of the noise.
    pub diffusion: Diffusion,
    /// Whether the Jacobian's term V counts. Without it the coefficients have a bias of ½ D V Φ⁻¹ that no amount of data removes;
    /// `false` is there to show that.
    pub prefactor: bool,
    /// D from residuals at lag zero and one, which measurement noise leaves right (`noise_check.rs` says when it matters).
    pub lag_corrected: bool,
    /// Whether V counts with the covariance that the residuals have, be the form of the noise another one: ½ D V needs the D that there
    /// is, and a form that holds it for less leaves a bias in the coefficients (`noise_form.rs` says when it does).
    #[serde(default)]
    pub whole_in_jacobian: bool,
    /// What is known beforehand.
    pub prior: Prior,
    /// Information about a coefficient, in 1/coefficient², up to which it counts as not observed. Zero: a coefficient is observed as
    /// soon as one of its functions is not zero.
    pub least_information: f64,
}

/// One pass at a given noise.
pub(crate) struct Pass {
    pub(crate) active: Vec<usize>,
    pub(crate) observed: Vec<usize>,
    pub(crate) precision: DMatrix<f64>,
    pub(crate) covariance: DMatrix<f64>,
    pub(crate) mean: DVector<f64>,
}

impl Fit {
    /// A fit of P coefficients with a flat prior and the prefactor.
    pub fn new(diffusion: Diffusion, n_coefficient: usize) -> Self {
        Self {
            diffusion,
            prefactor: true,
            lag_corrected: false,
            whole_in_jacobian: false,
            prior: Prior::flat(n_coefficient),
            least_information: 0.0,
        }
    }

    /// The posterior.
    ///
    /// # Errors
    /// `Shape`, `TooFew` steps, `NothingObserved`, `Collinear` terms, `DiffusionNotDefinite`, `NotSettled`, `Overflow`.
    pub fn posterior(&self, sums: &Sums, structure: &Structure) -> Result<Posterior, InferenceError> {
        self.posterior_from(sums, structure, None)
    }

    /// The posterior, started from the noise of an earlier one: the same but for rounding, in fewer passes.
    ///
    /// # Errors
    /// As for [`Fit::posterior`].
    pub fn update(
        &self,
        sums: &Sums,
        structure: &Structure,
        earlier: &Posterior,
    ) -> Result<Posterior, InferenceError> {
        let n = sums.n_state();
        let fits = earlier.diffusion.shape() == (n, n) && !matches!(self.diffusion, Diffusion::Known(_));
        self.posterior_from(sums, structure, fits.then_some(&earlier.diffusion))
    }

    fn posterior_from(
        &self,
        sums: &Sums,
        structure: &Structure,
        start: Option<&DMatrix<f64>>,
    ) -> Result<Posterior, InferenceError> {
        structure.fits(sums.n_state(), sums.n_function())?;
        let (expected, got) = (structure.n_coefficient(), self.prior.n_coefficient());
        if expected != got {
            return Err(InferenceError::Shape { what: "coefficients of the prior", expected, got });
        }
        let moments = Moments::new(sums, structure);
        let first = self.diffusion.first(sums, structure)?;
        let mut noise = Noise::of(start.unwrap_or(&first).clone());
        for passes in 1..=PASSES {
            let pass = self.pass(&moments, &noise)?;
            let drift = structure.matrix(&pass.active, pass.mean.as_slice());
            if let Diffusion::Known(_) = self.diffusion {
                return self.finish(&moments, sums, pass, &noise, passes);
            }
            self.enough(sums, &moments, &pass.active)?;
            let products = pass.products(sums, structure, &drift).of_noise(self.lag_corrected);
            diffusion::noisy(sums, structure, &drift)?;
            let mut next = Noise::of(self.diffusion.estimate(sums, structure, &products)?);
            if self.whole_in_jacobian {
                next.shown = diffusion::mean(sums, &products);
            }
            let settled = noise.change(&next) < SETTLED;
            if (0..sums.n_state()).any(|l| next.held[(l, l)] > RUNAWAY * first[(l, l)]) {
                return Err(InferenceError::NotSettled { passes });
            }
            noise = next;
            if settled {
                return self.finish(&moments, sums, pass, &noise, passes);
            }
        }
        Err(InferenceError::NotSettled { passes: PASSES })
    }

    /// The coefficients for a noise.
    fn pass(&self, moments: &Moments<'_>, noise: &Noise) -> Result<Pass, InferenceError> {
        let inverse = &diffusion::inverse(&noise.held, moments.structure)?;
        let all = 0..moments.structure.n_coefficient();
        let informed = |p: &usize| moments.information(*p, inverse) > self.least_information;
        let observed: Vec<usize> = all.clone().filter(informed).collect();
        let known = |p: &usize| self.prior.precision[(*p, *p)] > 0.0;
        let active: Vec<usize> = all.filter(|p| observed.contains(p) || known(p)).collect();
        if active.is_empty() && moments.structure.n_coefficient() > 0 {
            return Err(InferenceError::NothingObserved);
        }
        let mut normal = moments.normal(&active, inverse, self.prefactor);
        if self.prefactor && self.whole_in_jacobian {
            normal.vector -= moments.beside(&active, &(inverse * &noise.shown));
        }
        let (prior_mean, prior_precision) = self.prior.select(&active);
        let precision = normal.precision + &prior_precision;
        let vector = normal.vector + prior_precision * prior_mean;
        let name = |i: usize| moments.structure.coefficients()[active[i]].name.clone();
        let flat = active.iter().all(|p| !known(p));
        let covariance = if flat && moments.structure.is_shared(&active) {
            invert_shared(&precision, inverse, name)?
        } else {
            invert(&precision, name)?
        };
        let mean = &covariance * vector;
        if !mean.iter().all(|v| v.is_finite()) {
            return Err(InferenceError::Overflow { what: "a coefficient" });
        }
        Ok(Pass { active, observed, precision, covariance, mean })
    }

    /// Whether there are more steps than unknowns in every equation.
    fn enough(&self, sums: &Sums, moments: &Moments<'_>, active: &[usize]) -> Result<(), InferenceError> {
        let n_step = sums.n_step();
        for (equation, n_unknown) in moments.structure.equations().iter().zip(moments.unknowns(active)) {
            if n_step <= n_unknown as u64 + u64::from(self.lag_corrected) {
                return Err(InferenceError::TooFew { n_step, n_unknown, equation: equation.clone() });
            }
        }
        Ok(())
    }

    fn finish(
        &self,
        moments: &Moments<'_>,
        sums: &Sums,
        pass: Pass,
        noise: &Noise,
        passes: usize,
    ) -> Result<Posterior, InferenceError> {
        let structure = moments.structure;
        let drift = structure.matrix(&pass.active, pass.mean.as_slice());
        let mut found = Posterior {
            estimates: Vec::new(),
            degrees: self.diffusion.degrees(sums, pass.active.len()),
            shares: self.shares(sums, structure, &pass, &drift),
            n_step: sums.n_step(),
            passes,
            diffusion: noise.held.clone(),
            drift,
            active: pass.active,
            mean: pass.mean,
            covariance: pass.covariance,
            precision: pass.precision,
        };
        self.widen(moments, noise, &mut found)?;
        if found.covariance.diagonal().iter().any(|v| !v.is_finite() || *v <= 0.0) {
            return Err(InferenceError::Overflow { what: "the variance of a coefficient" });
        }
        let Posterior { active, mean, covariance, .. } = &found;
        found.estimates = Posterior::estimates(structure, active, &pass.observed, mean, covariance);
        Ok(found)
    }

    /// The shares of the degrees of freedom that variances from lagged residuals have, length L; empty for other ones.
    fn shares(&self, sums: &Sums, structure: &Structure, pass: &Pass, drift: &DMatrix<f64>) -> Vec<f64> {
        if !self.lag_corrected || sums.n_pair() == 0 || matches!(self.diffusion, Diffusion::Known(_)) {
            return Vec::new();
        }
        let products = pass.products(sums, structure, drift);
        let (squares, lagged) = (products.squares(), products.lagged());
        let (n, pairs) = (sums.n_step() as f64, sums.n_pair() as f64);
        lagged::shares(&self.diffusion, (&squares, n), (&lagged, pairs))
    }

    /// Lets the coefficients be as uncertain as their share ½ D V Φ⁻¹ is, where D is from lagged residuals. From independent ones
    /// D is too well known for that to count.
    fn widen(
        &self,
        moments: &Moments<'_>,
        noise: &Noise,
        found: &mut Posterior,
    ) -> Result<(), InferenceError> {
        if found.shares.is_empty() {
            return Ok(());
        }
        let (sd, n) = (found.diffusion_sd(), found.diffusion.nrows());
        let whole = if self.whole_in_jacobian { &Diffusion::Full } else { &self.diffusion };
        let held = lagged::free(&self.diffusion, n);
        // Entries that the form holds err too where V counts with them.
        let beside = lagged::free(whole, n).into_iter().filter(|entries| entries[0].0 != entries[0].1);
        let all = held.iter().cloned().chain(beside.filter(|entries| !held.contains(entries)));
        for entries in all.collect::<Vec<_>>() {
            let (i, j) = entries[0];
            let scale = SLOPE * (found.diffusion[(i, i)] * found.diffusion[(j, j)]).sqrt();
            let pass = self.pass(moments, &noise.moved(&entries, scale, held.contains(&entries)))?;
            if pass.active == found.active {
                let slope = (pass.mean - &found.mean) / scale;
                lagged::widen(&mut found.covariance, &mut found.precision, &slope, sd[(i, j)]);
            }
        }
        Ok(())
    }
}

impl Pass {
    /// Products of the residuals that it leaves.
    fn products<'a>(
        &'a self,
        sums: &'a Sums,
        structure: &'a Structure,
        drift: &'a DMatrix<f64>,
    ) -> ResidualProducts<'a> {
        ResidualProducts { sums, structure, drift, active: &self.active, covariance: &self.covariance }
    }
}
