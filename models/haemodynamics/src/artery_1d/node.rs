//! Where vessels end: the state of each end that fits the node and what the vessel sends towards it.
//!
//! A subcritical vessel sends one characteristic variable to each of its ends, W = s u + 4c with s = 1 at its end and −1 at
//! its start (Formaggia, Lamponi & Quarteroni 2003), and takes the other from the node. At an inlet the flow is given; at a
//! junction mass is conserved and the total pressure p + ½ρu² is the same in all ends; at an outlet the pressure p stands
//! before a resistance. p contains the viscous pressure of the wall. Next file to read: [`super::transport`].

use super::wall::Ring;

/// What one vessel sends to the node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arriving {
    /// 1 where the vessel ends in the node, −1 where it starts.
    pub(super) sign: f64,
    pub(super) ring: Ring,
    /// Area and velocity inside the vessel, brought to its end.
    pub(super) area: f64,
    pub(super) velocity: f64,
    /// External and viscous pressure, added to the elastic one.
    pub(super) beside: f64,
}

/// What the node asks for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Condition {
    /// The flows into the node and this one from outside sum to zero.
    Joint {
        /// Flow from outside.
        inflow: f64,
        /// Whether it is the total pressure that the ends share.
        total: bool,
    },
    /// The pressure is that behind a resistance and R Q above it.
    Outlet {
        /// The resistance.
        resistance: f64,
        /// The pressure behind it.
        behind: f64,
    },
}

/// The state of one end.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Met {
    pub(super) area: f64,
    pub(super) flow: f64,
}

/// Newton's iterations at most; three or four are usual.
const MOST: usize = 50;
/// Relative change of an area at which an iteration has converged; the next would only move roundings.
const CONVERGED: f64 = 1e-11;

impl Condition {
    fn total(self) -> bool {
        matches!(self, Self::Joint { total: true, .. })
    }

    /// Whose multiples m (Σ flows + inflow) = n (P − behind) make the condition: (m, n, inflow, behind).
    fn terms(self) -> [f64; 4] {
        match self {
            Self::Joint { inflow, .. } => [1.0, 0.0, inflow, 0.0],
            Self::Outlet { resistance, behind } => [resistance, 1.0, 0.0, behind],
        }
    }

    /// Solves for the state of every end; returns the pressure of the node, or nothing where the vessels allow no subcritical
    /// flow.
    pub(super) fn meet(self, rho: f64, ends: &[Arriving], met: &mut [Met]) -> Option<f64> {
        for (met, end) in met.iter_mut().zip(ends) {
            met.area = end.area;
        }
        let mut pressure =
            ends.iter().map(|end| self.local(rho, end, end.area).pressure).sum::<f64>() / ends.len() as f64;
        for _ in 0..MOST {
            let step = self.newton(rho, ends, met, &mut pressure)?;
            if step <= CONVERGED {
                self.flows(rho, ends, met);
                let slow = met
                    .iter()
                    .zip(ends)
                    .all(|(met, end)| (met.flow / met.area).abs() < end.ring.speed(met.area, rho));
                return (slow && pressure.is_finite()).then_some(pressure);
            }
        }
        None
    }

    /// One Newton step for the node's pressure and the areas; returns the largest relative change of an area.
    fn newton(self, rho: f64, ends: &[Arriving], met: &mut [Met], pressure: &mut f64) -> Option<f64> {
        let [m, n, inflow, behind] = self.terms();
        // Σ s Q at the linearisation, and its derivative with respect to the node's pressure.
        let (mut flow, mut admittance) = (inflow, 0.0);
        for (met, end) in met.iter().zip(ends) {
            let local = self.local(rho, end, met.area);
            flow += local.flow + local.flow_slope * (*pressure - local.pressure) / local.pressure_slope;
            admittance += local.flow_slope / local.pressure_slope;
        }
        let change = (n * (*pressure - behind) - m * flow) / (m * admittance - n);
        if !change.is_finite() {
            return None;
        }
        *pressure += change;
        let mut largest = 0.0_f64;
        for (met, end) in met.iter_mut().zip(ends) {
            let local = self.local(rho, end, met.area);
            // Never more than halved: far from the solution the linearisation may ask for a negative area.
            let area = (met.area + (*pressure - local.pressure) / local.pressure_slope).max(0.5 * met.area);
            largest = largest.max((area / met.area - 1.0).abs());
            met.area = area;
        }
        largest.is_finite().then_some(largest)
    }

    /// Writes the flows; what roundings leave of the mass balance of a joint goes to the last end.
    fn flows(self, rho: f64, ends: &[Arriving], met: &mut [Met]) {
        let mut sum = 0.0;
        for (met, end) in met.iter_mut().zip(ends) {
            let flow = self.local(rho, end, met.area).flow;
            met.flow = end.sign * flow;
            sum += flow;
        }
        if let (Self::Joint { inflow, .. }, Some(met), Some(end)) = (self, met.last_mut(), ends.last()) {
            let others = sum - end.sign * met.flow;
            met.flow = -end.sign * (inflow + others);
        }
    }

    /// Pressure and flow into the node of an end with this area, and their derivatives.
    fn local(self, rho: f64, end: &Arriving, area: f64) -> Local {
        let (c, sent) = (end.ring.speed(area, rho), end.ring.speed(end.area, rho));
        // Velocity into the node: W = s u + 4c is what the vessel sends.
        let velocity = end.sign * end.velocity - 4.0 * (c - sent);
        let pressure = end.ring.pressure(area) + end.beside;
        let flow_slope = velocity - c;
        let elastic = rho * c * c / area;
        if self.total() {
            Local {
                pressure: pressure + 0.5 * rho * velocity * velocity,
                pressure_slope: elastic - rho * velocity * c / area,
                flow: area * velocity,
                flow_slope,
            }
        } else {
            Local { pressure, pressure_slope: elastic, flow: area * velocity, flow_slope }
        }
    }
}

struct Local {
    pressure: f64,
    pressure_slope: f64,
    flow: f64,
    flow_slope: f64,
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn arriving(sign: f64, stiffness: f64, radius: f64, area: f64, velocity: f64) -> Arriving {
        Arriving { sign, ring: Ring { stiffness, radius }, area, velocity, beside: 500.0 }
    }

    #[test]
    fn a_bifurcation_conserves_mass_and_total_pressure() {
        let rho = 1.06;
        let ends = [
            arriving(1.0, 1e6, 1.0, 4.0, 90.0),
            arriving(-1.0, 2e6, 0.7, 1.4, 60.0),
            arriving(-1.0, 3e6, 0.6, 1.3, -20.0),
        ];
        let mut met = [Met::default(); 3];
        let pressure =
            Condition::Joint { inflow: 0.0, total: true }.meet(rho, &ends, &mut met).expect("a solution");
        assert!((met[0].flow - met[1].flow - met[2].flow).abs() < 1e-10, "{met:?}");
        for (met, end) in met.iter().zip(&ends) {
            let u = met.flow / met.area;
            let total = end.ring.pressure(met.area) + end.beside + 0.5 * rho * u * u;
            assert!((total / pressure - 1.0).abs() < 1e-10, "{total} against {pressure}");
            let sent = |u: f64, area: f64| end.sign * u + 4.0 * end.ring.speed(area, rho);
            // Speeds of 2500 cm/s.
            assert!((sent(u, met.area) - sent(end.velocity, end.area)).abs() < 1e-9);
        }
    }

    #[test]
    fn an_outlet_keeps_its_pressure_law_and_an_open_one_the_pressure_behind() {
        for resistance in [0.0, 150.0, 1e6] {
            let ends = [arriving(1.0, 1e6, 1.0, 4.0, 90.0)];
            let mut met = [Met::default()];
            let outlet = Condition::Outlet { resistance, behind: 9e4 };
            let pressure = outlet.meet(1.06, &ends, &mut met).expect("a solution");
            let law = 9e4 + resistance * met[0].flow;
            assert!((pressure / law - 1.0).abs() < 1e-9, "{pressure} against {law}");
            assert!((ends[0].ring.pressure(met[0].area) + 500.0 - pressure).abs() < 1e-6);
        }
    }

    #[test]
    fn more_flow_than_a_vessel_can_carry_below_its_wave_speed_has_no_solution() {
        let ends = [arriving(-1.0, 1e6, 1.0, 4.0, 0.0)];
        // u = Q/A reaches c where 4 (c − c0) = c, far above the flow of rest, A c0 = 2800 cm³/s.
        let critical = 4.0 / 3.0 * ends[0].ring.speed(4.0, 1.06);
        let area = PI * (2.0 * 1.06 * critical * critical / 1e6).powi(2);
        let inflow = |part: f64| Condition::Joint { inflow: part * area * critical, total: false };
        assert!(inflow(0.99).meet(1.06, &ends, &mut [Met::default()]).is_some());
        for part in [1.01, 2.0, -1.01, 1e5, -1e5] {
            assert_eq!(inflow(part).meet(1.06, &ends, &mut [Met::default()]), None, "{part}");
        }
    }
}
