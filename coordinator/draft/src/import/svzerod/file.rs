//! An input file of svZeroDSolver as it is written, read strictly: a key that is not known here is refused with its place.
//!
//! Keys that begin with `_` are comments, as the program itself takes them. Next files to read: [`heart`] for chambers, valves and
//! closed loops, then [`super::blocks`].

#![allow(clippy::struct_field_names, non_snake_case)] // the file's own keys

mod given;
mod heart;

use std::collections::BTreeMap;

pub(super) use given::Given;
pub(super) use heart::{
    Activation, Chamber, ClosedCoronary, ClosedLoop, ClosedRcr, Cosines, Heart, Twitch, Valve,
};

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    #[serde(default, rename = "description")]
    _description: Option<Value>,
    pub(super) simulation_parameters: Simulation,
    pub(super) boundary_conditions: Vec<Boundary>,
    #[serde(default)]
    pub(super) vessels: Vec<Vessel>,
    #[serde(default)]
    pub(super) junctions: Vec<Junction>,
    #[serde(default)]
    pub(super) closed_loop_blocks: Vec<ClosedLoop>,
    #[serde(default)]
    pub(super) valves: Vec<Valve>,
    #[serde(default)]
    pub(super) chambers: Vec<Chamber>,
    #[serde(default)]
    pub(super) external_solver_coupling_blocks: Vec<Value>,
    #[serde(default)]
    pub(super) initial_condition: BTreeMap<String, f64>,
    #[serde(default)]
    pub(super) initial_condition_d: BTreeMap<String, f64>,
}

/// How the program runs. Tolerances and what it writes are its own business; they are known here so that others are refused.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Simulation {
    pub(super) number_of_cardiac_cycles: Option<usize>,
    pub(super) number_of_time_pts_per_cardiac_cycle: Option<usize>,
    pub(super) cardiac_period: Option<f64>,
    #[serde(default)]
    pub(super) coupled_simulation: bool,
    pub(super) steady_initial: Option<bool>,
    #[serde(default)]
    pub(super) output_all_cycles: bool,
    #[serde(default, rename = "number_of_time_pts")]
    _number_of_time_pts: Option<Value>,
    #[serde(default, rename = "external_step_size")]
    _external_step_size: Option<Value>,
    #[serde(default, rename = "absolute_tolerance")]
    _absolute_tolerance: Option<Value>,
    #[serde(default, rename = "maximum_nonlinear_iterations")]
    _maximum_nonlinear_iterations: Option<Value>,
    #[serde(default)]
    pub(super) use_cycle_to_cycle_error: bool,
    #[serde(default, rename = "sim_cycle_to_cycle_percent_error")]
    _sim_cycle_to_cycle_percent_error: Option<Value>,
    #[serde(default, rename = "rho_infty")]
    _rho_infty: Option<Value>,
    #[serde(default, rename = "output_variable_based")]
    _output_variable_based: Option<Value>,
    #[serde(default, rename = "output_interval")]
    _output_interval: Option<Value>,
    #[serde(default, rename = "output_mean_only")]
    _output_mean_only: Option<Value>,
    #[serde(default, rename = "output_derivative")]
    _output_derivative: Option<Value>,
    // Of the networks that SimVascular writes: the values of the elements follow from them already.
    #[serde(default, rename = "density")]
    _density: Option<Value>,
    #[serde(default, rename = "viscosity")]
    _viscosity: Option<Value>,
    #[serde(default, rename = "model_name")]
    _model_name: Option<Value>,
}

impl Simulation {
    /// Whether a run starts from the steady state, as it does unless the file says otherwise.
    pub(super) fn is_from_steady(&self) -> bool {
        self.steady_initial.unwrap_or(true)
    }
}

/// A boundary condition; what `bc_values` may hold follows from `bc_type`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Boundary {
    pub(super) bc_name: String,
    pub(super) bc_type: String,
    pub(super) bc_values: Value,
}

/// A vessel.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Vessel {
    pub(super) vessel_id: i64,
    pub(super) vessel_name: String,
    pub(super) zero_d_element_type: String,
    pub(super) zero_d_element_values: Value,
    #[serde(default)]
    pub(super) boundary_conditions: Ends,
    // Its resistance and the like follow from it already.
    #[serde(default, rename = "vessel_length")]
    _vessel_length: Option<Value>,
}

/// Boundary conditions at the ends of a vessel.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ends {
    pub(super) inlet: Option<String>,
    pub(super) outlet: Option<String>,
}

/// Where vessels join.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Junction {
    pub(super) junction_name: String,
    pub(super) junction_type: String,
    #[serde(default)]
    pub(super) junction_values: Option<Value>,
    #[serde(default)]
    pub(super) inlet_vessels: Vec<i64>,
    #[serde(default)]
    pub(super) outlet_vessels: Vec<i64>,
    #[serde(default)]
    pub(super) inlet_blocks: Vec<String>,
    #[serde(default)]
    pub(super) outlet_blocks: Vec<String>,
    // Of the geometry that SimVascular writes beside the names.
    #[serde(default, rename = "areas")]
    _areas: Option<Value>,
    #[serde(default, rename = "lengths")]
    _lengths: Option<Value>,
    #[serde(default, rename = "tangents")]
    _tangents: Option<Value>,
}

/// Values of a vessel.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct VesselValues {
    pub(super) R_poiseuille: f64,
    #[serde(default)]
    pub(super) C: f64,
    #[serde(default)]
    pub(super) L: f64,
    #[serde(default)]
    pub(super) stenosis_coefficient: f64,
}

/// Value of a `Resistance`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OneResistance {
    pub(super) R: f64,
}

/// Value of a `Capacitance`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OneCapacitance {
    pub(super) C: f64,
}

/// Value of an `Inductance`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OneInductance {
    pub(super) L: f64,
}

/// Values of a junction of vessels, one per outlet.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JunctionValues {
    pub(super) R_poiseuille: Vec<f64>,
    pub(super) L: Vec<f64>,
    #[serde(default)]
    pub(super) stenosis_coefficient: Vec<f64>,
}

/// Values of a junction of resistances, one per inlet, then one per outlet.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Resistances {
    pub(super) R: Vec<f64>,
}

/// A resistance to a pressure.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Resistance {
    pub(super) R: f64,
    pub(super) Pd: f64,
}

/// A Windkessel of three elements.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Rcr {
    pub(super) Rp: f64,
    pub(super) C: f64,
    pub(super) Rd: f64,
    pub(super) Pd: f64,
}

/// A coronary bed (Kim et al. 2010): Ra1, Ca, Ra2, Cc under the pressure Pim of the muscle, Rv1.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Coronary {
    pub(super) Ra1: f64,
    pub(super) Ra2: f64,
    pub(super) Rv1: f64,
    pub(super) Ca: f64,
    pub(super) Cc: f64,
    pub(super) P_v: f64,
    pub(super) t: Vec<f64>,
    pub(super) Pim: Vec<f64>,
}

/// Reads the text of a file.
pub(super) fn read(text: &str) -> Result<File, String> {
    let value: Value = serde_json::from_str(text).map_err(|error| format!("is no JSON: {error}"))?;
    if !value.is_object() {
        return Err("is no input of svZeroDSolver, which is a JSON object".to_owned());
    }
    for key in ["calibration_parameters", "y", "dy"] {
        if value.get(key).is_some() {
            return Err(format!(
                "`{key}`: is an input of svZeroDCalibrator; import the file that the calibrator writes"
            ));
        }
    }
    if value.get("vessels").is_none() && value.get("boundary_conditions").is_none() {
        return Err(
            "is no input of svZeroDSolver: it has neither `vessels` nor `boundary_conditions`".to_owned()
        );
    }
    typed("", &without_comments(value))
}

/// One part of the file in its type; faults are told with their place.
pub(super) fn typed<T: DeserializeOwned>(place: &str, value: &Value) -> Result<T, String> {
    serde_path_to_error::deserialize(value).map_err(|error| {
        let (path, message) = (error.path().to_string(), error.inner().to_string());
        let separator = if place.is_empty() || path == "." || path.starts_with('[') { "" } else { "." };
        let path = if path == "." { "" } else { path.as_str() };
        let place = format!("{place}{separator}{path}");
        if place.is_empty() { message } else { format!("{place}: {message}") }
    })
}

/// The same without the keys that are comments.
fn without_comments(value: Value) -> Value {
    match value {
        Value::Object(entries) => {
            let kept = entries.into_iter().filter(|(key, _)| !key.starts_with('_'));
            Value::Object(kept.map(|(key, value)| (key, without_comments(value))).collect::<Map<_, _>>())
        }
        Value::Array(items) => Value::Array(items.into_iter().map(without_comments).collect()),
        other => other,
    }
}
