//! Which of several scenarios a recording followed, and how severe it was.
//!
//! A scenario is a course, the recording an unknown multiple of one of them with white noise. With a Gaussian prior on that amplitude
//! its posterior and the evidence of every scenario are closed forms (Bishop 2006, §3.5). A recording that follows none of them has a
//! large misfit with all: the probabilities are among the library alone. Read next: `unknown_input.rs`, whose response to a course
//! is what the outputs then show.

use nalgebra::DMatrix;

use crate::EstimatorError;
use crate::quantiles::normal;

/// What is known of an amplitude beforehand: a Gaussian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplitudePrior {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
}

/// What a recording says of one scenario.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, Copy, PartialEq)]
pub struct Scenario {
    /// Probability among the scenarios of the library, all equally likely beforehand.
    pub probability: f64,
    /// Posterior mean of the amplitude if it was this one.
    pub amplitude: f64,
    /// Its standard deviation at the stated noise.
    pub sd: f64,
    /// Normalised correlation of recording and course, −1 to 1.
    pub correlation: f64,
    /// Mean square of what is left, in units of the noise variance: about one when the scenario explains the recording.
    pub misfit: f64,
    /// Log of the marginal likelihood, amplitude integrated out.
    pub log_evidence: f64,
}

impl Scenario {
    /// The interval that holds the amplitude with 90 %, at the stated noise.
    pub fn interval90(&self) -> [f64; 2] {
        let half = normal(0.95) * self.sd;
        [self.amplitude - half, self.amplitude + half]
    }
}

/// Sums over the samples where something was observed.
struct Products {
    n: f64,
    data: f64,
    course: f64,
    both: f64,
}

impl Products {
    fn new(observed: &[f64], course: &[f64]) -> Self {
        let mut sums = Self { n: 0.0, data: 0.0, course: 0.0, both: 0.0 };
        for (y, s) in observed.iter().zip(course).filter(|(y, _)| !y.is_nan()) {
            sums.n += 1.0;
            sums.data += y * y;
            sums.course += s * s;
            sums.both += y * s;
        }
        sums
    }
}

/// What a recording says of each scenario of a library, in its order.
///
/// `observed` holds N samples (NaN where nothing was observed) with white noise of standard deviation `noise`; every course holds what
/// the recording would be at unit amplitude.
///
/// # Errors
/// When there is no scenario, lengths differ, a sample or a course is not finite, or noise or prior are not positive.
pub fn identify(
    observed: &[f64],
    noise: f64,
    courses: &[Vec<f64>],
    prior: AmplitudePrior,
) -> Result<Vec<Scenario>, EstimatorError> {
    check(observed, noise, courses, prior)?;
    let of = |course: &Vec<f64>| scenario(&Products::new(observed, course), noise, prior);
    let mut scenarios: Vec<Scenario> = courses.iter().map(of).collect();
    let evidence: Vec<f64> = scenarios.iter().map(|s| s.log_evidence).collect();
    let probabilities = probabilities(&evidence, &vec![1.0; evidence.len()]);
    for (scenario, probability) in scenarios.iter_mut().zip(probabilities) {
        scenario.probability = probability;
    }
    Ok(scenarios)
}

/// Probabilities of scenarios from the logs of their evidence and how likely each was beforehand, up to a factor; an evidence of −∞ has
/// none. All are zero where no evidence is finite.
pub fn probabilities(log_evidence: &[f64], beforehand: &[f64]) -> Vec<f64> {
    let most = log_evidence.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !most.is_finite() {
        return vec![0.0; log_evidence.len()];
    }
    let weights: Vec<f64> =
        log_evidence.iter().zip(beforehand).map(|(log, p)| p * (log - most).exp()).collect();
    let total: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / total).collect()
}

/// Log of the evidence of a scenario with several unknowns by Laplace's approximation, exact where the predictions are linear in them
/// (MacKay 2003, chapter 27).
///
/// `cost` is χ² plus prior at the likeliest point, `jacobian` (m x p) the derivative of the predictions over the noise by unknowns whose
/// prior is a standard normal, `noise` the m standard deviations. `None` where the Jacobian is not finite.
pub fn laplace_evidence(cost: f64, jacobian: &DMatrix<f64>, noise: &[f64]) -> Option<f64> {
    let p = jacobian.ncols();
    let information = DMatrix::identity(p, p) + jacobian.tr_mul(jacobian);
    let log_root: f64 = information.cholesky()?.l_dirty().diagonal().iter().map(|v| v.ln()).sum();
    let log_noise: f64 = noise.iter().map(|sd| sd.ln()).sum();
    let evidence = -0.5 * (cost + noise.len() as f64 * std::f64::consts::TAU.ln()) - log_noise - log_root;
    evidence.is_finite().then_some(evidence)
}

/// y = a s + e with a ~ N(a₀, τ²), e ~ N(0, σ²): precision s·s/σ² + 1/τ², evidence by completing the square.
fn scenario(sums: &Products, noise: f64, prior: AmplitudePrior) -> Scenario {
    let (variance, width) = (noise * noise, prior.sd * prior.sd);
    let precision = sums.course / variance + 1.0 / width;
    let amplitude = (sums.both / variance + prior.mean / width) / precision;
    let left = sums.data - 2.0 * amplitude * sums.both + amplitude * amplitude * sums.course;
    let moved = (amplitude - prior.mean).powi(2) / width;
    let log_evidence = -0.5
        * (left / variance
            + moved
            + (precision * width).ln()
            + sums.n * (std::f64::consts::TAU * variance).ln());
    let scale = (sums.data * sums.course).sqrt();
    Scenario {
        probability: 0.0,
        amplitude,
        sd: precision.sqrt().recip(),
        correlation: if scale > 0.0 { sums.both / scale } else { 0.0 },
        misfit: left / (variance * sums.n),
        log_evidence,
    }
}

fn check(
    observed: &[f64],
    noise: f64,
    courses: &[Vec<f64>],
    prior: AmplitudePrior,
) -> Result<(), EstimatorError> {
    if courses.is_empty() {
        return Err(EstimatorError::Shape { what: "scenarios, one at least", expected: 1, got: 0 });
    }
    if let Some(row) = observed.iter().position(|v| v.is_infinite()) {
        return Err(EstimatorError::NonFiniteObservation { row, value: observed[row] });
    }
    if observed.iter().all(|v| v.is_nan()) {
        return Err(EstimatorError::Shape { what: "observed samples, one at least", expected: 1, got: 0 });
    }
    if !(noise.is_finite() && noise > 0.0) {
        return Err(EstimatorError::NoiseNotPositive { row: 0, value: noise });
    }
    if !(prior.mean.is_finite() && prior.sd.is_finite() && prior.sd > 0.0) {
        return Err(EstimatorError::Spread { value: prior.sd });
    }
    for course in courses {
        if course.len() != observed.len() {
            let what = "samples of a scenario";
            return Err(EstimatorError::Shape { what, expected: observed.len(), got: course.len() });
        }
        if !course.iter().all(|v| v.is_finite()) {
            return Err(EstimatorError::NotFinite { what: "a sample of a scenario" });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRIOR: AmplitudePrior = AmplitudePrior { mean: 1.0, sd: 0.5 };

    #[test]
    fn two_samples_have_the_posterior_and_evidence_of_the_bivariate_normal() {
        let (y, s, noise) = ([0.8, -0.3], vec![0.5, 0.4], 0.3);
        let found = identify(&y, noise, std::slice::from_ref(&s), PRIOR).expect("one scenario")[0];
        // y ~ N(s, C) with C = σ² + τ² s sᵀ, written out.
        let (a, b, c) = (0.09 + 0.25 * 0.25, 0.25 * 0.2, 0.09 + 0.25 * 0.16);
        let determinant = a * c - b * b;
        let (d, e) = (y[0] - s[0], y[1] - s[1]);
        let quadratic = (c * d * d - 2.0 * b * d * e + a * e * e) / determinant;
        let expected = -0.5 * (quadratic + determinant.ln() + 2.0 * std::f64::consts::TAU.ln());
        // A dozen rounded operations.
        assert!((found.log_evidence - expected).abs() < 1e-13, "{} for {expected}", found.log_evidence);
        let precision = 0.41 / 0.09 + 4.0;
        assert!((found.amplitude - (0.28 / 0.09 + 4.0) / precision).abs() < 1e-14);
        assert!((found.sd - 1.0 / precision.sqrt()).abs() < 1e-15);
        assert!((found.probability - 1.0).abs() < 1e-15);
    }

    #[test]
    fn laplace_is_exact_for_a_multiple_of_a_course() {
        let (y, s, noise) = ([0.8, -0.3, 0.1], [0.5, 0.4, -0.2], 0.3);
        let found = identify(&y, noise, &[s.to_vec()], PRIOR).expect("one scenario")[0];
        // In prior standard deviations from the prior mean.
        let z = (found.amplitude - PRIOR.mean) / PRIOR.sd;
        let left = y.iter().zip(&s).map(|(y, s)| ((y - found.amplitude * s) / noise).powi(2)).sum::<f64>();
        let jacobian = DMatrix::from_fn(3, 1, |i, _| s[i] * PRIOR.sd / noise);
        let evidence = laplace_evidence(left + z * z, &jacobian, &[noise; 3]).expect("finite");
        // A dozen rounded operations.
        assert!((evidence - found.log_evidence).abs() < 1e-12, "{evidence} for {}", found.log_evidence);
        assert_eq!(laplace_evidence(1.0, &DMatrix::from_element(3, 1, f64::NAN), &[noise; 3]), None);
    }

    #[test]
    fn what_was_likelier_beforehand_counts_and_what_cannot_be_has_no_share() {
        let found = probabilities(&[-1e4, -1e4, f64::NEG_INFINITY], &[1.0, 3.0, 1.0]);
        assert!((found[0] - 0.25).abs() < 1e-15 && (found[1] - 0.75).abs() < 1e-15, "{found:?}");
        assert!(found[2] <= 0.0);
        assert!(probabilities(&[f64::NEG_INFINITY; 2], &[1.0; 2]).iter().all(|p| *p <= 0.0));
    }

    #[test]
    fn scenarios_alike_share_the_probability_and_missing_samples_say_nothing() {
        let one = vec![1.0, 2.0, -1.0, 0.5];
        let courses = [one.clone(), vec![1.0, 0.0, 1.0, 0.0], one.clone()];
        let observed = [1.1, f64::NAN, -0.9, 0.4];
        let found = identify(&observed, 0.1, &courses, PRIOR).expect("three scenarios");
        let without = identify(&[1.1, -0.9, 0.4], 0.1, &[vec![1.0, -1.0, 0.5]], PRIOR).expect("one scenario");
        assert!((found[0].probability - 0.5).abs() < 1e-12 && found[1].probability < 1e-12, "{found:?}");
        assert!((found[0].log_evidence - without[0].log_evidence).abs() < 1e-12);
        assert!(found[1].misfit > 10.0 && found[0].misfit < 3.0, "{found:?}");
    }

    #[test]
    fn input_that_says_nothing_is_refused() {
        let course = vec![vec![1.0, 2.0]];
        let refused = |observed: &[f64], noise, courses: &[Vec<f64>], prior| {
            identify(observed, noise, courses, prior).expect_err("refused")
        };
        let missing = [f64::NAN; 2];
        assert!(matches!(refused(&missing, 0.1, &course, PRIOR), EstimatorError::Shape { got: 0, .. }));
        assert!(matches!(refused(&[1.0; 2], 0.1, &[], PRIOR), EstimatorError::Shape { got: 0, .. }));
        assert!(matches!(refused(&[1.0; 3], 0.1, &course, PRIOR), EstimatorError::Shape { got: 2, .. }));
        let infinite = refused(&[1.0, f64::INFINITY], 0.1, &course, PRIOR);
        assert_eq!(infinite, EstimatorError::NonFiniteObservation { row: 1, value: f64::INFINITY });
        let noise = refused(&[1.0; 2], 0.0, &course, PRIOR);
        assert_eq!(noise, EstimatorError::NoiseNotPositive { row: 0, value: 0.0 });
        let prior = refused(&[1.0; 2], 0.1, &course, AmplitudePrior { mean: 1.0, sd: 0.0 });
        assert_eq!(prior, EstimatorError::Spread { value: 0.0 });
    }
}
