//! Junctions of a file: what joins there, and what stands between.
//!
//! Next file to read: [`super::network`].

use super::blocks::{Blocks, Side};
use super::file::{File, Junction, JunctionValues, Resistances, typed};
use super::network::Series;

impl Blocks {
    /// Joins what a junction names to its node, with what stands between.
    pub(super) fn junction(&mut self, file: &File, junction: &Junction, place: &str) -> Result<(), String> {
        let id = |id: &i64| {
            let vessel = file.vessels.iter().find(|vessel| vessel.vessel_id == *id);
            vessel.map(|v| v.vessel_name.clone()).ok_or_else(|| format!("{place}: no vessel has the id {id}"))
        };
        let by_id = |ids: &[i64]| ids.iter().map(id).collect::<Result<Vec<_>, _>>();
        let (mut inlets, mut outlets) = (by_id(&junction.inlet_vessels)?, by_id(&junction.outlet_vessels)?);
        inlets.extend(junction.inlet_blocks.iter().cloned());
        outlets.extend(junction.outlet_blocks.iter().cloned());
        if inlets.is_empty() || outlets.is_empty() {
            return Err(format!(
                "{place}: a junction has inlets and outlets (`inlet_vessels`, `outlet_vessels`)"
            ));
        }
        let name = &junction.junction_name;
        let centre = self.network.node(name);
        let series = Self::between(junction, (inlets.len(), outlets.len()), place)?;
        for (i, block) in inlets.iter().chain(&outlets).enumerate() {
            let inlet = i < inlets.len();
            let node = match series[i] {
                None => centre,
                Some(values) => {
                    let node = self.network.node(&format!("{name}_{block}"));
                    let (from, to) = if inlet { (node, centre) } else { (centre, node) };
                    let between = format!("{name}_to_{block}");
                    let at = format!("{place}.junction_values");
                    self.network.series((&between, &at), values, from, to)?;
                    node
                }
            };
            // What flows into a junction leaves a block.
            self.attach(block, if inlet { Side::Outlet } else { Side::Inlet }, node)?;
        }
        Ok(())
    }

    /// What stands between the node of a junction and each of so many inlets and outlets, in their order.
    fn between(junction: &Junction, n: (usize, usize), place: &str) -> Result<Vec<Option<Series>>, String> {
        let none = || -> Result<(), String> {
            match &junction.junction_values {
                None => Ok(()),
                Some(value) if value.as_object().is_some_and(serde_json::Map::is_empty) => Ok(()),
                Some(_) => Err(format!("{place}.junction_values: a {} has none", junction.junction_type)),
            }
        };
        let values = junction.junction_values.as_ref().unwrap_or(&serde_json::Value::Null);
        let own = format!("{place}.junction_values");
        match junction.junction_type.as_str() {
            "NORMAL_JUNCTION" | "internal_junction" => {
                none()?;
                Ok(vec![None; n.0 + n.1])
            }
            "resistive_junction" => {
                let Resistances { R } = typed(&own, values)?;
                count(&own, "R", R.len(), n.0 + n.1)?;
                Ok(R.into_iter().map(|resistance| Some(Self::of(resistance, 0.0, 0.0))).collect())
            }
            "BloodVesselJunction" => {
                if n.0 != 1 {
                    return Err(format!("{place}: a BloodVesselJunction has one inlet, not {}", n.0));
                }
                let JunctionValues { R_poiseuille, L, mut stenosis_coefficient } = typed(&own, values)?;
                if stenosis_coefficient.is_empty() {
                    stenosis_coefficient = vec![0.0; n.1];
                }
                count(&own, "R_poiseuille", R_poiseuille.len(), n.1)?;
                count(&own, "L", L.len(), n.1)?;
                count(&own, "stenosis_coefficient", stenosis_coefficient.len(), n.1)?;
                let outlets = R_poiseuille.iter().zip(&L).zip(stenosis_coefficient);
                let outlets = outlets.map(|((r, l), s)| Some(Self::of(*r, s, *l)));
                Ok(std::iter::once(None).chain(outlets).collect())
            }
            other => Err(format!(
                "{place}: a junction of type `{other}` is not in `rcr-network` (known: NORMAL_JUNCTION, internal_junction, \
                 resistive_junction, BloodVesselJunction)"
            )),
        }
    }
}

fn count(place: &str, key: &str, found: usize, wanted: usize) -> Result<(), String> {
    if found == wanted { Ok(()) } else { Err(format!("{place}.{key}: {found} numbers for {wanted} places")) }
}
