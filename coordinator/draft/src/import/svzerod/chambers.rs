//! Chambers and valves of a file as elements of a network.
//!
//! Next files to read: [`super::activation`], then [`super::heart`] for whole hearts.

#![allow(non_snake_case)] // the file's own keys

use serde_json::Value;

use super::activation::Shape;
use super::blocks::{Blocks, Side};
use super::file::{Activation, Chamber, Cosines, File, Twitch, Valve, typed};
use super::network::{self, GROUND, Kind, Node, Opening};

impl Blocks {
    /// Adds the chambers, which everything else may be joined to.
    pub(super) fn chambers(&mut self, file: &File) -> Result<(), String> {
        for (i, chamber) in file.chambers.iter().enumerate() {
            let place = format!("chambers[{i}]");
            if self.chambers.contains_key(&chamber.name) || self.ends.contains_key(&chamber.name) {
                return Err(format!("{place}: two blocks are called `{}`", chamber.name));
            }
            self.chamber(chamber, &place)?;
        }
        for (i, closed) in file.closed_loop_blocks.iter().enumerate() {
            let place = format!("closed_loop_blocks[{i}]");
            if i > 0 {
                return Err(format!("{place}: a network has one closed loop"));
            }
            self.closed_loop(file, closed, &place)?;
        }
        Ok(())
    }

    fn chamber(&mut self, chamber: &Chamber, place: &str) -> Result<(), String> {
        let (values, inside) = chamber.split(place)?;
        let (law, own, inertance) = law(&chamber.kind, &values, place)?;
        let given = chamber.activation_function.as_ref().or(inside.as_ref());
        let shape = given.map(shape).or(own);
        let shape = shape.ok_or_else(|| format!("{place}: `{}` has no activation", chamber.name))?;
        shape.check().map_err(|fault| format!("{place}: {fault}"))?;
        let name = &chamber.name;
        let node = self.network.node(&format!("{name}_in"));
        let element = self.heart_chamber(name, law, shape, node);
        self.states.insert(format!("Vc:{name}"), format!("stored_V_{element}"));
        let out = if inertance > 0.0 {
            let out = self.network.node(&format!("{name}_out"));
            self.network.add(&format!("{name}_blood"), Kind::Inertance(inertance), node, out);
            out
        } else {
            node
        };
        self.chambers.insert(name.clone(), [node, out]);
        Ok(())
    }

    /// A chamber at a node, with its activation; gives the element's name.
    pub(super) fn heart_chamber(
        &mut self,
        name: &str,
        mut law: network::Chamber,
        shape: Shape,
        node: Node,
    ) -> String {
        let input = self.network.names.take(&format!("{name}_activation"));
        law.input.clone_from(&input);
        self.activations.push((input, shape));
        let element = self.network.add(name, Kind::Chamber(law), node, GROUND);
        self.channels.push((format!("V_{element}"), "cm^3"));
        element
    }

    /// Joins what a valve stands between; blocks at its ends may be boundary conditions.
    pub(super) fn valve(&mut self, valve: &Valve, place: &str) -> Result<(), String> {
        let values = &valve.params;
        let opening = match (valve.kind.as_str(), values.Steepness) {
            ("ValveTanh" | "tanh", Some(steepness)) if steepness > 0.0 && steepness.is_finite() => {
                Opening::Steepness(steepness)
            }
            ("ValveTanh" | "tanh", _) => {
                return Err(format!("{place}: a `ValveTanh` has a `Steepness` above zero"));
            }
            ("PiecewiseValve", None) => Opening::Sharp,
            ("RegazzoniValve", _) => {
                return Err(format!("{place}: `RegazzoniValve` is an early name: write `PiecewiseValve`"));
            }
            (other, _) => {
                return Err(format!(
                    "{place}: a valve of type `{other}` is not in `rcr-network` (known: ValveTanh, PiecewiseValve)"
                ));
            }
        };
        let (open, closed) = (values.Rmin, values.Rmax);
        if !(open > 0.0 && closed >= open && closed.is_finite()) {
            return Err(format!("{place}: Rmin is {open} and Rmax {closed}: give 0 < Rmin <= Rmax"));
        }
        let block = |inside: &Option<String>, outside: &Option<String>, key: &str| {
            inside.clone().or_else(|| outside.clone()).ok_or_else(|| format!("{place}: `{key}` is not given"))
        };
        let upstream = block(&values.upstream_block, &valve.upstream_block, "upstream_block")?;
        let downstream = block(&values.downstream_block, &valve.downstream_block, "downstream_block")?;
        let from = self.network.node(&format!("{}_in", valve.name));
        let to = self.network.node(&format!("{}_out", valve.name));
        self.attach(&upstream, Side::Outlet, from)?;
        self.attach(&downstream, Side::Inlet, to)?;
        self.network.add(&valve.name, Kind::Valve { open, closed, opening }, from, to);
        Ok(())
    }
}

/// The law of a chamber that twitches.
fn twitch_law(values: &Twitch, place: &str) -> Result<network::Chamber, String> {
    let wall = match (values.Kxp, values.Kxv) {
        (Some(scale), Some(rate)) => {
            if values.Vaso.is_some_and(|volume| volume.to_bits() != values.Vrd.to_bits()) {
                return Err(format!(
                    "{place}.Vaso: the wall's volume at rest is not Vrd, which `rcr-network` takes"
                ));
            }
            Some([scale, rate])
        }
        (None, None) => None,
        _ => return Err(format!("{place}: a passive wall has `Kxp` and `Kxv`, or neither")),
    };
    Ok(network::Chamber {
        active: values.Emax,
        passive: values.Emin,
        rest: [values.Vrd, values.Vrs],
        wall,
        input: String::new(),
    })
}

/// The law of a chamber, the activation among its own values, and the inertance at its outlet.
fn law(kind: &str, values: &Value, place: &str) -> Result<(network::Chamber, Option<Shape>, f64), String> {
    let own = format!("{place}.values");
    match kind {
        "ChamberElastanceInductor" => {
            let values: Twitch = typed(&own, values)?;
            let law = twitch_law(&values, &own)?;
            let cosine = values.t_active.zip(values.t_twitch);
            let shape = cosine.map(|(active, twitch)| Shape::HalfCosine { active, twitch });
            Ok((law, shape, values.Impedance))
        }
        "PiecewiseCosineChamber" | "LinearElastanceChamber" => {
            let values: Cosines = typed(&own, values)?;
            let law = network::Chamber {
                active: values.Epass + values.Emax,
                passive: values.Epass,
                rest: [values.Vrest; 2],
                wall: None,
                input: String::new(),
            };
            let contract = values.contract_start.zip(values.contract_duration);
            let relax = values.relax_start.zip(values.relax_duration);
            let shape = contract.zip(relax).map(|(contract, relax)| Shape::Cosines { contract, relax });
            Ok((law, shape, 0.0))
        }
        "RegazzoniChamber" => Err(format!(
            "{place}: `RegazzoniChamber` is an early form of `PiecewiseCosineChamber` whose heart beats every 0.68966 s whatever the \
             file's period: write `PiecewiseCosineChamber`"
        )),
        other => Err(format!(
            "{place}: a chamber of type `{other}` is not in `rcr-network` (known: ChamberElastanceInductor, \
                     PiecewiseCosineChamber, LinearElastanceChamber)"
        )),
    }
}

fn shape(activation: &Activation) -> Shape {
    match activation {
        Activation::Half { t_active, t_twitch } => Shape::HalfCosine { active: *t_active, twitch: *t_twitch },
        Activation::Piecewise { contract_start, relax_start, contract_duration, relax_duration } => {
            Shape::Cosines {
                contract: (*contract_start, *contract_duration),
                relax: (*relax_start, *relax_duration),
            }
        }
        Activation::Wrapping { Tsa, tpwave } => Shape::Wrapping { Tsa: *Tsa, tpwave: *tpwave },
        Activation::TwoHill { t_shift, tau_1, tau_2, m1, m2 } => {
            Shape::TwoHill { shift: *t_shift, times: [*tau_1, *tau_2], powers: [*m1, *m2] }
        }
        Activation::Fourier {} => Shape::FourierFromZero,
    }
}
