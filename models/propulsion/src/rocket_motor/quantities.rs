//! What the lumped motor says of itself: states, parameters, outputs and inputs in the units of its layout.
//!
//! Next file to read: [`super::chamber`], which reads the parameters in this order.

use starlings_models_core::{Quantity, Role, Spec};

use super::layout::{Layout, Units};
use crate::throat::Throat;

/// The specification of a motor.
pub(super) fn spec(layout: &Layout) -> Spec {
    let same = |output: &str, state: &str| (output.to_owned(), state.to_owned());
    Spec {
        kind: "rocket-motor".to_owned(),
        says: "A solid rocket motor whose chamber is one volume of gas, with a burning grain and a choked throat."
            .to_owned(),
        states: states(layout.units),
        parameters: parameters(layout),
        outputs: outputs(layout),
        inputs: layout.throat.inputs(),
        measures: vec![same("pressure", "p"), same("density", "rho")],
        restart: true,
    }
}

/// Units of pressure, density, length, area and force.
fn labels(units: Units) -> [&'static str; 5] {
    match units {
        Units::Si => ["Pa", "kg/m^3", "m", "m^2", "N"],
        Units::Scaled => [""; 5],
    }
}

fn states(units: Units) -> Vec<Quantity> {
    let [pressure, density, length, ..] = labels(units);
    vec![
        Quantity::new("p", pressure).role(Role::Pressure).says("Pressure of the gas in the chamber."),
        Quantity::new("rho", density).says("Density of the gas in the chamber."),
        Quantity::new("R", length)
            .role(Role::Web)
            .says("Radius of the bore; with a table, its first one and the distance burnt."),
    ]
}

fn outputs(layout: &Layout) -> Vec<Quantity> {
    let units = layout.units;
    let [pressure, density, length, area, force] = labels(units);
    let flow = if units == Units::Si { "kg/s" } else { "1/s" };
    let mut all = vec![
        Quantity::new("pressure", pressure).role(Role::Pressure).says("Pressure in the chamber."),
        Quantity::new("density", density).says("Density of the gas in the chamber."),
        Quantity::new("radius", length).says("Radius of the bore."),
        Quantity::new("mass_flow", flow).says("Mass flow through the throat."),
        Quantity::new("thrust", force).role(Role::Thrust).says("Thrust in a vacuum."),
    ];
    if layout.throat != Throat::Steady {
        let says = "Area of the throat, over the one at the start in scaled units.";
        all.push(Quantity::new("throat_area", area).says(says));
    }
    all
}

fn parameters(layout: &Layout) -> Vec<Quantity> {
    let mut all = match layout.units {
        Units::Si => si(),
        Units::Scaled => scaled(),
    };
    all.extend(shared(layout.units));
    all.extend(layout.throat.parameters());
    if layout.noise.is_some() {
        let [pressure, density, ..] = labels(layout.units);
        let amplitude = |name: &str, unit: &str, says: &str| {
            let unit = if unit.is_empty() { "1/s^0.5".to_owned() } else { format!("{unit}/s^0.5") };
            Quantity::new(name, &unit).range(0.0, f64::INFINITY).default(0.0).says(says)
        };
        all.push(amplitude(
            "d_p",
            pressure,
            "Amplitude of the noise of the pressure, the root of its diffusion.",
        ));
        all.push(amplitude(
            "d_rho",
            density,
            "Amplitude of the noise of the density, the root of its diffusion.",
        ));
    }
    all
}

/// Number of parameters that every motor has.
pub(super) const N_SHARED: usize = 13;

fn gas(exponent_says: &str) -> [Quantity; 2] {
    [
        Quantity::new("gamma", "")
            .range(1.0 + 1e-6, 5.0 / 3.0)
            .default(1.2)
            .says("Ratio of the heat capacities of the gas."),
        Quantity::new("n", "").range(0.0, 1.0 - 1e-6).default(0.4).says(exponent_says),
    ]
}

const EXPONENT: &str = "Exponent of the burning rate, r_c (p/p_c)^n.";

/// The first nine parameters in SI units.
fn si() -> Vec<Quantity> {
    let positive = |name: &str, unit: &str, default: f64, says: &str| {
        Quantity::new(name, unit).positive().default(default).says(says)
    };
    let mut all = gas(EXPONENT).to_vec();
    all.extend([
        positive("r_c", "m/s", 0.005, "Burning rate at the pressure p_c.").role(Role::BurnRate),
        positive(
            "p_c",
            "Pa",
            1.44e6,
            "Pressure to which the burning rate refers, and that of the chamber at the start.",
        ),
        positive("rho_p", "kg/m^3", 1750.0, "Density of the propellant."),
        positive("c_0", "m/s", 1030.0, "Speed of sound in the gas that the propellant gives."),
        positive("A_t", "m^2", 1.1825e-3, "Area of the throat.").role(Role::ThroatArea),
        positive("R_0", "m", 0.05, "Radius of the bore at the start."),
        positive("L", "m", 1.0, "Length of the bore."),
    ]);
    all
}

/// The first nine parameters in scaled units; those that are fixed there stand at one.
fn scaled() -> Vec<Quantity> {
    let positive = |name: &str, unit: &str, default: f64, says: &str| {
        Quantity::new(name, unit).positive().default(default).says(says)
    };
    let mut all = gas("Exponent of the burning rate, kappa p^n.").to_vec();
    all.extend([
        positive("kappa", "1/s", 0.1, "Burning rate at a pressure of one, in first radii of the bore."),
        positive("p_c", "", 1.0, "Pressure of the chamber at the start."),
        positive("rho_p", "", 1073.06, "Density of the propellant."),
        positive("rho_c", "", 1.0, "Density of the gas at the start."),
        positive("a", "", 1101.75, "Outflow: gamma Gamma c_0 A_t R_0/(r_c V_0).").role(Role::ThroatArea),
        positive("R_0", "", 1.0, "Radius of the bore at the start."),
        positive("V_0", "", 1.0, "Free volume at the start; the burning surface of a bore is 2 V_0/R_0."),
    ]);
    all
}

/// The parameters after those.
fn shared(units: Units) -> Vec<Quantity> {
    let [pressure, _, length, ..] = labels(units);
    let (outer, air) = match units {
        Units::Si => (0.15, 101_325.0),
        Units::Scaled => (3.0, 0.0),
    };
    vec![
        Quantity::new("R_e", length)
            .positive()
            .default(outer)
            .says("Outer radius of the grain, at which it has burnt out."),
        Quantity::new("k_A", "")
            .range(0.0, f64::INFINITY)
            .role(Role::BurnArea)
            .default(1.0)
            .says("Factor on the burning surface."),
        Quantity::new("C_F", "").positive().default(1.5).says("Thrust coefficient in a vacuum."),
        Quantity::new("p_a", pressure)
            .range(0.0, f64::INFINITY)
            .default(air)
            .says("Pressure of the air outside."),
    ]
}
