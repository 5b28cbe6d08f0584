//! The flow of a perfect gas through a nozzle's throat.
//!
//! Isentropic from the chamber to the throat (Shapiro 1953, "The Dynamics and Thermodynamics of Compressible Fluid Flow", vol. 1,
//! eqs. 4.15 to 4.19). Losses, the boundary layer and the divergent part, which enters as a thrust coefficient, are not here. Next
//! file to read: [`super::throat`].

/// Γ = ((γ+1)/2)^{−(γ+1)/(2(γ−1))}: a choked throat of area A passes Γ A √(γ p ρ) of gas of pressure p and density ρ at rest.
pub(crate) fn choked(gamma: f64) -> f64 {
    (0.5 * (gamma + 1.0)).powf(-0.5 * (gamma + 1.0) / (gamma - 1.0))
}

/// Mass flow against a pressure outside over the choked one, 1 below the critical ratio `x` of the pressures outside and inside.
pub(crate) fn unchoked(x: f64, gamma: f64) -> f64 {
    let critical = (2.0 / (gamma + 1.0)).powf(gamma / (gamma - 1.0));
    if x <= critical {
        return 1.0;
    }
    let flow = |x: f64| x.powf(1.0 / gamma) * (1.0 - x.powf((gamma - 1.0) / gamma)).max(0.0).sqrt();
    flow(x.min(1.0)) / flow(critical)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_choked_flow_is_that_of_the_tables() {
        // Anderson 2003, "Modern Compressible Flow", app. A: ṁ √(R T)/(p A) = 0.6847 at γ = 1.4, to its four digits.
        assert!((choked(1.4) * 1.4_f64.sqrt() - 0.6847).abs() < 5e-5);
        assert!((choked(1.2) - 0.5920).abs() < 5e-5);
    }

    #[test]
    fn the_flow_falls_to_zero_where_the_pressures_meet_and_is_smooth_where_the_throat_chokes() {
        let gamma: f64 = 1.2;
        let critical = (2.0 / (gamma + 1.0)).powf(gamma / (gamma - 1.0));
        assert_eq!(unchoked(1.0, gamma).to_bits(), 0.0_f64.to_bits());
        assert_eq!(unchoked(1.3, gamma).to_bits(), 0.0_f64.to_bits());
        // The maximum of the flow is at the critical ratio, so that the fall begins with the square of the distance.
        let fall = |d: f64| 1.0 - unchoked(critical + d, gamma);
        assert!(fall(1e-3) > 0.0 && (fall(2e-3) / fall(1e-3) - 4.0).abs() < 0.02);
    }
}
