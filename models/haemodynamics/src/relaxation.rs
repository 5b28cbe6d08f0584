//! The exact step of a first-order relaxation with a right-hand side linear in time.
//!
//! Not a model: the Windkessels are made of it. Next file to read: [`super::windkessel2`].

/// Below this |z| the series of φ₂ is used; above it the closed form loses at most a factor 2/|z| of the precision.
const SERIES_BELOW: f64 = 0.1;

/// Coefficients 1/(k + 2)! of the series of φ₂; the first one left out adds less than 1e-18.
const SERIES: [f64; 10] = [
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5_040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
];

/// φ₁(−z) = (1 − e^(−z))/z and φ₂(−z) = (1 − φ₁(−z))/z, with their limits 1 and 1/2 at zero.
fn phi(z: f64) -> (f64, f64) {
    if z.abs() >= SERIES_BELOW {
        let phi1 = -(-z).exp_m1() / z;
        return (phi1, (1.0 - phi1) / z);
    }
    // Even and odd powers apart: two short chains of operations instead of one long one.
    let square = z * z;
    let (mut even, mut odd) = (0.0, 0.0);
    for k in (0..SERIES.len()).step_by(2).rev() {
        even = SERIES[k] + square * even;
        odd = SERIES[k + 1] + square * odd;
    }
    let phi2 = even - z * odd;
    (1.0 - z * phi2, phi2)
}

/// Advances dx/dt = −x/τ + a + b (t − t₀) from `x` over a time `h`, exactly.
///
/// `rate` is 1/τ and `start` the value of the right-hand side at t₀ including the −x/τ term; `slope` is b. The form
/// x + h φ₁ start + h² φ₂ slope (Hochbruck & Ostermann 2010, eq. 2.6) stays accurate for h/τ → 0.
pub(super) fn step(x: f64, rate: f64, start: f64, slope: f64, h: f64) -> f64 {
    let z = h * rate;
    let (phi1, phi2) = phi(z);
    x + h * (phi1 * start + h * phi2 * slope)
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
    fn series_and_closed_form_meet() {
        for sign in [1.0, -1.0] {
            let (below, above) = (phi(sign * SERIES_BELOW * (1.0 - 1e-15)), phi(sign * SERIES_BELOW));
            // The closed form of φ₂ loses a factor 2/z = 20 of machine precision here.
            assert!((below.0 - above.0).abs() < 1e-15, "{below:?} {above:?}");
            assert!((below.1 - above.1).abs() < 2e-14, "{below:?} {above:?}");
        }
    }
}
