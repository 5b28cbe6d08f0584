//! Models as equations, with places for effects that no kind of the catalogue has.

use starlings_models::equations::{EquationsDef, InputDef, OutputDef, StateDef};
use starlings_models::{BuildSetup, ModelDef, Role, Setup, catalogue};

use crate::common::plausible;

/// Name, setup and parameter values of every system.
pub(super) fn all() -> Vec<(String, Setup, Vec<f64>)> {
    let systems = [
        ("pendulum", pendulum()),
        ("motor", motor()),
        ("one tank", tank()),
        ("two tanks", two_tanks()),
        ("room", room(false)),
        ("room with a thermometer outside", room(true)),
        ("pipe", pipe()),
        ("chamber", chamber()),
        ("ramp", ramp()),
    ];
    systems.into_iter().map(|(name, equations)| with_values(name, equations)).collect()
}

fn with_values(name: &str, equations: EquationsDef) -> (String, Setup, Vec<f64>) {
    let kind = catalogue::EQUATIONS.to_owned();
    let model = ModelDef { kind, equations: Some(equations), ..ModelDef::default() };
    let mut setup = Setup { model, ..Setup::default() };
    let spec = setup.spec().unwrap();
    setup.parameters = spec.parameters.iter().map(|q| q.name.clone()).collect();
    let theta = plausible(&spec);
    (name.to_owned(), setup, theta)
}

fn state(name: &str, unit: &str, role: Role, initial: &str, rate: &str) -> StateDef {
    StateDef {
        name: name.to_owned(),
        unit: unit.to_owned(),
        role,
        initial: initial.to_owned(),
        rate: vec![(name.to_owned(), rate.to_owned())],
        ..StateDef::default()
    }
}

fn output(name: &str, unit: &str, role: Role, value: &str) -> OutputDef {
    OutputDef { name: name.to_owned(), unit: unit.to_owned(), role, value: value.to_owned() }
}

fn input(name: &str, unit: &str, role: Role) -> InputDef {
    InputDef { name: name.to_owned(), unit: unit.to_owned(), role }
}

fn pendulum() -> EquationsDef {
    EquationsDef {
        states: vec![
            state("angle", "rad", Role::Displacement, "0.9", "speed"),
            state("speed", "rad/s", Role::Velocity, "0", "-40*sin(angle) - c*speed"),
        ],
        outputs: vec![output("encoder", "rad", Role::Displacement, "angle")],
        ..EquationsDef::default()
    }
}

fn motor() -> EquationsDef {
    EquationsDef {
        states: vec![state("speed", "rad/s", Role::Velocity, "0", "K*voltage - c*speed")],
        outputs: vec![output("speed", "rad/s", Role::Velocity, "speed")],
        inputs: vec![input("voltage", "V", Role::Other)],
        ..EquationsDef::default()
    }
}

fn tank() -> EquationsDef {
    EquationsDef {
        states: vec![state("h", "m", Role::Level, "1", "0.1*inflow - sqrt(max(h, 0))/R")],
        outputs: vec![output("h", "m", Role::Level, "h")],
        inputs: vec![input("inflow", "m^3/s", Role::Flow)],
        roles: [("R".to_owned(), Role::Resistance)].into(),
        ..EquationsDef::default()
    }
}

fn two_tanks() -> EquationsDef {
    EquationsDef {
        states: vec![
            state("h1", "m", Role::Level, "2", "0.1*pump - a*h1"),
            state("h2", "m", Role::Level, "1", "a*h1 - b*h2"),
        ],
        outputs: vec![output("upper", "V", Role::Level, "3*h1")],
        inputs: vec![input("pump", "V", Role::Other)],
        ..EquationsDef::default()
    }
}

fn room(outside: bool) -> EquationsDef {
    let mut inputs = vec![input("sun", "W/m^2", Role::Other)];
    if outside {
        inputs.push(input("outside", "K", Role::Temperature));
    }
    let loss = if outside { "outside" } else { "280" };
    EquationsDef {
        states: vec![state("T", "K", Role::Temperature, "300", &format!("0.1*sun - k*(T - {loss})"))],
        outputs: vec![output("reading", "K", Role::Temperature, "T")],
        inputs,
        ..EquationsDef::default()
    }
}

fn pipe() -> EquationsDef {
    EquationsDef {
        states: vec![
            state("p", "mmHg", Role::Pressure, "80", "(flow - i)/C"),
            state("i", "mL/s", Role::Flow, "5", "(p - 60 - R*i)/L"),
        ],
        outputs: vec![output("pressure", "mmHg", Role::Pressure, "p")],
        inputs: vec![input("flow", "mL/s", Role::Flow)],
        roles: [("R".to_owned(), Role::Resistance), ("C".to_owned(), Role::Compliance)].into(),
        ..EquationsDef::default()
    }
}

fn chamber() -> EquationsDef {
    EquationsDef {
        states: vec![
            state("p", "bar", Role::Pressure, "5", "20*(a*Ab*(1 - 0.3*w)*sqrt(max(p, 0)) - At*p)"),
            state("w", "mm", Role::Web, "0", "a*sqrt(max(p, 0))"),
        ],
        outputs: vec![
            output("pressure", "bar", Role::Pressure, "p"),
            output("thrust", "N", Role::Thrust, "1.4*At*p"),
        ],
        roles: [("At", Role::ThroatArea), ("a", Role::BurnRate), ("Ab", Role::BurnArea)]
            .map(|(name, role)| (name.to_owned(), role))
            .into(),
        ..EquationsDef::default()
    }
}

/// A measured sine, and nothing that moves.
fn ramp() -> EquationsDef {
    EquationsDef {
        states: vec![state("x", "", Role::Other, "1", "-x")],
        outputs: vec![output("y", "", Role::Other, "sin(8*t)")],
        ..EquationsDef::default()
    }
}
