//! What the motor along its bore says of itself: states, parameters, outputs and inputs, in SI units.
//!
//! Next file to read: [`super::motor`], which reads the parameters in this order.

use starlings_models_core::{Quantity, Role, Spec};

use super::faults::Fault;
use super::layout::Layout;

/// Number of parameters that every motor has; those of the throat follow, then those of the faults.
pub(super) const N_SHARED: usize = 11;

/// The specification of a motor.
pub(super) fn spec(layout: &Layout) -> Spec {
    let mut parameters = shared();
    parameters.extend(layout.throat.parameters());
    parameters.extend(layout.faults.iter().flat_map(|fault| fault.parameters()));
    Spec {
        kind: "rocket-motor-1d".to_owned(),
        says: "Gas dynamics along the burning bore of a solid rocket motor, with a nozzle at its end."
            .to_owned(),
        states: states(layout.cells),
        parameters,
        outputs: outputs(layout),
        inputs: layout.throat.inputs(),
        measures: vec![("mass_flux".to_owned(), "rho_u".to_owned())],
        restart: true,
    }
}

fn states(n: usize) -> Vec<Quantity> {
    vec![
        Quantity::new("rho", "kg/m^3").size(n).says("Density of the gas in each cell."),
        Quantity::new("rho_u", "kg/(m^2 s)")
            .size(n)
            .says("Mass flux in each cell, positive towards the nozzle."),
        Quantity::new("E", "J/m^3").size(n).says("Energy of the gas in each cell per volume."),
        Quantity::new("R", "m").size(n).says("Radius of the bore in each cell."),
    ]
}

fn outputs(layout: &Layout) -> Vec<Quantity> {
    let n = layout.cells;
    let pressure = |name: &str, says: &str| Quantity::new(name, "Pa").role(Role::Pressure).says(says);
    let mut all = vec![
        pressure("pressure", "Pressure in each cell.").size(n),
        Quantity::new("mass_flux", "kg/(m^2 s)").size(n).says("Mass flux in each cell."),
        Quantity::new("radius", "m").size(n).says("Radius of the bore in each cell."),
        pressure("head_pressure", "Pressure in the cell at the head end."),
        pressure("nozzle_pressure", "Stagnation pressure at the nozzle."),
        Quantity::new("mass_flow", "kg/s").says("Mass flow through the nozzle."),
        Quantity::new("thrust", "N").role(Role::Thrust).says("Thrust in a vacuum."),
    ];
    if layout.faults.contains(&Fault::Breach) {
        all.push(Quantity::new("breach_flow", "kg/s").says("Mass flow through a hole in the case."));
    }
    all
}

fn shared() -> Vec<Quantity> {
    let positive = |name: &str, unit: &str, default: f64, says: &str| {
        Quantity::new(name, unit).positive().default(default).says(says)
    };
    vec![
        positive("gamma", "", 1.2, "Ratio of the heat capacities of the gas.").range(1.0 + 1e-6, 5.0 / 3.0),
        positive("n", "", 0.4, "Exponent of the burning rate, r_c (p/p_c)^n.").range(0.0, 1.0 - 1e-6),
        positive("r_c", "m/s", 0.005, "Burning rate at the pressure p_c.").role(Role::BurnRate),
        positive("p_c", "Pa", 1.44e6, "Pressure to which the burning rate refers."),
        positive("rho_p", "kg/m^3", 1750.0, "Density of the propellant."),
        positive("c_0", "m/s", 1030.0, "Speed of sound in the gas that the propellant gives, at rest."),
        positive("A_t", "m^2", 1.1825e-3, "Area of the throat.").role(Role::ThroatArea),
        positive("R_0", "m", 0.05, "Radius of the bore at the start."),
        positive("L", "m", 1.0, "Length of the bore."),
        positive("R_e", "m", 0.15, "Outer radius of the grain, at which it has burnt out."),
        positive("C_F", "", 1.5, "Thrust coefficient in a vacuum."),
    ]
}
