//! The wall shear of unsteady laminar flow, where a segment asks for it (`friction = "womersley"`).
//!
//! The shear remembers past accelerations: −(4πμ/ρ)(2u + ∫ W(ν(t − s)/R²) ∂u/∂s ds) with Zielke's weighting function (Zielke 1968), here a
//! sum of exponentials W(τ) = Σ m_k e^(−n_k τ) (Trikha 1975) with ten terms (Kagawa et al. 1983). With the states
//! w_k = ∫ m_k e^(…) ∂u/∂s ds − m_k u no acceleration is needed: ∂w_k/∂t = −n_k (ν/R²)(w_k + m_k u), and the memory is −(4πμ/ρ) Σ (w_k + m_k u).
//! It is implicit in time, as the fastest terms are faster than waves; what remains of it in a steady flow, nothing, leaves Poiseuille's
//! 8πμ u. R is that of the cell at the time. Next file to read: [`super::viscous`].

use super::vessels::Vessels;
use super::viscous::Viscous;

/// Rates n_k in ν/R², and weights m_k.
pub(super) const TERMS: [[f64; 2]; 10] = [
    [26.3744, 1.0],
    [72.8033, 1.16725],
    [187.424, 2.20064],
    [536.626, 3.92861],
    [1570.60, 6.78788],
    [4618.13, 11.6761],
    [13601.1, 20.0612],
    [40082.5, 34.4541],
    [118_153.0, 59.1642],
    [348_316.0, 101.590],
];

impl Vessels<'_> {
    /// The cells that remember, and the first of the ten states of each.
    fn remembering(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let cells = move |tube: &super::network::Tube| {
            let (cell, memory) = (tube.first, tube.memory?);
            let state = move |j| (cell + j, self.remembered + TERMS.len() * (memory + j));
            Some((0..tube.n).map(state))
        };
        self.network.tubes.iter().filter_map(cells).flatten()
    }

    /// Rate n_k ν/R² = n_k πν/A per n_k in a cell of this area.
    fn fading(&self, area: f64) -> f64 {
        0.125 * self.friction / area
    }

    /// Writes what a step of τ does to the flow Q of each remembering cell: (1 + drag) Q + pull = r at its end.
    pub(super) fn remember(&self, tau: f64, x: &[f64], work: &mut Viscous) {
        for (cell, state) in self.remembering() {
            let fading = tau * self.fading(x[cell]);
            let (mut drag, mut pull) = (0.0, 0.0);
            for ([rate, weight], past) in TERMS.iter().zip(&x[state..]) {
                let kept = 1.0 / (1.0 + rate * fading);
                drag += kept * weight;
                pull += kept * past;
            }
            work.drag[cell] = 0.5 * tau * self.friction * drag / x[cell];
            work.pull[cell] = 0.5 * tau * self.friction * pull;
        }
    }

    /// Ends a step of τ between walls without viscosity, for the flows alone.
    pub(super) fn drag(&self, x: &mut [f64], work: &Viscous) {
        let n = self.network.n_cell;
        for (cell, _) in self.remembering() {
            x[n + cell] = (x[n + cell] - work.pull[cell]) / (1.0 + work.drag[cell]);
        }
    }

    /// Ends a step of τ at the flows found: writes the states and their rates, and adds the memory to the rates of the flows.
    pub(super) fn shear(&self, tau: f64, x: &mut [f64], rate: &mut [f64]) {
        let n = self.network.n_cell;
        for (cell, state) in self.remembering() {
            let (fading, velocity) = (self.fading(x[cell]), x[n + cell] / x[cell]);
            let mut memory = 0.0;
            for (k, [fast, weight]) in TERMS.iter().enumerate() {
                let still = weight * velocity;
                let (at, fast) = (state + k, fast * fading);
                let left = (x[at] + still) / (1.0 + tau * fast);
                memory += left;
                x[at] = left - still;
                rate[at] = -fast * left;
            }
            rate[n + cell] -= 0.5 * self.friction * memory;
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;

    use super::*;

    /// J_k(z) by its series; for |z| ≤ 20 a few hundred roundings are lost.
    fn bessel(k: i32, z: Complex<f64>) -> Complex<f64> {
        let (half, mut i) = (z * 0.5, 1.0);
        let mut term = half.powi(k);
        let mut sum = term;
        while term.norm() > 1e-18 * sum.norm() || i < 20.0 {
            term = -term * half * half / (i * (i + f64::from(k)));
            sum += term;
            i += 1.0;
        }
        sum
    }

    #[test]
    fn the_terms_have_the_longitudinal_impedance_of_womersley() {
        for alpha in [0.1_f64, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0] {
            // Per μ/R² of the velocity: iα²/(1 − 2J1(Λ)/(Λ J0(Λ))), Λ = i^(3/2) α (Womersley 1955).
            let s = Complex::new(0.0, alpha * alpha);
            let lambda = Complex::from_polar(alpha, 0.75 * std::f64::consts::PI);
            let exact = s / (-bessel(1, lambda) / (lambda * bessel(0, lambda)) * 2.0 + 1.0);
            let memory: Complex<f64> = TERMS.iter().map(|[n, m]| s * *m / (s + *n)).sum();
            let found = s + 8.0 + memory * 4.0;
            // The terms leave out what is faster than the fastest: 0.0015 of the impedance, which blood's inertia rules there.
            assert!((found / exact - 1.0).norm() < 1.6e-3, "{alpha}: {found} against {exact}");
        }
    }
}
