//! Boundary conditions of a file as elements of a network, and what joins its blocks.
//!
//! The equations are those of the documentation of svZeroDSolver. Next files to read: [`super::vessels`], [`super::signal`],
//! [`super::junctions`] and [`super::heart`], then [`super::network`].

use std::collections::BTreeMap;

use super::super::plan::{Samples, Unknown};
use super::activation::Shape;
use super::file::{Boundary, File, Given, Resistance, typed};
use super::formula::Formula;
use super::heart::HeartNodes;
use super::names;
use super::network::{GROUND, Kind, Network, Node, Series};

/// Labels of flows and resistances in cgs units.
pub(super) const FLOW: &str = "cm^3/s";
const PRESSURE: &str = "dyn/cm^2";
pub(super) const RESISTANCE: &str = "dyn s/cm^5";

/// A network on its way, with what a study needs besides.
#[derive(Debug)]
pub(super) struct Blocks {
    pub(super) network: Network,
    pub(super) courses: Vec<Samples>,
    /// Inputs that are expressions, with their places.
    pub(super) formulas: Vec<(String, Formula, String)>,
    pub(super) channels: Vec<(String, &'static str)>,
    pub(super) unknowns: Vec<Unknown>,
    /// Inlet and outlet of every vessel, by its name; nothing where nothing is joined yet.
    pub(super) ends: BTreeMap<String, [Option<Node>; 2]>,
    /// Inlet and outlet of every chamber, by its name.
    pub(super) chambers: BTreeMap<String, [Node; 2]>,
    /// What boundary conditions join of a closed loop.
    pub(super) heart: Option<HeartNodes>,
    /// Inputs that are activations.
    pub(super) activations: Vec<(String, Shape)>,
    /// States by the names that an initial condition has for them.
    pub(super) states: BTreeMap<String, String>,
    /// The period that a closed loop gives, and where.
    pub(super) period: Option<(f64, String)>,
    /// Vessels that are nothing but a joint, with their ends.
    pub(super) passed: Vec<(String, [Node; 2])>,
    /// Where boundary conditions are.
    places: BTreeMap<String, (Node, Side)>,
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
            formulas: Vec::new(),
            channels: Vec::new(),
            unknowns: Vec::new(),
            ends: BTreeMap::new(),
            chambers: BTreeMap::new(),
            heart: None,
            activations: Vec::new(),
            states: BTreeMap::new(),
            period: None,
            passed: Vec::new(),
            places: BTreeMap::new(),
        };
        names::check(file)?;
        blocks.vessel_ends(file)?;
        blocks.chambers(file)?;
        for (i, junction) in file.junctions.iter().enumerate() {
            blocks.junction(file, junction, &format!("junctions[{i}]"))?;
        }
        for (i, valve) in file.valves.iter().enumerate() {
            blocks.valve(valve, &format!("valves[{i}]"))?;
        }
        for (i, vessel) in file.vessels.iter().enumerate() {
            blocks.vessel(vessel, &format!("vessels[{i}]"))?;
        }
        blocks.tell_passed();
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

    /// Joins the boundary conditions that vessels name.
    fn vessel_ends(&mut self, file: &File) -> Result<(), String> {
        for vessel in &file.vessels {
            if self.ends.insert(vessel.vessel_name.clone(), [None, None]).is_some() {
                return Err(format!("two vessels are called `{}`", vessel.vessel_name));
            }
            for (end, (name, side)) in [
                (&vessel.boundary_conditions.inlet, ("in", Side::Inlet)),
                (&vessel.boundary_conditions.outlet, ("out", Side::Outlet)),
            ] {
                let Some(boundary) = end else { continue };
                let node = self.network.node(&format!("{}_{name}", vessel.vessel_name));
                self.join(&vessel.vessel_name, side, node)?;
                self.place(boundary, node, side)?;
            }
        }
        Ok(())
    }

    /// Joins a block to a node: a vessel's or a chamber's end, else a boundary condition.
    pub(super) fn attach(&mut self, block: &str, side: Side, node: Node) -> Result<(), String> {
        if let Some([inlet, outlet]) = self.chambers.get(block) {
            self.network.merge(node, if side == Side::Inlet { *inlet } else { *outlet });
            return Ok(());
        }
        if self.ends.contains_key(block) {
            return self.join(block, side, node);
        }
        // What flows out of a boundary condition enters the network.
        self.place(block, node, if side == Side::Outlet { Side::Inlet } else { Side::Outlet })
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
    pub(super) fn of(resistance: f64, stenosis: f64, inertance: f64) -> Series {
        Series { resistance, stenosis, capacity: 0.0, inertance }
    }

    fn boundary(&mut self, boundary: &Boundary, place: &str) -> Result<(), String> {
        let (name, values) = (boundary.bc_name.as_str(), &boundary.bc_values);
        let own = format!("{place}.bc_values");
        let known = [
            "FLOW",
            "PRESSURE",
            "RESISTANCE",
            "RCR",
            "CORONARY",
            "ClosedLoopRCR",
            "ClosedLoopCoronaryLeft",
            "ClosedLoopCoronaryRight",
        ];
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
                let given = Given::read(&own, "Q", values)?;
                let (from, to) = if side == Side::Inlet { (GROUND, node) } else { (node, GROUND) };
                let element = self.network.add(name, Kind::Flow, from, to);
                self.signal(&own, "Q", element, given)?;
                self.channels.push((format!("p_{}", self.network.name(node)), PRESSURE));
            }
            "PRESSURE" => {
                let given = Given::read(&own, "P", values)?;
                let element = self.network.add(name, Kind::Pressure, GROUND, node);
                self.signal(&own, "P", element.clone(), given)?;
                self.channels.push((format!("q_{element}"), FLOW));
            }
            "RESISTANCE" => {
                let Resistance { R, Pd } = typed(&own, values)?;
                let end = self.network.constant(name, Pd);
                self.resistance(&own, "R", name, R, node, end, true)?;
            }
            "RCR" => self.rcr(&own, name, &typed(&own, values)?, node)?,
            "ClosedLoopRCR" => self.closed_rcr(&own, name, &typed(&own, values)?, node)?,
            side @ ("ClosedLoopCoronaryLeft" | "ClosedLoopCoronaryRight") => {
                let left = side.ends_with("Left");
                self.closed_coronary(&own, name, &typed(&own, values)?, (node, left))?;
            }
            _ => self.coronary(&own, name, typed(&own, values)?, node)?,
        }
        Ok(())
    }
}

pub(super) fn positive(place: &str, key: &str, value: f64) -> Result<(), String> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(format!("{place}.{key}: {value} is not above zero"))
    }
}
