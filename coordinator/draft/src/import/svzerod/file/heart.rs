//! Chambers, valves and closed loops as a file writes them.
//!
//! Next file to read: [`super::super::heart`].

use serde::Deserialize;
use serde_json::{Map, Value};

use super::typed;

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
    Half { t_active: f64, t_twitch: f64 },
    #[serde(rename = "piecewise_cosine")]
    Piecewise { contract_start: f64, relax_start: f64, contract_duration: f64, relax_duration: f64 },
    #[serde(rename = "wrapping_cosine")]
    Wrapping { Tsa: f64, tpwave: f64 },
    #[serde(rename = "two_hill")]
    TwoHill { t_shift: f64, tau_1: f64, tau_2: f64, m1: f64, m2: f64 },
    #[serde(rename = "fourier")]
    Fourier {},
}

/// Activations by the numbers that some versions have for them among the values of a chamber (`activation_type`).
const NUMBERED: [&str; 3] = ["half_cosine", "piecewise_cosine", "two_hill"];
/// Keys of these activations.
const OF_ACTIVATION: [&str; 11] = [
    "t_active",
    "t_twitch",
    "contract_start",
    "relax_start",
    "contract_duration",
    "relax_duration",
    "t_shift",
    "tau_1",
    "tau_2",
    "m1",
    "m2",
];

impl Chamber {
    /// Its values, and the activation that some versions have among them with its number.
    pub(in super::super) fn split(&self, place: &str) -> Result<(Value, Option<Activation>), String> {
        let Some(number) = self.values.get("activation_type") else { return Ok((self.values.clone(), None)) };
        let place = format!("{place}.values");
        let kind = number.as_u64().and_then(|number| NUMBERED.get(usize::try_from(number).ok()?));
        let kind = kind.ok_or_else(|| {
            format!("{place}.activation_type: {number} is not 0, 1 or 2 ({})", NUMBERED.join(", "))
        })?;
        let (mut values, mut activation) = (Map::new(), Map::new());
        activation.insert("type".to_owned(), Value::from(*kind));
        for (key, value) in self.values.as_object().into_iter().flatten() {
            let part = if OF_ACTIVATION.contains(&key.as_str()) { &mut activation } else { &mut values };
            part.insert(key.clone(), value.clone());
        }
        values.remove("activation_type");
        Ok((Value::Object(values), Some(typed(&place, &Value::Object(activation))?)))
    }
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
