//! A solid rocket motor whose chamber is one volume of gas.
//!
//! Cylindrical, neutral and tabulated grains; a throat that loses area; noise of pressure and density. Waves and the fall of
//! pressure along the bore are in the model with one dimension. Next file to read: `rocket_motor/chamber.rs`.

mod chamber;
mod layout;
mod quantities;

use starlings_models_core::integrate::Solver;
use starlings_models_core::{Drive, Model, ModelDef, SetupError, Spec};

use chamber::Chamber;
use layout::{Layout, Noise};
use quantities::N_SHARED;

/// Pressure p, density ρ and bore radius R of a burning chamber of free volume V(R) and burning surface A_b(R) (Smelyanskiy,
/// Luchinsky et al., "Physics-based methods of failure analysis and diagnostics in human space flight", eqs. 1.28 and 1.32):
///
/// ρ̇ = (A_b r/V)(k_A ρ_p − ρ) − Γ√γ A_t √(pρ)/V + d_ρ ξ₂,
///
/// ṗ = (A_b r/V)(k_A c_0² ρ_p − p) − γ Γ√γ A_t p √(p/ρ)/V + d_p ξ₁,
///
/// Ṙ = r = r_c (p/p_c)ⁿ,
///
/// which are the balances of mass and energy of the gas, with the enthalpy c_0²/(γ − 1) per mass of propellant. In scaled units
/// r_c, A_t and V_0 make the coefficients κ and a of the chapter: c_0² is γ and Γ√γ A_t is κ a V_0/γ.
pub struct RocketMotor {
    spec: Spec,
    layout: Layout,
}

impl RocketMotor {
    /// Makes a motor in this layout.
    ///
    /// # Errors
    /// When the layout cannot be; the error says where.
    fn new(layout: Layout) -> Result<Self, SetupError> {
        layout.check()?;
        Ok(Self { spec: quantities::spec(&layout), layout })
    }

    /// Makes the motor of a study.
    ///
    /// # Errors
    /// When its layout cannot be read, or cannot be.
    pub(super) fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
        Ok(Box::new(Self::new(starlings_models_core::layout::read(def)?)?))
    }

    fn chamber(&self, theta: &[f64]) -> Chamber {
        Chamber::read(self.layout.units, theta)
    }

    fn factor(&self, t: f64, theta: &[f64], u: Drive<'_>) -> f64 {
        self.layout.throat.factor(t, &theta[N_SHARED..], u.value)
    }
}

impl Model for RocketMotor {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    /// The gas at the pressure p_c and the temperature of the flame, the bore at its first radius.
    fn initial(&self, theta: &[f64], x: &mut [f64]) {
        let chamber = self.chamber(theta);
        x.copy_from_slice(&[chamber.p_c, chamber.rho_c, chamber.r_0]);
    }

    fn rhs(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        self.chamber(theta).rates(&self.layout.grain, self.factor(t, theta, u), x, dx);
    }

    fn output(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, y: &mut [f64]) {
        let (chamber, factor) = (self.chamber(theta), self.factor(t, theta, u));
        let flow = chamber.flow(factor, x[0], x[1]);
        y[..5].copy_from_slice(&[x[0], x[1], x[2], flow, chamber.thrust * factor * x[0]]);
        // Only a throat with a course shows its area.
        if let Some(area) = y.get_mut(5) {
            *area = chamber.area * factor;
        }
    }

    fn solver(&self) -> Solver {
        match self.layout.noise {
            Some(Noise { step }) => Solver::Heun { step },
            None => Solver::default(),
        }
    }

    fn n_noise(&self) -> usize {
        if self.layout.noise.is_some() { 2 } else { 0 }
    }

    fn noise(&self, _t: f64, _x: &[f64], theta: &[f64], _u: Drive<'_>, b: &mut [f64]) {
        let [d_p, d_rho] = [theta[theta.len() - 2], theta[theta.len() - 1]];
        b.copy_from_slice(&[d_p, 0.0, 0.0, 0.0, d_rho, 0.0]);
    }

    /// The end of the grain, the kinks of its table, the fault of the throat.
    fn n_switch(&self) -> usize {
        1 + self.layout.grain.kinks().len() + usize::from(self.layout.throat.onset(&[0.0]).is_some())
    }

    fn switches(&self, t: f64, x: &[f64], theta: &[f64], _u: Drive<'_>, g: &mut [f64]) {
        let chamber = self.chamber(theta);
        g[0] = chamber.r_e - x[2];
        let kinks = self.layout.grain.kinks();
        for (g, web) in g[1..].iter_mut().zip(kinks) {
            *g = chamber.r_0 + web - x[2];
        }
        if let Some(onset) = self.layout.throat.onset(&theta[N_SHARED..]) {
            g[1 + kinks.len()] = t - onset;
        }
    }
}
