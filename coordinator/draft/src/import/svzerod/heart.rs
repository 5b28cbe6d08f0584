//! A closed loop of a file, and what empties into it, as elements of a network.
//!
//! The equations are those of the documentation of svZeroDSolver; a closed loop is four chambers, four valves with an inertance each,
//! and the lungs (Sankaran et al. 2012). Next file to read: [`super::activation`].

#![allow(non_snake_case)] // the file's own keys

use super::activation::Shape;
use super::blocks::{Blocks, Side};
use super::file::{ClosedCoronary, ClosedLoop, ClosedRcr, File, Heart, typed};
use super::network::{self, GROUND, Kind, Node, Opening};

/// Resistance of a closed valve that the file takes as tight, in parts of the open one.
const TIGHT: f64 = 1e7;
/// Part of the blood that the file begins with, per period: the flow at which a valve that the file takes as sharp is open.
const OPENS: f64 = 1e-3;

/// The nodes of the heart that boundary conditions refer to.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeartNodes {
    pub(super) right_atrium: Node,
    pub(super) right_ventricle: Node,
    pub(super) left_ventricle: Node,
    /// Shares of the ventricles' pressures on the muscle, left and right.
    shares: [f64; 2],
}

impl Blocks {
    /// Adds the heart of a closed loop.
    pub(super) fn closed_loop(
        &mut self,
        file: &File,
        closed: &ClosedLoop,
        place: &str,
    ) -> Result<(), String> {
        if closed.closed_loop_type != "ClosedLoopHeartAndPulmonary" {
            return Err(format!(
                "{place}: a closed loop of type `{}` is not in `rcr-network` (known: ClosedLoopHeartAndPulmonary)",
                closed.closed_loop_type
            ));
        }
        let h: Heart = typed(&format!("{place}.parameters"), &closed.parameters)?;
        let period = closed.cardiac_cycle_period.or(file.simulation_parameters.cardiac_period);
        let period = period.ok_or_else(|| format!("{place}: `cardiac_cycle_period` is not given"))?;
        self.period = Some((period, format!("{place}.cardiac_cycle_period")));
        let blood: f64 =
            file.initial_condition.iter().filter(|(key, _)| key.starts_with("V_")).map(|(_, v)| v).sum();
        let flow = OPENS * if blood > 0.0 { blood } else { 1.0 } / period;
        let [ra, rv, la, lv] = self.four_chambers(&h, place)?;
        let (lungs, aorta) = (self.network.node("lungs"), self.network.node("aorta"));
        let valves = [
            ("tricuspid", "Q_RA", ra, rv, h.Rra_v, h.Lra_v),
            ("pulmonary", "Q_RV", rv, lungs, h.Rrv_a, h.Lrv_a),
            ("mitral", "Q_LA", la, lv, h.Rla_v, h.Lla_v),
            ("aortic", "Q_LV", lv, aorta, h.Rlv_ao, h.Llv_a),
        ];
        for (name, key, from, to, resistance, inertance) in valves {
            self.heart_valve(name, (from, to), (resistance, inertance), flow)?;
            self.states.insert(format!("{key}:CLH"), format!("stored_q_{name}_blood"));
        }
        let capacitor = Kind::Capacitor { value: h.Cpa, outside: None };
        self.network.add("aorta_wall", capacitor, aorta, GROUND);
        self.lungs(&h, lungs, la);
        self.channels.push((format!("p_{}", self.network.name(aorta)), "dyn/cm^2"));
        for block in &closed.outlet_blocks {
            self.attach(block, Side::Inlet, aorta)?;
        }
        self.heart = Some(HeartNodes {
            right_atrium: ra,
            right_ventricle: rv,
            left_ventricle: lv,
            shares: [h.iml, h.imr],
        });
        Ok(())
    }

    /// The nodes of RA, RV, LA and LV.
    fn four_chambers(&mut self, h: &Heart, place: &str) -> Result<[Node; 4], String> {
        let atria = Shape::Wrapping { Tsa: h.Tsa, tpwave: h.tpwave };
        atria.check().map_err(|fault| format!("{place}: {fault}"))?;
        let atrium = |active, rest, wall| network::Chamber {
            active,
            passive: 0.0,
            rest: [rest; 2],
            wall: Some(wall),
            input: String::new(),
        };
        let ventricle = |active, rest| network::Chamber {
            active,
            passive: 0.0,
            rest: [rest; 2],
            wall: None,
            input: String::new(),
        };
        let right = atrium(h.Emax_ra, h.Vaso_ra, [h.Kxp_ra, h.Kxv_ra]);
        let left = atrium(h.Emax_la, h.Vaso_la, [h.Kxp_la, h.Kxv_la]);
        let chambers = [
            ("RA", right, atria.clone()),
            ("RV", ventricle(h.Erv_s, h.Vrv_u), Shape::Fourier),
            ("LA", left, atria),
            ("LV", ventricle(h.Elv_s, h.Vlv_u), Shape::Fourier),
        ];
        Ok(chambers.map(|(name, law, shape)| {
            let node = self.network.node(name);
            let element = self.heart_chamber(&format!("heart_{name}"), law, shape, node);
            self.states.insert(format!("V_{name}:CLH"), format!("stored_V_{element}"));
            node
        }))
    }

    /// The vessels of the lungs, between the right ventricle's valve and the left atrium.
    fn lungs(&mut self, h: &Heart, lungs: Node, la: Node) {
        // As there, what leaves the right ventricle fills the left atrium at once, and the lungs only set the pressure it meets.
        let vessels = Kind::Under { value: h.Cp, around: la, share: -1.0 };
        let element = self.network.add("lungs_wall", vessels, lungs, la);
        self.network.add("lungs_bed", Kind::Resistance(h.Rpd), lungs, la);
        self.states.insert("P_pul:CLH".to_owned(), format!("stored_v_{element}"));
        self.network.notes.push(
            "as in svZeroDSolver, what leaves the right ventricle fills the left atrium at once: `lungs_wall` sets the pressure that \
             it meets and keeps no blood"
                .to_owned(),
        );
    }

    /// A valve with an inertance, tight when closed.
    fn heart_valve(
        &mut self,
        name: &str,
        (from, to): (Node, Node),
        (resistance, inertance): (f64, f64),
        flow: f64,
    ) -> Result<(), String> {
        if !(resistance > 0.0 && inertance > 0.0 && resistance.is_finite() && inertance.is_finite()) {
            return Err(format!(
                "the resistance and the inertance of the {name} valve are not both above zero"
            ));
        }
        let middle = self.network.node(&format!("{name}_mid"));
        let opening = Opening::Over(resistance * flow);
        let valve = Kind::Valve { open: resistance, closed: TIGHT * resistance, opening };
        self.network.add(name, valve, from, middle);
        self.network.add(&format!("{name}_blood"), Kind::Inertance(inertance), middle, to);
        Ok(())
    }

    fn nodes_of_heart(&self, place: &str, name: &str) -> Result<HeartNodes, String> {
        self.heart
            .ok_or_else(|| format!("{place}: `{name}` empties into a heart, and the file has no closed loop"))
    }

    /// A Windkessel that empties into the right atrium.
    pub(super) fn closed_rcr(
        &mut self,
        place: &str,
        name: &str,
        values: &ClosedRcr,
        node: Node,
    ) -> Result<(), String> {
        if !values.closed_loop_outlet {
            return Err(format!(
                "{place}.closed_loop_outlet: `{name}` empties nowhere: give true, or an RCR"
            ));
        }
        let end = self.nodes_of_heart(place, name)?.right_atrium;
        for (key, value) in [("Rp", values.Rp), ("C", values.C), ("Rd", values.Rd)] {
            super::blocks::positive(place, key, value)?;
        }
        let kind = Kind::Rcr { proximal: values.Rp, compliance: values.C, distal: values.Rd, venous: 0.0 };
        let element = self.network.add(name, kind, node, end);
        self.states.insert(format!("P_c:{name}"), format!("stored_p_{element}"));
        self.outlet(format!("Rd_{element}"), values.Rd, &element);
        Ok(())
    }

    /// A coronary bed under the pressure of a ventricle that empties into the right atrium.
    pub(super) fn closed_coronary(
        &mut self,
        place: &str,
        name: &str,
        values: &ClosedCoronary,
        (node, left): (Node, bool),
    ) -> Result<(), String> {
        let heart = self.nodes_of_heart(place, name)?;
        let ClosedCoronary { Ra, Ram, Rv, Ca, Cim } = *values;
        for (key, value) in [("Ra", Ra), ("Ram", Ram), ("Rv", Rv), ("Ca", Ca), ("Cim", Cim)] {
            super::blocks::positive(place, key, value)?;
        }
        let arteries = self.network.node(&format!("{name}_arteries"));
        let muscle = self.network.node(&format!("{name}_muscle"));
        self.network.add(&format!("{name}_Ra"), Kind::Resistance(Ra), node, arteries);
        let capacitor = Kind::Capacitor { value: Ca, outside: None };
        self.network.add(&format!("{name}_Ca"), capacitor, arteries, GROUND);
        self.network.add(&format!("{name}_Ram"), Kind::Resistance(Ram), arteries, muscle);
        let (around, share) = if left {
            (heart.left_ventricle, heart.shares[0])
        } else {
            (heart.right_ventricle, heart.shares[1])
        };
        self.network.add(&format!("{name}_Cim"), Kind::Under { value: Cim, around, share }, muscle, GROUND);
        let element =
            self.network.add(&format!("{name}_Rv"), Kind::Resistance(Rv), muscle, heart.right_atrium);
        self.outlet(format!("R_{element}"), Rv, &element);
        Ok(())
    }
}
