//! Chambers, valves and closed loops as a file writes them.
//!
//! Next file to read: [`super::super::heart`].

use serde::Deserialize;
use serde_json::Value;

/// A closed loop; what `parameters` may hold follows from its type.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct ClosedLoop {
    pub(in super::super) closed_loop_type: String,
    pub(in super::super) cardiac_cycle_period: Option<f64>,
    #[serde(default)]
    pub(in super::super) outlet_blocks: Vec<String>,
    #[serde(default)]
    pub(in super::super) parameters: Value,
}

/// Four chambers, four valves and the lungs (Sankaran et al. 2012).
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct Heart {
    pub(in super::super) Tsa: f64,
    pub(in super::super) tpwave: f64,
    pub(in super::super) Erv_s: f64,
    pub(in super::super) Elv_s: f64,
    pub(in super::super) iml: f64,
    pub(in super::super) imr: f64,
    pub(in super::super) Lra_v: f64,
    pub(in super::super) Rra_v: f64,
    pub(in super::super) Lrv_a: f64,
    pub(in super::super) Rrv_a: f64,
    pub(in super::super) Lla_v: f64,
    pub(in super::super) Rla_v: f64,
    pub(in super::super) Llv_a: f64,
    pub(in super::super) Rlv_ao: f64,
    pub(in super::super) Vrv_u: f64,
    pub(in super::super) Vlv_u: f64,
    pub(in super::super) Rpd: f64,
    pub(in super::super) Cp: f64,
    pub(in super::super) Cpa: f64,
    pub(in super::super) Kxp_ra: f64,
    pub(in super::super) Kxv_ra: f64,
    pub(in super::super) Kxp_la: f64,
    pub(in super::super) Kxv_la: f64,
    pub(in super::super) Emax_ra: f64,
    pub(in super::super) Emax_la: f64,
    pub(in super::super) Vaso_ra: f64,
    pub(in super::super) Vaso_la: f64,
}

/// A Windkessel that empties into the heart.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct ClosedRcr {
    pub(in super::super) Rp: f64,
    pub(in super::super) C: f64,
    pub(in super::super) Rd: f64,
    #[serde(default)]
    pub(in super::super) closed_loop_outlet: bool,
    #[serde(default, rename = "unsteady")]
    _unsteady: Option<Value>,
}

/// A coronary bed that empties into the heart.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct ClosedCoronary {
    pub(in super::super) Ra: f64,
    pub(in super::super) Ram: f64,
    pub(in super::super) Rv: f64,
    pub(in super::super) Ca: f64,
    pub(in super::super) Cim: f64,
}

/// A valve; older files write its values and blocks elsewhere.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct Valve {
    #[serde(rename = "type")]
    pub(in super::super) kind: String,
    pub(in super::super) name: String,
    #[serde(alias = "values")]
    pub(in super::super) params: ValveValues,
    pub(in super::super) upstream_block: Option<String>,
    pub(in super::super) downstream_block: Option<String>,
}

/// Values of a valve, and what it joins.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct ValveValues {
    pub(in super::super) Rmax: f64,
    pub(in super::super) Rmin: f64,
    pub(in super::super) Steepness: Option<f64>,
    pub(in super::super) upstream_block: Option<String>,
    pub(in super::super) downstream_block: Option<String>,
}

/// A chamber; what `values` may hold follows from its type.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct Chamber {
    #[serde(rename = "type")]
    pub(in super::super) kind: String,
    pub(in super::super) name: String,
    #[serde(alias = "params")]
    pub(in super::super) values: Value,
    pub(in super::super) activation_function: Option<Activation>,
}

/// An activation by its type.
#[derive(Debug, Deserialize)]
#[serde(tag = "type", deny_unknown_fields)]
pub(in super::super) enum Activation {
    #[serde(rename = "half_cosine")]
    HalfCosine { t_active: f64, t_twitch: f64 },
    #[serde(rename = "piecewise_cosine")]
    PiecewiseCosine { contract_start: f64, relax_start: f64, contract_duration: f64, relax_duration: f64 },
    #[serde(rename = "wrapping_cosine")]
    WrappingCosine { Tsa: f64, tpwave: f64 },
}

/// Values of a `ChamberElastanceInductor`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct Twitch {
    pub(in super::super) Emax: f64,
    pub(in super::super) Emin: f64,
    pub(in super::super) Vrd: f64,
    pub(in super::super) Vrs: f64,
    pub(in super::super) t_active: Option<f64>,
    pub(in super::super) t_twitch: Option<f64>,
    #[serde(default)]
    pub(in super::super) Impedance: f64,
    pub(in super::super) Kxp: Option<f64>,
    pub(in super::super) Kxv: Option<f64>,
    pub(in super::super) Vaso: Option<f64>,
}

/// Values of a `PiecewiseCosineChamber` or a `LinearElastanceChamber`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct Cosines {
    pub(in super::super) Emax: f64,
    pub(in super::super) Epass: f64,
    pub(in super::super) Vrest: f64,
    pub(in super::super) contract_start: Option<f64>,
    pub(in super::super) relax_start: Option<f64>,
    pub(in super::super) contract_duration: Option<f64>,
    pub(in super::super) relax_duration: Option<f64>,
}
