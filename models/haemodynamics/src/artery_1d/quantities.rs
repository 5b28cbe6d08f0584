//! What the arterial network says of itself: states, parameters, outputs and its input, in cgs units.
//!
//! Next file to read: [`super::vessels`], which reads the parameters in this order.

use starlings_models_core::{Quantity, Role, Spec};

use super::layout::{NodeKind, StiffnessParameter};
use super::network::Network;
use super::shear::TERMS;
use super::stenosis::{MOST_SEVERE, TURBULENT, UNSTEADY};

/// Young's modulus of an artery in dyn/cm².
const YOUNG: f64 = 5e6;
/// 80 mmHg in dyn/cm².
const DIASTOLIC: f64 = 80.0 * 1333.22;
const PRESSURE: &str = "dyn/cm^2";
const FLOW: &str = "cm^3/s";

/// The specification of a network.
pub(super) fn spec(network: &Network) -> Spec {
    Spec {
        kind: "artery-1d".to_owned(),
        says:
            "Nonlinear waves of area and flow in a network of tapering viscoelastic vessels with RCR outlets."
                .to_owned(),
        states: states(network),
        parameters: parameters(network),
        outputs: outputs(network),
        inputs: inputs(network),
        measures: vec![("flow_rate".to_owned(), "Q".to_owned())],
        restart: true,
    }
}

/// `stem` for the only one of `nodes`, `stem_<node>` for one of several.
fn of(nodes: &[usize], network: &Network, stem: &str, node: usize) -> String {
    if nodes.len() == 1 { stem.to_owned() } else { format!("{stem}_{}", network.nodes[node].name) }
}

/// `stem` for the only outlet, `stem_<node>` for one of several.
pub(super) fn named(network: &Network, stem: &str, node: usize) -> String {
    of(&network.outlets, network, stem, node)
}

fn inputs(network: &Network) -> Vec<Quantity> {
    let flow = |&node: &usize| {
        let (name, alone) = (&network.nodes[node].name, network.inlets.len() == 1);
        let says = if alone { "Volume flow into the inlet." } else { &format!("Volume flow into `{name}`.") };
        Quantity::new(&of(&network.inlets, network, "flow", node), FLOW).role(Role::Flow).says(says)
    };
    network.inlets.iter().map(flow).collect()
}

fn states(network: &Network) -> Vec<Quantity> {
    let n = network.n_cell;
    let mut all = vec![
        Quantity::new("A", "cm^2").size(n).says("Cross-section of the vessels in each cell."),
        Quantity::new("Q", FLOW).size(n).role(Role::Flow).says("Volume flow in each cell."),
    ];
    let windkessels = network.outlets.iter().filter(|&&node| network.nodes[node].kind == NodeKind::Rcr);
    all.extend(windkessels.map(|&node| {
        Quantity::new(&named(network, "pi", node), PRESSURE)
            .role(Role::Pressure)
            .says(&format!("Pressure in the Windkessel at `{}`.", network.nodes[node].name))
    }));
    all.extend(stenoses(network).map(|(node, name)| {
        Quantity::new(&narrowed(network, "q", node), FLOW).role(Role::Flow).says(&format!(
            "Volume flow through the stenosis `{name}`, out of the segment that is listed first."
        ))
    }));
    if network.n_memory > 0 {
        let memory = Quantity::new("w", "cm/s").size(TERMS.len() * network.n_memory);
        all.push(memory.says(
            "Past velocities that the wall shear remembers, ten parts in each cell with that friction.",
        ));
    }
    all
}

/// Nodes and names of the stenoses.
fn stenoses(network: &Network) -> impl Iterator<Item = (usize, &str)> {
    network.narrowings.iter().map(|n| n.nodes[0]).map(|node| (node, network.nodes[node].name.as_str()))
}

/// `stem` for the only stenosis, `stem_<node>` for one of several.
fn narrowed(network: &Network, stem: &str, node: usize) -> String {
    let nodes: Vec<usize> = stenoses(network).map(|(node, _)| node).collect();
    of(&nodes, network, stem, node)
}

fn stenosis(network: &Network, (node, name): (usize, &str)) -> [Quantity; 3] {
    let quantity = |stem: &str| Quantity::new(&narrowed(network, stem, node), "");
    let says = |what: &str| format!("{what} of the stenosis `{name}`.");
    [
        quantity("severity")
            .range(0.0, MOST_SEVERE)
            .default(0.5)
            .says(&says("Part of the area that is missing, 1 − As/A0,")),
        quantity("K_t")
            .range(0.0, f64::INFINITY)
            .default(TURBULENT)
            .says(&says("Young and Tsai's constant of turbulence")),
        quantity("K_u").positive().default(UNSTEADY).says(&says("Young and Tsai's constant of inertia")),
    ]
}

fn parameters(network: &Network) -> Vec<Quantity> {
    let stiffness = |StiffnessParameter { name, place, of_law }: &StiffnessParameter| {
        let (unit, default) = if *of_law { ("", 1.0) } else { (PRESSURE, YOUNG) };
        let says = if *of_law {
            format!("Stiffness of {place}, as a multiple of what its law says.")
        } else {
            format!("Young's modulus of {place}.")
        };
        Quantity::new(name, unit).role(Role::Stiffness).positive().default(default).says(&says)
    };
    let mut all: Vec<Quantity> = network.stiffnesses.iter().map(stiffness).collect();
    all.extend(shared());
    for &node in &network.outlets {
        all.extend(outlet(network, node));
    }
    all.extend(stenoses(network).flat_map(|which| stenosis(network, which)));
    all
}

/// What all vessels share.
fn shared() -> [Quantity; 10] {
    let not_negative = |name: &str, unit: &str, default: f64| {
        Quantity::new(name, unit).range(0.0, f64::INFINITY).default(default)
    };
    let pressure =
        |name: &str, default: f64| Quantity::new(name, PRESSURE).role(Role::Pressure).default(default);
    [
        Quantity::new("rho_f", "g/cm^3").positive().default(1.06).says("Density of the blood."),
        not_negative("mu", "P", 0.035).says("Viscosity of the blood."),
        Quantity::new("nu", "").range(0.0, 0.5).default(0.5).says("Poisson's ratio of the wall."),
        Quantity::new("alpha", "")
            .range(1.0, 4.0 / 3.0)
            .default(1.0)
            .says("Momentum coefficient: 1 for a flat velocity profile, 4/3 for a parabola."),
        not_negative("c_w", "dyn s/cm^3", 2e3).role(Role::Damping).says("Viscosity of the wall."),
        not_negative("k_s", "dyn/cm^3", 0.0)
            .role(Role::Stiffness)
            .says("Stiffness of the tissue around the vessels."),
        not_negative("c_s", "dyn s/cm^3", 0.0)
            .role(Role::Damping)
            .says("Viscosity of the tissue around the vessels."),
        pressure("p_ext", 0.0).says("Pressure around the vessels."),
        pressure("p_venous", 0.0).says("Pressure beyond the outlets."),
        pressure("p0", DIASTOLIC).says("Pressure at which the network rests initially."),
    ]
}

fn outlet(network: &Network, node: usize) -> Vec<Quantity> {
    let (name, kind) = (&network.nodes[node].name, network.nodes[node].kind);
    let resistance = |stem: &str, default: f64| {
        Quantity::new(&named(network, stem, node), "dyn s/cm^5").role(Role::Resistance).default(default)
    };
    if kind == NodeKind::Resistance {
        return vec![
            resistance("R_out", 2000.0).range(0.0, f64::INFINITY).says(&format!("Resistance of `{name}`.")),
        ];
    }
    let compliance = Quantity::new(&named(network, "C", node), "cm^5/dyn").role(Role::Compliance).positive();
    vec![
        resistance("R_p", 150.0).range(0.0, f64::INFINITY).says(&format!("Proximal resistance of `{name}`.")),
        resistance("R_d", 1850.0).positive().says(&format!("Distal resistance of `{name}`.")),
        compliance.default(1e-3).says(&format!("Compliance of `{name}`.")),
    ]
}

fn outputs(network: &Network) -> Vec<Quantity> {
    let n = network.n_cell;
    let field = |name: &str, unit: &str, role: Role| Quantity::new(name, unit).size(n).role(role);
    let mut all = vec![
        field("displacement", "cm", Role::Displacement).says("R − R0 in each cell."),
        field("pressure", PRESSURE, Role::Pressure).says("Pressure in each cell."),
        field("flow_rate", FLOW, Role::Flow).says("Volume flow in each cell."),
    ];
    for &node in &network.inlets {
        let (name, alone) = (&network.nodes[node].name, network.inlets.len() == 1);
        let says = if alone { "Pressure at the inlet." } else { &format!("Pressure at `{name}`.") };
        let quantity = Quantity::new(&of(&network.inlets, network, "inlet_pressure", node), PRESSURE);
        all.push(quantity.role(Role::Pressure).says(says));
    }
    for &node in &network.outlets {
        let name = &network.nodes[node].name;
        all.push(
            Quantity::new(&named(network, "outlet_pressure", node), PRESSURE)
                .role(Role::Pressure)
                .says(&format!("Pressure at `{name}`.")),
        );
        all.push(
            Quantity::new(&named(network, "outflow", node), FLOW)
                .role(Role::Flow)
                .says(&format!("Volume flow out of `{name}`.")),
        );
    }
    all.extend(stenoses(network).map(|(node, name)| {
        Quantity::new(&narrowed(network, "pressure_drop", node), PRESSURE)
            .role(Role::Pressure)
            .says(&format!("Total pressure p + ½ρu² before the stenosis `{name}` less that behind it."))
    }));
    all.push(Quantity::new("strain", "").size(n).says("Circumferential strain of the wall in each cell."));
    all.push(
        Quantity::new("stress", PRESSURE)
            .size(n)
            .says("Circumferential stress of the wall in each cell, elastic and viscous."),
    );
    all
}
