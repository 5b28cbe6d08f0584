//! The exact motion of one linear oscillator over a step, free and under a load that is linear in time.
//!
//! Structures whose normal modes are known move by it mode by mode. No model stands here. Next file to read:
//! [`crate::exponential`], for linear systems whose modes are not known.

/// Exact free motion of m d²x/dt² + c dx/dt + k x = 0 over a time `h` (Meirovitch 1986, §1.6 to 1.8): e^(−σh) (Cos I + Sin (A + σ I))
/// applied to (x, v); `theta` is (m, c, k).
///
/// σ = c/2m and w² = k/m − σ²; Cos and Sin are cos wh and sin wh/w, their hyperbolic forms when overdamped, 1 and h when
/// critically damped.
pub fn free_motion(theta: &[f64], h: f64, state: [f64; 2]) -> [f64; 2] {
    let (mass, damping, stiffness) = (theta[0], theta[1], theta[2]);
    let (sigma, natural) = (0.5 * damping / mass, stiffness / mass);
    let square = natural - sigma * sigma;
    let (cos, sin) = if square > 0.0 {
        let (decay, w) = ((-sigma * h).exp(), square.sqrt());
        let (s, c) = (w * h).sin_cos();
        (decay * c, decay * s / w)
    } else if square < 0.0 {
        // The slow root as natural/(σ + w): σ − w would cancel for heavy damping.
        let w = (-square).sqrt();
        let (slow, fast) = ((-natural * h / (sigma + w)).exp(), (-(sigma + w) * h).exp());
        (0.5 * (slow + fast), -0.5 * slow * (-2.0 * w * h).exp_m1() / w)
    } else {
        let decay = (-sigma * h).exp();
        (decay, decay * h)
    };
    let [x, v] = state;
    [cos * x + sin * (v + sigma * x), cos * v - sin * (natural * x + sigma * v)]
}

/// Exact motion of m d²x/dt² + c dx/dt + k x = p + q t over a time `h` from (x, v): the free motion about the particular
/// solution x = (p + q t − c q/k)/k, v = q/k. `theta` is (m, c, k) with k > 0, `load` is (p, q).
pub fn driven_motion(theta: &[f64], h: f64, state: [f64; 2], load: [f64; 2]) -> [f64; 2] {
    let (damping, stiffness) = (theta[1], theta[2]);
    let v = load[1] / stiffness;
    let start = (load[0] - damping * v) / stiffness;
    let [dx, dv] = free_motion(theta, h, [state[0] - start, state[1] - v]);
    [start + v * h + dx, v + dv]
}
