//! Quantiles of the normal distribution, and of Student's t and χ² for any number of degrees of freedom.
//!
//! Every interval of this crate and of those above it takes them from here. Read next: `inference/posterior.rs`.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};

/// Half-width of a central 95 % interval of a Gaussian, in standard deviations: [`normal`] of 0.975.
pub const Z95: f64 = 1.959_963_984_540_054;

/// Degrees of freedom from which expansions about the normal distribution are exact to a millionth.
const MANY: f64 = 200.0;

/// Quantile of the standard normal distribution at a probability from 0 to 1: 1.645 at 0.95.
pub fn normal(p: f64) -> f64 {
    Normal::standard().inverse_cdf(p)
}

/// Quantile of Student's t; `None` is normal.
pub(crate) fn student(p: f64, degrees: Option<f64>) -> f64 {
    let z = normal(p);
    match degrees {
        None => z,
        Some(n) if n > MANY => {
            // Abramowitz & Stegun 26.7.5.
            let cubic = z.powi(3);
            let fifth = z.powi(5);
            z + (cubic + z) / (4.0 * n) + (5.0 * fifth + 16.0 * cubic + 3.0 * z) / (96.0 * n * n)
        }
        Some(n) => StudentsT::new(0.0, 1.0, n).map_or(z, |t| t.inverse_cdf(p)),
    }
}

/// Quantile of χ².
pub(crate) fn chi_squared(p: f64, degrees: f64) -> f64 {
    if degrees > MANY {
        // Wilson & Hilferty (1931).
        let part = 2.0 / (9.0 * degrees);
        return degrees * (1.0 - part + normal(p) * part.sqrt()).powi(3);
    }
    ChiSquared::new(degrees).map_or(degrees, |chi| chi.inverse_cdf(p))
}

/// The 95 % interval of a rate that was seen in n trials (Wilson, Journal of the American Statistical Association 1927, 22, 209); the whole
/// range from 0 to 1 without any.
pub fn wilson(rate: f64, n: f64) -> [f64; 2] {
    if n <= 0.0 {
        return [0.0, 1.0];
    }
    let z2 = Z95 * Z95;
    let (centre, half) = (rate + z2 / (2.0 * n), Z95 * ((rate * (1.0 - rate) + z2 / (4.0 * n)) / n).sqrt());
    [centre - half, centre + half].map(|end| (end / (1.0 + z2 / n)).clamp(0.0, 1.0))
}

/// Probability that χ² is larger.
pub fn chi_squared_tail(value: f64, degrees: f64) -> f64 {
    ChiSquared::new(degrees).map_or(1.0, |chi| chi.sf(value.max(0.0)))
}

/// The square of Student's t with so many degrees of freedom that is as improbable as this χ² of one: what a fall of χ² must be where the
/// variance is known from the residuals alone. Infinite without any.
pub fn squared_t_as_improbable(chi2: f64, degrees: f64) -> f64 {
    if degrees < 1.0 {
        return f64::INFINITY;
    }
    student(0.5 * chi_squared_tail(chi2, 1.0), Some(degrees)).powi(2)
}

/// Probability that F is larger.
pub(crate) fn fisher_tail(value: f64, degrees: f64, left: f64) -> f64 {
    if left > 1e5 {
        return chi_squared_tail(value * degrees, degrees);
    }
    FisherSnedecor::new(degrees, left).map_or(1.0, |f| f.sf(value.max(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_squared_t_is_as_improbable_as_its_chi_squared() {
        // Fisher and Yates: t of 0.05 is 2.228 with 10 degrees of freedom, 1.960 with infinitely many.
        assert!((squared_t_as_improbable(Z95.powi(2), 10.0).sqrt() - 2.228).abs() < 5e-4);
        let large = squared_t_as_improbable(12.0, 1e7);
        // The first term of the expansion is below 1e-6.
        assert!((large - 12.0).abs() < 1e-5 && squared_t_as_improbable(12.0, 0.0).is_infinite(), "{large}");
    }

    #[test]
    fn the_interval_of_a_rate_is_that_of_the_tables_and_whole_without_a_trial() {
        // Newcombe, Statistics in Medicine 1998, 17, 857: 81 of 263 and 0 of 20, method 3.
        for ((seen, n), wanted) in [((81.0, 263.0), [0.2553, 0.3662]), ((0.0, 20.0), [0.0, 0.1611])] {
            let found = wilson(seen / n, n);
            assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 5e-5), "{found:?}");
        }
        assert_eq!(wilson(f64::NAN, 0.0).map(f64::to_bits), [0.0_f64, 1.0].map(f64::to_bits));
    }

    #[test]
    fn the_normal_quantile_is_that_of_the_tables() {
        // Abramowitz & Stegun, table 26.5, and its last digits by Wichura's AS 241.
        for (p, z) in [(0.5, 0.0), (0.95, 1.644_853_626_951_472_7), (0.975, 1.959_963_984_540_054)] {
            assert!((normal(p) - z).abs() < 1e-14, "{p}: {}", normal(p));
        }
    }

    #[test]
    fn expansions_and_distributions_meet() {
        for p in [0.001, 0.05, 0.5, 0.9, 0.995] {
            let (below, above) = (student(p, Some(MANY)), student(p, Some(MANY + 1e-6)));
            // The expansion's next term at 200 degrees of freedom.
            assert!((below - above).abs() < 1e-5, "{p}: {below} {above}");
            let (below, above) = (chi_squared(p, MANY), chi_squared(p, MANY + 1e-6));
            // Wilson and Hilferty state errors of a few hundredths of a per cent here.
            assert!((below / above - 1.0).abs() < 5e-4, "{p}: {below} {above}");
        }
    }
}
