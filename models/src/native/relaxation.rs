//! The exact step of a first-order relaxation with a right-hand side linear in time.
//!
//! Not a model: the Windkessels are made of it. Next file to read: [`super::windkessel2`].

/// Below this |z| the series of φ₂ is used; above it the closed form loses at most a factor 2/|z| of the precision.
const SERIES_BELOW: f64 = 0.1;

/// φ₁(−z) = (1 − e^(−z))/z, with its limit 1 at zero.
fn phi1(z: f64) -> f64 {
    if z.abs() < f64::MIN_POSITIVE { 1.0 } else { -(-z).exp_m1() / z }
}

/// φ₂(−z) = (1 − φ₁(−z))/z, with its limit 1/2 at zero.
fn phi2(z: f64, phi1: f64) -> f64 {
    if z.abs() >= SERIES_BELOW {
        return (1.0 - phi1) / z;
    }
    // Σ (−z)^k/(k+2)!, nested; the first term left out is below 1e-18 of the sum.
    let mut sum = 1.0;
    for k in (3..=11).rev() {
        sum = 1.0 - z * sum / f64::from(k);
    }
    0.5 * sum
}

/// Advances dx/dt = −x/τ + a + b (t − t₀) from `x` over a time `h`, exactly.
///
/// `rate` is 1/τ and `start` the value of the right-hand side at t₀ including the −x/τ term; `slope` is b. The form
/// x + h φ₁ start + h² φ₂ slope (Hochbruck & Ostermann 2010, eq. 2.6) stays accurate for h/τ → 0.
pub fn step(x: f64, rate: f64, start: f64, slope: f64, h: f64) -> f64 {
    let z = h * rate;
    let phi1 = phi1(z);
    x + h * (phi1 * start + h * phi2(z, phi1) * slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x(h) of the closed form x = A e^(−h/τ) + B + D h, with B, D of the particular solution.
    fn closed_form(x: f64, tau: f64, a: f64, b: f64, h: f64) -> f64 {
        let (intercept, slope) = (tau * a - tau * tau * b, tau * b);
        (x - intercept) * (-h / tau).exp() + intercept + slope * h
    }

    #[test]
    fn the_step_is_the_closed_form_of_a_ramp() {
        for h in [0.01, 0.3, 2.0, 50.0] {
            let (x, tau, a, b) = (80.0, 1.7, 30.0, -12.0);
            let got = step(x, 1.0 / tau, a - x / tau, b, h);
            let want = closed_form(x, tau, a, b, h);
            // Rounding of the closed form, whose terms reach a few thousand at h = 50.
            assert!((got - want).abs() < 1e-12 * want.abs().max(100.0), "h = {h}: {got} against {want}");
        }
    }

    #[test]
    fn a_vanishing_rate_gives_plain_integration() {
        for rate in [0.0, 1e-300, 1e-18, 1e-12] {
            let got = step(2.0, rate, 3.0, 4.0, 0.5);
            // 2 + 3·0.5 + 4·0.5²/2; the rate moves it by less than 1e-12.
            assert!((got - 4.0).abs() < 1e-11, "rate {rate}: {got}");
        }
    }

    #[test]
    fn series_and_closed_form_of_phi2_meet() {
        let (below, above) = (SERIES_BELOW * (1.0 - 1e-15), SERIES_BELOW);
        let difference = phi2(below, phi1(below)) - phi2(above, phi1(above));
        // The closed form loses a factor 2/z = 20 of machine precision here.
        assert!(difference.abs() < 2e-14, "{difference:e}");
    }
}
