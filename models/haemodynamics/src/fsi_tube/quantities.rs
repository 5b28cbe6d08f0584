//! What the tube says of itself: states, parameters, outputs and its input, in cgs units.
//!
//! Next file to read: [`super::coefficients`], which reads the parameters in this order.

use starlings_models_core::{Quantity, Role, Spec};

use super::layout::Part;

/// Diastolic initial pressure of the Windkessel: 80 mmHg in dyn/cm².
const INITIAL_PRESSURE: f64 = 80.0 * 1333.22;

/// Length of the tube in cm, unless a study says otherwise.
pub(super) const LENGTH: f64 = 25.0;

/// Young's modulus of an artery in dyn/cm².
const YOUNG: f64 = 5e6;

/// The specification of a tube of `n` cells with these regions.
pub(super) fn spec(n: usize, parts: &[Part]) -> Spec {
    Spec {
        kind: "fsi-tube".to_owned(),
        says: "A straight elastic tube of rings with inertia, filled with blood, with regions of their own stiffness, \
               tissue around it and an RCR Windkessel at its outlet."
            .to_owned(),
        states: states(n),
        parameters: parameters(parts),
        outputs: outputs(n),
        inputs: vec![Quantity::new("flow", "cm^3/s").role(Role::Flow).says("Flow into the tube.")],
        measures: vec![
            ("displacement".to_owned(), "eta".to_owned()),
            ("velocity".to_owned(), "w".to_owned()),
        ],
        restart: true,
    }
}

fn states(n: usize) -> Vec<Quantity> {
    vec![
        Quantity::new("eta", "cm").size(n).role(Role::Displacement).says("Radial displacement of the wall."),
        Quantity::new("w", "cm/s").size(n).role(Role::Velocity).says("Radial velocity of the wall."),
        Quantity::new("pi", "dyn/cm^2").role(Role::Pressure).says("Pressure in the Windkessel."),
    ]
}

fn outputs(n: usize) -> Vec<Quantity> {
    vec![
        Quantity::new("displacement", "cm")
            .size(n)
            .role(Role::Displacement)
            .says("Displacement of the wall from the radius R, from the inlet on."),
        Quantity::new("velocity", "cm/s")
            .size(n)
            .role(Role::Velocity)
            .says("Radial velocity of the wall, from the inlet on."),
        Quantity::new("pressure", "dyn/cm^2").role(Role::Pressure).says("Pressure at the outlet."),
        Quantity::new("outflow", "cm^3/s").role(Role::Flow).says("Flow out of the tube."),
        Quantity::new("inlet_pressure", "dyn/cm^2").role(Role::Pressure).says("Pressure at the inlet."),
        Quantity::new("strain", "")
            .size(n)
            .says("Circumferential strain of the wall from its unloaded radius, from the inlet on."),
        Quantity::new("stress", "dyn/cm^2")
            .size(n)
            .says("Circumferential stress of the wall, elastic and viscous, from the inlet on."),
    ]
}

/// The regions' Young's moduli, then what the whole tube shares.
fn parameters(parts: &[Part]) -> Vec<Quantity> {
    let young = |(i, part): (usize, &Part)| {
        stiff(&format!("E{}", i + 1), "dyn/cm^2", YOUNG)
            .positive()
            .says(&format!("Young's modulus of region {}.", part.says))
    };
    let mut all: Vec<Quantity> = parts.iter().enumerate().map(young).collect();
    all.extend(wall());
    all.extend(outlet());
    all
}

fn wall() -> [Quantity; 11] {
    [
        stiff("E_ref", "dyn/cm^2", YOUNG)
            .positive()
            .says("Young's modulus by which a start of kind `reference` is displaced."),
        Quantity::new("L", "cm").positive().default(LENGTH).says("Length of the tube."),
        Quantity::new("R", "cm")
            .positive()
            .default(1.0)
            .says("Radius of the tube: without load, or under the image pressure of the layout."),
        Quantity::new("h", "cm").positive().default(0.15).says("Thickness of the wall."),
        Quantity::new("nu", "").range(0.0, 0.5).default(0.5).says("Poisson's ratio of the wall."),
        Quantity::new("rho_s", "g/cm^3").positive().default(1.1).says("Density of the wall."),
        Quantity::new("rho_f", "g/cm^3").positive().default(1.06).says("Density of the fluid."),
        Quantity::new("mu", "P").range(0.0, f64::INFINITY).default(0.035).says("Viscosity of the fluid."),
        damping("c_w", 2e3).says("Viscosity of the wall: pressure per radial velocity."),
        stiff("k_s", "dyn/cm^3", 0.0)
            .range(0.0, f64::INFINITY)
            .says("Stiffness of the surrounding tissue: pressure per displacement."),
        damping("c_s", 0.0).says("Viscosity of the surrounding tissue: pressure per radial velocity."),
    ]
}

fn outlet() -> [Quantity; 4] {
    let resistance =
        |name: &str, value: f64| Quantity::new(name, "dyn s/cm^5").role(Role::Resistance).default(value);
    [
        resistance("R_p", 150.0).range(0.0, f64::INFINITY).says("Proximal resistance of the Windkessel."),
        resistance("R_d", 1850.0).positive().says("Distal resistance of the Windkessel."),
        Quantity::new("C", "cm^5/dyn")
            .role(Role::Compliance)
            .positive()
            .default(1e-3)
            .says("Compliance of the Windkessel."),
        Quantity::new("p0", "dyn/cm^2")
            .role(Role::Pressure)
            .default(INITIAL_PRESSURE)
            .says("Initial pressure of the Windkessel, under which the tube rests."),
    ]
}

fn stiff(name: &str, unit: &str, value: f64) -> Quantity {
    Quantity::new(name, unit).role(Role::Stiffness).default(value)
}

fn damping(name: &str, value: f64) -> Quantity {
    Quantity::new(name, "dyn s/cm^3").role(Role::Damping).range(0.0, f64::INFINITY).default(value)
}
