//! Velocity profiles of a Stokes flow across the channel, for one wave number along it.
//!
//! The axial velocity is u = Σ cⱼ ψⱼ(y/R) cos κx with ψⱼ = P₂ⱼ₋₂ − P₂ⱼ of Legendre (Shen 1994): even, and zero at the wall,
//! where the fluid sticks. Free of divergence, the flow moves across as v = κR Σ cⱼ Vⱼ(y/R) sin κx with Vⱼ = ∫₀ ψⱼ. Since only
//! ψ₁ carries a flow, V₁(1) = 1 and all other Vⱼ(1) = 0: the wall moves with κR c₁. All integrals are closed forms. Next file
//! to read: [`super::super::toy_fsi_stokes`].

use nalgebra::DMatrix;

use super::vessel::Vessel;

/// Integrals over 0 < η < 1 of the first n_b profiles.
#[derive(Clone, Debug)]
pub(crate) struct Profiles {
    /// ∫ ψⱼ ψₗ, tridiagonal.
    axial: DMatrix<f64>,
    /// ∫ Vⱼ Vₗ, pentadiagonal.
    transverse: DMatrix<f64>,
    /// ∫ ψⱼ′ ψₗ′, diagonal.
    shear: DMatrix<f64>,
}

/// Mass and viscous dissipation of the fluid at one wave number, n_b × n_b, per length of wall and squared amplitude.
pub(crate) struct Fluid {
    /// ρf ∫ (u u + v v) dy.
    pub(crate) mass: DMatrix<f64>,
    /// 2μ ∫ ε:ε dy, ε being the rate of strain.
    pub(crate) dissipation: DMatrix<f64>,
}

impl Profiles {
    /// The first `n_b` profiles.
    pub(crate) fn new(n_b: usize) -> Self {
        // ∫ P² over (0, 1) is 1/(2m + 1) for P of degree m; a and b are those of the two Legendre functions of ψⱼ.
        let (a, b) = (|j: usize| 1.0 / (4 * j + 1) as f64, |j: usize| 1.0 / (4 * j + 5) as f64);
        let axial = DMatrix::from_fn(n_b, n_b, |j, l| match j.abs_diff(l) {
            0 => a(j) + b(j),
            1 => -b(j.min(l)),
            _ => 0.0,
        });
        // Vⱼ in the odd Legendre functions P₁, P₃, …, by (2m + 1) Pₘ = P′ₘ₊₁ − P′ₘ₋₁.
        let odd = DMatrix::from_fn(n_b + 1, n_b, |k, j| match () {
            () if k + 1 == j => -a(j),
            () if k == j => a(j) + b(j),
            () if k == j + 1 => -b(j),
            () => 0.0,
        });
        let mut weighted = odd.clone();
        for (k, mut row) in weighted.row_iter_mut().enumerate() {
            row /= (4 * k + 3) as f64;
        }
        let transverse = odd.tr_mul(&weighted);
        // ψⱼ′ = −(4j + 3) P₂ⱼ₊₁, counting j from 0.
        let shear = DMatrix::from_fn(n_b, n_b, |j, l| if j == l { (4 * j + 3) as f64 } else { 0.0 });
        Self { axial, transverse, shear }
    }

    /// Number of profiles.
    pub(crate) fn len(&self) -> usize {
        self.axial.nrows()
    }

    /// The fluid at wave number κ, with viscosity μ.
    pub(crate) fn fluid(&self, vessel: &Vessel, viscosity: f64, wave_number: f64) -> Fluid {
        let radius = vessel.radius;
        let slender = (wave_number * radius).powi(2);
        let mass = (&self.axial + &self.transverse * slender) * (vessel.fluid_density * radius);
        // 4 (κu)² and (∂u/∂y + κv)², whose mixed term is −2κ² u² after integration by parts.
        let strain = &self.axial * (2.0 * slender) + &self.shear + &self.transverse * (slender * slender);
        Fluid { mass, dissipation: strain * (viscosity / radius) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pₘ(x) by its three-term recurrence.
    fn legendre(m: usize, x: f64) -> f64 {
        let (mut before, mut now) = (0.0, 1.0);
        for k in 0..m {
            let k = k as f64;
            (before, now) = (now, ((2.0 * k + 1.0) * x * now - k * before) / (k + 1.0));
        }
        now
    }

    #[test]
    fn the_integrals_are_those_of_a_fine_quadrature() {
        let (n_b, n) = (4, 20_000);
        let profiles = Profiles::new(n_b);
        let h = 1.0 / n as f64;
        let psi = |j: usize, x: f64| legendre(2 * j, x) - legendre(2 * j + 2, x);
        let (mut flows, mut axial, mut transverse) =
            (vec![0.0; n_b], DMatrix::zeros(n_b, n_b), DMatrix::zeros(n_b, n_b));
        for i in 0..n {
            let middle: Vec<f64> = (0..n_b).map(|j| psi(j, (i as f64 + 0.5) * h)).collect();
            let half: Vec<f64> = flows.iter().zip(&middle).map(|(v, m)| v + 0.5 * h * m).collect();
            for j in 0..n_b {
                for l in 0..n_b {
                    axial[(j, l)] += h * middle[j] * middle[l];
                    transverse[(j, l)] += h * half[j] * half[l];
                }
                flows[j] += h * middle[j];
            }
        }
        // The midpoint rule errs by h² times a few hundred.
        assert!((axial - &profiles.axial).amax() < 1e-6);
        assert!((transverse - &profiles.transverse).amax() < 1e-6);
        assert!((flows[0] - 1.0).abs() < 1e-6 && flows[1..].iter().all(|v| v.abs() < 1e-6), "{flows:?}");
    }
}
