//! What a network empties into: resistances, Windkessels and coronary beds.
//!
//! Next file to read: [`super::network`].

#![allow(non_snake_case)] // the file's own keys

use super::super::plan::Unknown;
use super::blocks::{Blocks, FLOW, RESISTANCE, positive};
use super::file::{Coronary, Rcr};
use super::network::{GROUND, Kind, Node, Series};

impl Blocks {
    /// A resistance that has to be above zero; the last of an outlet is what a study does not know.
    #[allow(clippy::too_many_arguments)] // a place in the file and one in the network
    pub(super) fn resistance(
        &mut self,
        place: &str,
        key: &str,
        name: &str,
        value: f64,
        from: Node,
        to: Node,
        last: bool,
    ) -> Result<(), String> {
        positive(place, key, value)?;
        let element = self.network.add(name, Kind::Resistance(value), from, to);
        if last {
            self.outlet(format!("R_{element}"), value, &element);
        }
        Ok(())
    }

    /// The last resistance of an outlet is what a study does not know, and its flow what it begins with as measured.
    pub(super) fn outlet(&mut self, name: String, value: f64, element: &str) {
        self.unknowns.push(Unknown { name, unit: RESISTANCE, value });
        self.channels.push((format!("q_{element}"), FLOW));
    }

    /// A Windkessel of three elements; of those that are zero, what is left.
    pub(super) fn rcr(&mut self, place: &str, name: &str, values: &Rcr, node: Node) -> Result<(), String> {
        let &Rcr { Rp, C, Rd, Pd } = values;
        positive(place, "Rd", Rd)?;
        if Rp == 0.0 || C == 0.0 {
            // The model's own element has all three.
            let chamber = self.network.node(&format!("{name}_chamber"));
            let series = Series { capacity: C, ..Self::of(Rp, 0.0, 0.0) };
            self.network.series((&format!("{name}_proximal"), place), series, node, chamber)?;
            let end = self.network.constant(name, Pd);
            return self.resistance(place, "Rd", name, Rd, chamber, end, true);
        }
        positive(place, "Rp", Rp)?;
        positive(place, "C", C)?;
        let kind = Kind::Rcr { proximal: Rp, compliance: C, distal: Rd, venous: Pd };
        let element = self.network.add(name, kind, node, GROUND);
        self.states.insert(format!("P_c:{name}"), format!("stored_p_{element}"));
        self.states.insert(format!("pressure_c:{name}"), format!("stored_p_{element}"));
        self.outlet(format!("Rd_{element}"), Rd, &element);
        Ok(())
    }

    /// A coronary bed under the pressure of the muscle, an input.
    pub(super) fn coronary(
        &mut self,
        place: &str,
        name: &str,
        values: Coronary,
        node: Node,
    ) -> Result<(), String> {
        let Coronary { Ra1, Ra2, Rv1, Ca, Cc, P_v, t, Pim } = values;
        positive(place, "Ca", Ca)?;
        positive(place, "Cc", Cc)?;
        let arteries = self.network.node(&format!("{name}_arteries"));
        let muscle = self.network.node(&format!("{name}_muscle"));
        self.resistance(place, "Ra1", &format!("{name}_Ra1"), Ra1, node, arteries, false)?;
        let kind = Kind::Capacitor { value: Ca, outside: None };
        self.network.add(&format!("{name}_Ca"), kind, arteries, GROUND);
        self.resistance(place, "Ra2", &format!("{name}_Ra2"), Ra2, arteries, muscle, false)?;
        let input = self.network.names.take(&format!("{name}_Pim"));
        let kind = Kind::Capacitor { value: Cc, outside: Some(input.clone()) };
        self.network.add(&format!("{name}_Cc"), kind, muscle, GROUND);
        let end = self.network.constant(name, P_v);
        self.resistance(place, "Rv1", &format!("{name}_Rv1"), Rv1, muscle, end, true)?;
        self.course(place, input, t, Pim)
    }
}
