//! The labels of a network's quantities in three systems of units.
//!
//! Nothing is converted but the one default that has a unit, the pressure at the start. Next file to read:
//! [`super::parameters`].

use serde::Deserialize;
use starlings_models_core::Role;

/// A consistent system of units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub(super) enum System {
    /// mmHg, mL, s.
    #[default]
    #[serde(rename = "clinical")]
    Clinical,
    /// dyn/cm², cm³, s.
    #[serde(rename = "cgs")]
    Cgs,
    /// Pa, m³, s.
    SI,
}

/// What a number of a network measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    Pressure,
    Flow,
    Resistance,
    Compliance,
    Inertance,
    LinearLoss,
    QuadraticLoss,
    Time,
    Volume,
    Elastance,
    Stiffening,
    Share,
    Activation,
}

impl Measure {
    /// The label in a system.
    pub(super) fn label(self, system: System) -> &'static str {
        let [clinical, cgs, si] = match self {
            Self::Pressure => ["mmHg", "dyn/cm^2", "Pa"],
            Self::Flow => ["mL/s", "cm^3/s", "m^3/s"],
            Self::Resistance | Self::LinearLoss => ["mmHg s/mL", "dyn s/cm^5", "Pa s/m^3"],
            Self::Compliance => ["mL/mmHg", "cm^5/dyn", "m^3/Pa"],
            Self::Inertance => ["mmHg s^2/mL", "g/cm^4", "kg/m^4"],
            Self::QuadraticLoss => ["mmHg s^2/mL^2", "g/cm^7", "kg/m^7"],
            Self::Time => ["s", "s", "s"],
            Self::Volume => ["mL", "cm^3", "m^3"],
            Self::Elastance => ["mmHg/mL", "dyn/cm^5", "Pa/m^3"],
            Self::Stiffening => ["1/mL", "1/cm^3", "1/m^3"],
            Self::Share | Self::Activation => ["", "", ""],
        };
        match system {
            System::Clinical => clinical,
            System::Cgs => cgs,
            System::SI => si,
        }
    }

    /// The physical meaning.
    pub(super) fn role(self) -> Role {
        match self {
            Self::Pressure => Role::Pressure,
            Self::Flow => Role::Flow,
            Self::Resistance | Self::LinearLoss => Role::Resistance,
            Self::Compliance => Role::Compliance,
            Self::Inertance => Role::Inertia,
            Self::Time => Role::Shift,
            Self::QuadraticLoss
            | Self::Volume
            | Self::Elastance
            | Self::Stiffening
            | Self::Share
            | Self::Activation => Role::Other,
        }
    }

    /// Smallest and largest value that physics allows.
    pub(super) fn range(self) -> [f64; 2] {
        match self {
            Self::Compliance | Self::Inertance => [f64::MIN_POSITIVE, f64::INFINITY],
            Self::Resistance
            | Self::LinearLoss
            | Self::QuadraticLoss
            | Self::Elastance
            | Self::Stiffening => [0.0, f64::INFINITY],
            Self::Share | Self::Pressure | Self::Flow | Self::Time | Self::Volume | Self::Activation => {
                [f64::NEG_INFINITY, f64::INFINITY]
            }
        }
    }

    /// The plural in a message.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Pressure => "pressure",
            Self::Flow => "flow",
            Self::Resistance => "resistance",
            Self::Compliance => "compliance",
            Self::Inertance => "inertance",
            Self::LinearLoss => "linear loss",
            Self::QuadraticLoss => "quadratic loss",
            Self::Time => "time",
            Self::Volume => "volume",
            Self::Elastance => "elastance",
            Self::Stiffening => "stiffening per volume",
            Self::Share => "share",
            Self::Activation => "activation",
        }
    }
}

impl System {
    /// A diastolic pressure, 80 mmHg: where stored pressures start unless the netlist says otherwise.
    pub(super) fn initial_pressure(self) -> f64 {
        match self {
            Self::Clinical => 80.0,
            Self::Cgs => 80.0 * 1333.22,
            Self::SI => 80.0 * 133.322,
        }
    }
}
