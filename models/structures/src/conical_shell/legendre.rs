//! Legendre polynomials with two derivatives, and Gauss's rule, on −1 to 1.
//!
//! Next file to read: [`super::ritz`], which alone uses them.

use std::f64::consts::PI;

/// Newton's steps from a root's first guess; four are enough to rounding.
const NEWTON: usize = 8;

/// P_0 to P_(n−1) at x, each with its first and second derivative (Abramowitz & Stegun 1964, 8.5.3 and its derivatives).
pub(super) fn legendre(n: usize, x: f64) -> Vec<[f64; 3]> {
    let mut p: Vec<[f64; 3]> = Vec::with_capacity(n);
    for i in 0..n {
        let next = match i {
            0 => [1.0, 0.0, 0.0],
            1 => [x, 1.0, 0.0],
            _ => {
                let k = i as f64;
                let ([a, da, dda], [b, db, ddb]) = (p[i - 1], p[i - 2]);
                let (up, down) = ((2.0 * k - 1.0) / k, (k - 1.0) / k);
                [up * x * a - down * b, up * (a + x * da) - down * db, up * (2.0 * da + x * dda) - down * ddb]
            }
        };
        p.push(next);
    }
    p
}

/// Nodes and weights of Gauss's rule with n points, by Newton's method on P_n (Davis & Rabinowitz 1984, §2.7).
pub(super) fn gauss(n: usize) -> Vec<[f64; 2]> {
    let point = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..NEWTON {
            let [value, derivative, _] = legendre(n + 1, x)[n];
            slope = derivative;
            x -= value / derivative;
        }
        [x, 2.0 / ((1.0 - x * x) * slope * slope)]
    };
    (0..n).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_integrates_the_highest_power_that_it_must() {
        for (n, power) in [(1, 0), (5, 8), (90, 178)] {
            let found: f64 = gauss(n).iter().map(|[x, w]| w * x.powi(power)).sum();
            // Rounding of up to ninety weights.
            assert!((found - 2.0 / (f64::from(power) + 1.0)).abs() < 1e-13, "{n}: {found}");
        }
    }

    #[test]
    fn derivatives_are_those_of_the_fifth_polynomial() {
        let x = 0.37_f64;
        let [p, d, dd] = legendre(6, x)[5];
        // (63x⁵ − 70x³ + 15x)/8.
        assert!((p - (63.0 * x.powi(5) - 70.0 * x.powi(3) + 15.0 * x) / 8.0).abs() < 1e-15);
        assert!((d - (315.0 * x.powi(4) - 210.0 * x * x + 15.0) / 8.0).abs() < 1e-14);
        assert!((dd - (1260.0 * x.powi(3) - 420.0 * x) / 8.0).abs() < 1e-14);
    }
}
