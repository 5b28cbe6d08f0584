//! Vessels, junctions and boundary conditions of a file as elements of a network.
//!
//! The equations are those of the documentation of svZeroDSolver: a `BloodVessel` is a resistance with
//! stenosis, a capacitor behind it and an inertance; a `BloodVesselCRL` has the capacitor at its inlet. Next files to
//! read: [`super::junctions`], then [`super::network`].

use std::collections::BTreeMap;

use super::super::plan::{Samples, Unknown};
use super::file::{Boundary, Coronary, File, Flow, Pressure, Rcr, Resistance, Vessel, VesselValues, typed};
use super::network::{GROUND, Kind, Network, Node, Series};

const FLOW: &str = "cm^3/s";
const PRESSURE: &str = "dyn/cm^2";
const RESISTANCE: &str = "dyn s/cm^5";

/// A network on its way, with what a study needs besides.
#[derive(Debug)]
pub(super) struct Blocks {
    pub(super) network: Network,
    pub(super) courses: Vec<Samples>,
    pub(super) channels: Vec<(String, &'static str)>,
    pub(super) unknowns: Vec<Unknown>,
    /// Inlet and outlet of every vessel, by its name; nothing where nothing is joined yet.
    pub(super) ends: BTreeMap<String, [Option<Node>; 2]>,
    /// Where boundary conditions are.
    places: BTreeMap<String, (Node, Side)>,
    largest_flow: Option<f64>,
}

/// On which side of the network a boundary condition is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Inlet,
    Outlet,
}

impl Blocks {
    /// Takes a file apart.
    pub(super) fn new(file: &File) -> Result<Self, String> {
        let mut blocks = Self {
            network: Network::new(),
            courses: Vec::new(),
            channels: Vec::new(),
            unknowns: Vec::new(),
            ends: BTreeMap::new(),
            places: BTreeMap::new(),
            largest_flow: largest_flow(file)?,
        };
        for vessel in &file.vessels {
            if blocks.ends.insert(vessel.vessel_name.clone(), [None, None]).is_some() {
                return Err(format!("two vessels are called `{}`", vessel.vessel_name));
            }
            for (end, (name, side)) in [
                (&vessel.boundary_conditions.inlet, ("in", Side::Inlet)),
                (&vessel.boundary_conditions.outlet, ("out", Side::Outlet)),
            ] {
                let Some(boundary) = end else { continue };
                let node = blocks.network.node(&format!("{}_{name}", vessel.vessel_name));
                blocks.join(&vessel.vessel_name, side, node)?;
                blocks.place(boundary, node, side)?;
            }
        }
        for (i, junction) in file.junctions.iter().enumerate() {
            blocks.junction(file, junction, &format!("junctions[{i}]"))?;
        }
        for (i, vessel) in file.vessels.iter().enumerate() {
            blocks.vessel(vessel, &format!("vessels[{i}]"))?;
        }
        for (i, boundary) in file.boundary_conditions.iter().enumerate() {
            if file.boundary_conditions[..i].iter().any(|other| other.bc_name == boundary.bc_name) {
                return Err(format!("two boundary conditions are called `{}`", boundary.bc_name));
            }
            blocks.boundary(boundary, &format!("boundary_conditions[{i}]"))?;
        }
        if let Some(name) = blocks.places.keys().next() {
            return Err(format!(
                "`{name}` is joined to a vessel or a junction, and is no boundary condition"
            ));
        }
        Ok(blocks)
    }

    /// Joins an end of a vessel to a node.
    pub(super) fn join(&mut self, vessel: &str, side: Side, node: Node) -> Result<(), String> {
        let (at, what) = if side == Side::Inlet { (0, "inlet") } else { (1, "outlet") };
        let ends = self.ends.get_mut(vessel).ok_or_else(|| format!("no vessel is called `{vessel}`"))?;
        match ends[at].replace(node) {
            None => Ok(()),
            Some(_) => Err(format!("the {what} of `{vessel}` is joined twice")),
        }
    }

    pub(super) fn place(&mut self, boundary: &str, node: Node, side: Side) -> Result<(), String> {
        match self.places.insert(boundary.to_owned(), (node, side)) {
            None => Ok(()),
            Some(_) => {
                Err(format!("the boundary condition `{boundary}` is at two places: give each its own"))
            }
        }
    }

    /// What stands between a junction and one of its vessels.
    pub(super) fn of(&self, resistance: f64, stenosis: f64, inertance: f64) -> Series {
        Series { resistance, stenosis, capacity: 0.0, inertance, largest_flow: self.largest_flow }
    }

    fn vessel(&mut self, vessel: &Vessel, place: &str) -> Result<(), String> {
        let name = &vessel.vessel_name;
        let [Some(from), Some(to)] = self.ends[name] else {
            let end = if self.ends[name][0].is_none() { "inlet" } else { "outlet" };
            return Err(format!("{place}: nothing is joined to the {end} of `{name}`"));
        };
        let values: VesselValues =
            typed(&format!("{place}.zero_d_element_values"), &vessel.zero_d_element_values)?;
        let mut series = self.of(values.R_poiseuille, values.stenosis_coefficient, values.L);
        match vessel.zero_d_element_type.as_str() {
            "BloodVessel" => series.capacity = values.C,
            "BloodVesselCRL" if values.C > 0.0 => {
                let kind = Kind::Capacitor { value: values.C, outside: None };
                self.network.add(&format!("{name}_wall"), kind, from, GROUND);
            }
            "BloodVesselCRL" if values.C == 0.0 => {}
            "BloodVesselCRL" => return Err(format!("{place}: C is {}: give zero or more", values.C)),
            other => {
                return Err(format!(
                    "{place}: a vessel of type `{other}` is not in `rcr-network` (known: BloodVessel, BloodVesselCRL)"
                ));
            }
        }
        self.network.series(name, series, from, to)
    }

    fn boundary(&mut self, boundary: &Boundary, place: &str) -> Result<(), String> {
        let (name, values) = (boundary.bc_name.as_str(), &boundary.bc_values);
        let own = format!("{place}.bc_values");
        let known = ["FLOW", "PRESSURE", "RESISTANCE", "RCR", "CORONARY"];
        if !known.contains(&boundary.bc_type.as_str()) {
            return Err(format!(
                "{place}: the boundary condition `{name}` of type `{}` is not in `rcr-network` (known: {})",
                boundary.bc_type,
                known.join(", ")
            ));
        }
        let (node, side) = self
            .places
            .remove(name)
            .ok_or_else(|| format!("{place}: the boundary condition `{name}` is joined to nothing"))?;
        if side == Side::Inlet && !["FLOW", "PRESSURE"].contains(&boundary.bc_type.as_str()) {
            return Err(format!(
                "{place}: `{name}` of type `{}` is at an inlet, where only FLOW and PRESSURE are read",
                boundary.bc_type
            ));
        }
        match boundary.bc_type.as_str() {
            "FLOW" => {
                let Flow { t, Q } = typed(&own, values)?;
                let (from, to) = if side == Side::Inlet { (GROUND, node) } else { (node, GROUND) };
                let element = self.network.add(name, Kind::Flow, from, to);
                self.course(&own, element, t, Q)?;
                self.channels.push((format!("p_{}", self.network.name(node)), PRESSURE));
            }
            "PRESSURE" => {
                let Pressure { t, P } = typed(&own, values)?;
                let element = self.network.add(name, Kind::Pressure, GROUND, node);
                self.course(&own, element.clone(), t, P)?;
                self.channels.push((format!("q_{element}"), FLOW));
            }
            "RESISTANCE" => {
                let Resistance { R, Pd } = typed(&own, values)?;
                let end = self.network.constant(name, Pd);
                self.resistance(&own, "R", name, R, node, end, true)?;
            }
            "RCR" => self.rcr(&own, name, &typed(&own, values)?, node)?,
            _ => self.coronary(&own, name, typed(&own, values)?, node)?,
        }
        Ok(())
    }

    /// A resistance that has to be above zero; the last of an outlet is what a study does not know.
    #[allow(clippy::too_many_arguments)] // a place in the file and one in the network
    fn resistance(
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
            self.unknowns.push(Unknown { name: format!("R_{element}"), unit: RESISTANCE, value });
            self.channels.push((format!("q_{element}"), FLOW));
        }
        Ok(())
    }

    fn rcr(&mut self, place: &str, name: &str, values: &Rcr, node: Node) -> Result<(), String> {
        let &Rcr { Rp, C, Rd, Pd } = values;
        positive(place, "Rd", Rd)?;
        if Rp == 0.0 || C == 0.0 {
            // The model's own element has all three.
            let chamber = self.network.node(&format!("{name}_chamber"));
            let series = Series { capacity: C, ..self.of(Rp, 0.0, 0.0) };
            self.network.series(&format!("{name}_proximal"), series, node, chamber)?;
            let end = self.network.constant(name, Pd);
            return self.resistance(place, "Rd", name, Rd, chamber, end, true);
        }
        positive(place, "Rp", Rp)?;
        positive(place, "C", C)?;
        let kind = Kind::Rcr { proximal: Rp, compliance: C, distal: Rd, venous: Pd };
        let element = self.network.add(name, kind, node, GROUND);
        self.unknowns.push(Unknown { name: format!("Rd_{element}"), unit: RESISTANCE, value: Rd });
        self.channels.push((format!("q_{element}"), FLOW));
        Ok(())
    }

    fn coronary(&mut self, place: &str, name: &str, values: Coronary, node: Node) -> Result<(), String> {
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

    fn course(&mut self, place: &str, name: String, times: Vec<f64>, values: Vec<f64>) -> Result<(), String> {
        let course = Samples { name, times, values };
        if let Some(fault) = course.fault() {
            return Err(format!("{place}: {fault}"));
        }
        self.courses.push(course);
        Ok(())
    }
}

fn positive(place: &str, key: &str, value: f64) -> Result<(), String> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(format!("{place}.{key}: {value} is not above zero"))
    }
}

/// The largest flow that sources can bring together; nothing where a pressure drives the network.
fn largest_flow(file: &File) -> Result<Option<f64>, String> {
    let mut sum = 0.0;
    for (i, boundary) in file.boundary_conditions.iter().enumerate() {
        if boundary.bc_type == "FLOW" {
            let place = format!("boundary_conditions[{i}].bc_values");
            let Flow { Q, .. } = typed(&place, &boundary.bc_values)?;
            sum += Q.iter().fold(0.0, |most: f64, q| most.max(q.abs()));
        }
    }
    Ok((sum > 0.0).then_some(sum))
}
