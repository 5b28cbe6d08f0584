//! Vessels of a file as elements of a network.
//!
//! A `BloodVessel` is a resistance with stenosis, a capacitor behind it and an inertance; a `BloodVesselCRL` has the capacitor at its
//! inlet; of `Resistance`, `Capacitance` and `Inductance` each is one of these alone. Next file to read: [`super::network`].

#![allow(non_snake_case)] // the file's own keys

use super::blocks::Blocks;
use super::file::{OneCapacitance, OneInductance, OneResistance, Vessel, VesselValues, typed};
use super::network::{GROUND, Kind};
use starlings_models::quoted_list;

impl Vessel {
    /// Its values, whatever its type; what it does not have is zero.
    pub(super) fn values(&self, place: &str) -> Result<VesselValues, String> {
        let (own, values) = (format!("{place}.zero_d_element_values"), &self.zero_d_element_values);
        match self.zero_d_element_type.as_str() {
            "BloodVessel" | "BloodVesselCRL" => typed(&own, values),
            "Resistance" => {
                let OneResistance { R } = typed(&own, values)?;
                Ok(VesselValues { R_poiseuille: R, ..VesselValues::default() })
            }
            "Capacitance" => {
                let OneCapacitance { C } = typed(&own, values)?;
                Ok(VesselValues { C, ..VesselValues::default() })
            }
            "Inductance" => {
                let OneInductance { L } = typed(&own, values)?;
                Ok(VesselValues { L, ..VesselValues::default() })
            }
            other => Err(format!(
                "{place}: a vessel of type `{other}` is not in `rcr-network` (known: BloodVessel, BloodVesselCRL, Resistance, \
                 Capacitance, Inductance)"
            )),
        }
    }
}

impl Blocks {
    /// Adds a vessel between its ends.
    pub(super) fn vessel(&mut self, vessel: &Vessel, place: &str) -> Result<(), String> {
        let name = &vessel.vessel_name;
        let [Some(from), Some(to)] = self.ends[name] else {
            let end = if self.ends[name][0].is_none() { "inlet" } else { "outlet" };
            return Err(format!("{place}: nothing is joined to the {end} of `{name}`"));
        };
        let values = vessel.values(place)?;
        let mut series = Self::of(values.R_poiseuille, values.stenosis_coefficient, values.L);
        match vessel.zero_d_element_type.as_str() {
            "BloodVesselCRL" if values.C > 0.0 => {
                let kind = Kind::Capacitor { value: values.C, outside: None };
                self.network.add(&format!("{name}_wall"), kind, from, GROUND);
            }
            "BloodVesselCRL" if values.C == 0.0 => {}
            "BloodVesselCRL" => return Err(format!("{place}: C is {}: give zero or more", values.C)),
            _ => series.capacity = values.C,
        }
        if series.is_nothing() {
            self.passed.push((name.clone(), [from, to]));
        }
        self.network.series((name, &format!("{place}.zero_d_element_values")), series, from, to)
    }

    /// Says which vessels are nothing but a joint, and which outputs there are not of them.
    pub(super) fn tell_passed(&mut self) {
        let mut outputs = Vec::new();
        for (name, ends) in &self.passed {
            let nodes = ends.iter().filter_map(|end| self.network.lost(*end)).map(|node| format!("p_{node}"));
            for output in std::iter::once(format!("q_{name}")).chain(nodes) {
                if !outputs.contains(&output) {
                    outputs.push(output);
                }
            }
        }
        if !self.passed.is_empty() {
            let vessels = quoted_list(self.passed.iter().map(|(name, _)| name));
            let (have, their) = if self.passed.len() == 1 { ("has", "its") } else { ("have", "their") };
            self.network.notes.push(format!(
                "{vessels} {have} neither a resistance nor an inertance: {their} two ends are one node, and the study has no {}",
                quoted_list(outputs.iter())
            ));
        }
    }
}
