//! Input files of openBF (Melis 2017) as networks of `artery-1d`.
//!
//! Next files to read: [`file`] for what is read, [`vessel`] for one vessel.

mod file;
mod vessel;

use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use super::plan::{Course, Inputs, Origin, Plan, Samples, Unknown};
use crate::names::Names;
use file::{File, Vessel};

/// Reads a file and the inflow that it names.
pub(super) fn plan(path: &Path, text: &str) -> Result<Plan, String> {
    let file = file::read(text)?;
    let inflow = inflow(path, &file)?;
    let period = inflow.times[inflow.times.len() - 1];
    let parts = Parts::new(&file)?;
    let points = file.solver.jump.unwrap_or(100);
    if points < 2 {
        return Err("solver.jump: give at least 2".to_owned());
    }
    Ok(Plan {
        name: Names::default().take(&file.project_name),
        program: "openBF",
        kind: "artery-1d",
        layout: format!("segments = [\n{}]\nnodes = [\n{}]\n", parts.segments, parts.nodes),
        constants: parts.constants,
        unknowns: parts.unknowns,
        channels: parts.channels,
        inputs: Inputs::new(&[inflow], period),
        points,
        course: course(&file, &parts.middles)?,
        initial: Vec::new(),
        omissions: Vec::new(),
        notes: parts.notes,
    })
}

/// What the vessels give, one after another.
struct Parts {
    /// Lines of the layout.
    segments: String,
    nodes: String,
    constants: Vec<(String, f64)>,
    unknowns: Vec<Unknown>,
    channels: Vec<(String, &'static str)>,
    /// Outputs with the pressure in the middle of each vessel.
    middles: Vec<String>,
    notes: Vec<String>,
    /// Vessels that taper, those of them whose thickness is openBF's fit, and those with one resistance at their outlet.
    tapering: Vec<String>,
    fitted: Vec<String>,
    single: Vec<String>,
    n_cell: usize,
    names: Names,
}

impl Parts {
    fn new(file: &File) -> Result<Self, String> {
        once_each(&file.network)?;
        let (inlet, outlets) = ends(&file.network)?;
        let mut parts = Self {
            segments: String::new(),
            nodes: format!("    {{ name = \"{}\", kind = \"inlet\" }},\n", node(inlet)),
            constants: shared(file)?,
            unknowns: Vec::new(),
            channels: vec![("inlet_pressure".to_owned(), "dyn/cm^2")],
            middles: Vec::new(),
            notes: Vec::new(),
            tapering: Vec::new(),
            fitted: Vec::new(),
            single: Vec::new(),
            n_cell: 0,
            names: Names::default(),
        };
        for vessel in &file.network {
            parts.segment(vessel, file.network.len() == 1)?;
            if outlets.contains(&vessel.tn) {
                parts.outlet(vessel, file.blood.rho, outlets.len() == 1)?;
            } else {
                vessel.inner()?;
            }
        }
        parts.tell();
        Ok(parts)
    }

    /// Tells in a sentence each what holds for several vessels.
    fn tell(&mut self) {
        let sentences = [
            (
                &self.tapering,
                "tapers: openBF takes the change of the radius from cell to cell for one per metre and so computes a vessel of \
             almost the radius at its start; the study follows the file",
            ),
            (
                &self.fitted,
                "tapers and has no thickness: that of openBF's fit stands at its ends, and is linear in between",
            ),
            (
                &self.single,
                "has R1 and no R2: as in openBF, R1 stands before the compliance, and R1 less the impedance of the vessel behind it",
            ),
        ];
        for (vessels, sentence) in sentences {
            if let Some((first, others)) = vessels.split_first() {
                let others =
                    if others.is_empty() { String::new() } else { format!(" (and {} others)", others.len()) };
                self.notes.push(format!("`{first}`{others} {sentence}"));
            }
        }
    }

    /// Adds a vessel.
    fn segment(&mut self, vessel: &Vessel, alone: bool) -> Result<(), String> {
        let artery = vessel.artery()?;
        let name = self.names.take(&vessel.label);
        // openBF compares periods at cell round(M/2) of every vessel.
        self.middles.push(format!("pressure[{}]", self.n_cell + (artery.cells - 1) / 2));
        self.n_cell += artery.cells;
        let young = if alone { "E1".to_owned() } else { format!("E_{name}") };
        self.constants.push((young, artery.young));
        if artery.radius[0].to_bits() != artery.radius[1].to_bits() {
            self.tapering.push(name.clone());
            if vessel.h0.is_none() {
                self.fitted.push(name.clone());
            }
        }
        // Writing to a text cannot fail.
        let _ = writeln!(
            self.segments,
            "    {{ name = \"{name}\", from = \"{}\", to = \"{}\", length = {:?}, radius = {:?}, radius_to = {:?}, \
             thickness = {:?}, thickness_to = {:?}, profile = {:?}, cells = {} }},",
            node(vessel.sn),
            node(vessel.tn),
            tidy(artery.length),
            tidy(artery.radius[0]),
            tidy(artery.radius[1]),
            tidy(artery.thickness[0]),
            tidy(artery.thickness[1]),
            artery.profile,
            artery.cells
        );
        Ok(())
    }

    /// Adds the Windkessel behind a vessel.
    fn outlet(&mut self, vessel: &Vessel, density: f64, alone: bool) -> Result<(), String> {
        let windkessel = vessel.windkessel(density)?;
        if windkessel.alone {
            self.single.push(vessel.label.clone());
        }
        let own = |stem: &str| if alone { stem.to_owned() } else { format!("{stem}_{}", node(vessel.tn)) };
        let _ = writeln!(self.nodes, "    {{ name = \"{}\", kind = \"rcr\" }},", node(vessel.tn));
        self.constants.push((own("R_p"), tidy(windkessel.proximal)));
        self.constants.push((own("C"), tidy(windkessel.compliance)));
        let value = tidy(windkessel.distal);
        self.unknowns.push(Unknown { name: own("R_d"), unit: "dyn s/cm^5", value });
        self.channels.push((own("outflow"), "cm^3/s"));
        Ok(())
    }
}

/// From rest until the mean pressures of two periods are as near as the file asks, or for as many periods as it says.
fn course(file: &File, middles: &[String]) -> Result<Course, String> {
    let cycles = file.solver.cycles;
    if cycles == 0 {
        return Err("solver.cycles: give at least 1".to_owned());
    }
    // In mmHg in the file.
    let settled = file.solver.convergence_tolerance.map(|most| (middles.to_vec(), 1333.32 * most));
    Ok(Course { from: Origin::Rest, cycles, all: false, settled })
}

fn node(number: i64) -> String {
    format!("node_{}", number.to_string().replace('-', "m"))
}

/// Without the digits that a change of units leaves behind.
fn tidy(value: f64) -> f64 {
    format!("{value:.14e}").parse().unwrap_or(value)
}

/// Parameters that all vessels share, in cgs units.
fn shared(file: &File) -> Result<Vec<(String, f64)>, String> {
    let first = file.network.first().ok_or("network: there is no vessel")?;
    let outside = first.Pext;
    if let Some(other) = file.network.iter().find(|vessel| vessel.Pext.to_bits() != outside.to_bits()) {
        return Err(format!(
            "vessel `{}`: Pext is {} and that of `{}` {outside}: `artery-1d` has one pressure around all vessels",
            other.label, other.Pext, first.label
        ));
    }
    let constants = [
        ("rho_f", 1e-3 * file.blood.rho),
        ("mu", 10.0 * file.blood.mu),
        ("nu", 0.5),
        ("alpha", 1.0),
        ("c_w", 0.0),
        ("k_s", 0.0),
        ("c_s", 0.0),
        ("p_ext", 10.0 * outside),
        ("p_venous", 10.0 * behind(&file.network)?),
        ("p0", 10.0 * outside),
    ];
    Ok(constants.map(|(name, value)| (name.to_owned(), tidy(value))).to_vec())
}

/// The pressure behind all Windkessels, in Pa.
fn behind(vessels: &[Vessel]) -> Result<f64, String> {
    let mut outlets = vessels.iter().filter(|vessel| vessel.Cc.is_some());
    let Some(first) = outlets.next() else { return Ok(0.0) };
    match outlets.find(|vessel| vessel.Pout.partial_cmp(&first.Pout) != Some(Ordering::Equal)) {
        None if first.Pout.is_finite() => Ok(first.Pout),
        None => Err(format!("vessel `{}`: Pout is {}: give a pressure", first.label, first.Pout)),
        Some(other) => Err(format!(
            "vessel `{}`: Pout is {} and that of `{}` {}: `artery-1d` has one pressure behind all Windkessels",
            other.label, other.Pout, first.label, first.Pout
        )),
    }
}

/// Refuses vessels of one label.
fn once_each(vessels: &[Vessel]) -> Result<(), String> {
    for (i, vessel) in vessels.iter().enumerate() {
        if let Some(first) = vessels[..i].iter().position(|other| other.label == vessel.label) {
            return Err(format!(
                "network[{i}]: the label `{}` is that of network[{first}] as well: give each vessel its own",
                vessel.label
            ));
        }
    }
    Ok(())
}

/// The node at which the flow enters, and those at which it leaves.
fn ends(vessels: &[Vessel]) -> Result<(i64, BTreeSet<i64>), String> {
    let starts: BTreeSet<i64> = vessels.iter().map(|vessel| vessel.sn).collect();
    let stops: BTreeSet<i64> = vessels.iter().map(|vessel| vessel.tn).collect();
    let inlets: Vec<i64> = starts.difference(&stops).copied().collect();
    let outlets: BTreeSet<i64> = stops.difference(&starts).copied().collect();
    for outlet in &outlets {
        if vessels.iter().filter(|vessel| vessel.tn == *outlet).count() > 1 {
            return Err(format!("node {outlet}: several vessels end there and none begins"));
        }
    }
    match inlets[..] {
        [inlet] => Ok((inlet, outlets)),
        [] => Err("no node is only the start of vessels: there is none where the flow enters".to_owned()),
        [first, second, ..] => Err(format!(
            "nodes {first} and {second} are only starts of vessels: the file names one inflow, and does not say what enters \
             at another; let the vessel from node {second} begin where another one ends, or give both flows in a study of `artery-1d`"
        )),
    }
}

/// The inflow in cm³/s.
fn inflow(path: &Path, file: &File) -> Result<Samples, String> {
    let name = file.inlet_file.clone().unwrap_or_else(|| format!("{}_inlet.dat", file.project_name));
    let at = path.parent().unwrap_or(Path::new("")).join(&name);
    let text = std::fs::read_to_string(&at)
        .map_err(|error| format!("the inflow {} cannot be read: {error}", at.display()))?;
    let (times, flows) = file::inflow(&text).map_err(|fault| format!("the inflow {name}: {fault}"))?;
    let values = flows.iter().map(|flow| 1e6 * flow).collect();
    let course = Samples { name: "flow".to_owned(), times, values };
    match course.fault() {
        Some(fault) => Err(format!("the inflow {name}: {fault}")),
        None => Ok(course),
    }
}
