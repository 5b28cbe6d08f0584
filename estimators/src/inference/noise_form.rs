//! Whether the noise has the form that it is held to have: independent noise of every equation, or of one size.
//!
//! A form that holds less than there is leaves a bias in coefficients of the mid-point, whose ½ D V needs the D that there is, and intervals
//! that are those of another noise. Read next: `fit.rs`, which can let V count with all that residuals share.

use nalgebra::DMatrix;

use super::residual_products::ResidualProducts;
use super::{Diffusion, InferenceError, Posterior, Structure, Sums, diffusion, lagged};
use crate::quantiles::normal;

/// Degrees of freedom from which a variance is known well enough to be compared with another, or to give a correlation: its standard
/// deviation is half of it.
const KNOWN: f64 = 8.0;

/// How the noise of two equations departs from the form that it is held to have.
#[derive(Debug, Clone, PartialEq)]
pub enum NoiseForm {
    /// It is shared: the correlation.
    Shared([String; 2], f64),
    /// It is of two sizes where it is held to be of one: the variances per time unit.
    Unequal([String; 2], [f64; 2]),
}

/// Pairs of equations whose noise departs from the form of a fit, the furthest first; by chance in `by_chance` of all recordings where it
/// has that form.
///
/// # Errors
/// `Shape`.
pub fn noise_form(
    form: &Diffusion,
    sums: &Sums,
    structure: &Structure,
    posterior: &Posterior,
    by_chance: f64,
) -> Result<Vec<NoiseForm>, InferenceError> {
    structure.fits(sums.n_state(), sums.n_function())?;
    let n = sums.n_state();
    if matches!(form, Diffusion::Full | Diffusion::Known(_)) || n < 2 {
        return Ok(Vec::new());
    }
    let products = ResidualProducts::of(sums, structure, posterior);
    let is_lagged = !posterior.shares.is_empty();
    let shown = diffusion::mean(sums, &products.of_noise(is_lagged));
    let errors = is_lagged.then(|| errors(&products));
    let degrees = |l: usize| posterior.degrees_of(l).map(|degrees| degrees / form.n_shared(n));
    let names = |i: usize, j: usize| [i, j].map(|l| structure.equations()[l].clone());
    let n_test = n * (n - 1) / 2 * if matches!(form, Diffusion::Isotropic) { 2 } else { 1 };
    let limit = normal(1.0 - 0.5 * by_chance / n_test as f64);
    let mut found = Vec::new();
    for i in 0..n {
        for j in 0..i {
            let (Some(of_i), Some(of_j)) = (degrees(i), degrees(j)) else {
                continue;
            };
            let [d_i, d_j] = [shown[(i, i)], shown[(j, j)]];
            if d_i <= 0.0 || d_j <= 0.0 || is_lagged && of_i.min(of_j) < KNOWN {
                continue;
            }
            let correlation = (shown[(j, i)] / (d_i * d_j).sqrt()).clamp(-1.0, 1.0);
            let far = match &errors {
                Some(errors) => (shown[(j, i)] / errors[(j, i)]).abs(),
                // Fisher's z, whose variance does not depend on the correlation.
                None => correlation.atanh().abs() * (of_i * of_j).sqrt().sqrt(),
            };
            if far > limit {
                found.push((far, NoiseForm::Shared(names(j, i), correlation)));
            }
            let spread = (2.0 / of_i + 2.0 / of_j).sqrt();
            // The logarithm of a variance has a variance of 2 over its degrees of freedom; that of one which is known badly is no Gaussian.
            let apart = if is_lagged { 2.0 * (d_i - d_j) / (d_i + d_j) } else { (d_i / d_j).ln() };
            let apart = apart.abs() / spread;
            if matches!(form, Diffusion::Isotropic) && apart > limit {
                found.push((apart, NoiseForm::Unequal(names(j, i), [d_j, d_i])));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    Ok(found.into_iter().map(|(_, found)| found).collect())
}

/// Standard deviations, L x L, that the covariances of D from residuals at lag zero and one have where the equations share no noise. They
/// do not stand on the variances of D, of which errors of the measurement may leave nearly nothing.
fn errors(products: &ResidualProducts<'_>) -> DMatrix<f64> {
    let sums = products.sums;
    let (n, pairs) = (sums.n_step() as f64, sums.n_pair() as f64);
    let (zero, one) = (products.squares().diagonal() / n, products.lagged().diagonal() / pairs);
    DMatrix::from_fn(zero.len(), zero.len(), |i, j| {
        sums.step() * (lagged::spread([zero[i], zero[j]], [one[i], one[j]]) / n).max(0.0).sqrt()
    })
}
