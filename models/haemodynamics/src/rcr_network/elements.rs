//! What each kind of element adds to the circuit, to the parameters and to the states.
//!
//! Next file to read: [`super::circuit`].

use starlings_models_core::layout::fault;
use starlings_models_core::{Quantity, SetupError};

use super::assembly::Assembly;
use super::circuit::{Capacitor, Ends, FlowOf, Inertance, Injection, Law, Level, Resistive, Tie, TieKind};
use super::netlist::{Element, Kind, Value};
use super::parameters::Slot;
use super::units::Measure;

/// A capacitor on its way into the circuit.
#[derive(Clone, Copy)]
struct Storage<'a> {
    name: &'a str,
    path: &'a str,
    ends: Ends,
    compliance: usize,
    outside: Option<usize>,
    initial: Option<f64>,
}

impl Assembly {
    /// Adds one element.
    pub(super) fn add(&mut self, element: &Element, path: &str) -> Result<(), SetupError> {
        let from = self.node(element.from.as_ref(), &format!("{path}.from"))?;
        let to = self.node(element.to.as_ref(), &format!("{path}.to"))?;
        let ends = Ends { from, to };
        let flow = match element.kind {
            Kind::R => {
                let value = element.value.as_ref();
                let resistance = self.value(element, path, Measure::Resistance, ("value", "R", value))?;
                FlowOf::Resistive(self.branch(ends, Law::Linear { resistance }, None))
            }
            Kind::Loss => self.loss(element, ends, path)?,
            Kind::Diode => self.diode(element, ends, path)?,
            Kind::C => self.compliance(element, ends, path)?,
            Kind::Chamber => self.heart_chamber(element, ends, path)?,
            Kind::L => self.inertance(element, ends, path)?,
            Kind::Rcr => self.rcr(element, ends, path)?,
            Kind::Flow => {
                let signal = self.source(element, Measure::Flow, path)?;
                self.circuit.injections.push(Injection { ends, signal, says: element.name.clone() });
                FlowOf::Injection(self.circuit.injections.len() - 1)
            }
            Kind::Pressure => self.pressure(element, ends, path)?,
        };
        self.flows.push((element.name.clone(), flow));
        Ok(())
    }

    /// Position in θ of a value: its key, the prefix of its own parameter, what is written.
    pub(super) fn value(
        &mut self,
        element: &Element,
        path: &str,
        measure: Measure,
        (key, prefix, value): (&str, &str, Option<&Value>),
    ) -> Result<usize, SetupError> {
        // Pressures that resist the flow are absent, and signals in time, unless the netlist says otherwise.
        let default = matches!(measure, Measure::Pressure | Measure::Time).then_some(0.0);
        let what = match key {
            "value" | "stiffening" => measure.word().to_owned(),
            "shift" => "time by which it follows its input".to_owned(),
            "venous" => "pressure behind the distal resistance".to_owned(),
            "share" => "share of the pressure around it".to_owned(),
            "active" | "passive" => format!("{} when {key}", measure.word()),
            "rest" | "rest_active" => "volume without pressure".to_owned(),
            "wall" => "scale of the passive wall's pressure".to_owned(),
            _ => format!("{key} {}", measure.word().trim_start_matches(key).trim_start()),
        };
        let says = format!("{} of `{}`.", capital(what.trim_end()), element.name);
        let path = format!("{path}.{key}");
        let slot = Slot { path: &path, name: format!("{prefix}_{}", element.name), measure, says, default };
        self.parameters.place(slot, value)
    }

    fn compliance(&mut self, element: &Element, ends: Ends, path: &str) -> Result<FlowOf, SetupError> {
        let value = element.value.as_ref();
        let compliance = self.value(element, path, Measure::Compliance, ("value", "C", value))?;
        if element.around.is_some() {
            return self.compliance_under(element, ends, compliance, path);
        }
        if element.share.is_some() {
            return Err(fault(
                &format!("{path}.share"),
                "a share of the pressure of a chamber needs `around`",
            ));
        }
        let outside = match &element.input {
            Some(input) => Some(self.signal(input, Measure::Pressure, None, &format!("{path}.input"))?),
            None => None,
        };
        let (name, initial) = (element.name.as_str(), element.initial);
        self.capacitor(Storage { name, path, ends, compliance, outside, initial })
    }

    fn branch(&mut self, ends: Ends, law: Law, against: Option<usize>) -> usize {
        self.resistive(Resistive { ends, law, against })
    }

    fn loss(&mut self, element: &Element, ends: Ends, path: &str) -> Result<FlowOf, SetupError> {
        let value = element.linear.as_ref();
        let linear = self.value(element, path, Measure::LinearLoss, ("linear", "Kv", value))?;
        let value = element.quadratic.as_ref();
        let quadratic = self.value(element, path, Measure::QuadraticLoss, ("quadratic", "Kq", value))?;
        let at = self.branch(ends, Law::Loss { linear, quadratic }, None);
        self.drops.push((element.name.clone(), ends));
        Ok(FlowOf::Resistive(at))
    }

    fn diode(&mut self, element: &Element, ends: Ends, path: &str) -> Result<FlowOf, SetupError> {
        let open =
            self.value(element, path, Measure::Resistance, ("open", "Ropen", element.open.as_ref()))?;
        let value = element.closed.as_ref();
        let closed = self.value(element, path, Measure::Resistance, ("closed", "Rclosed", value))?;
        if let (Some(&Value::Number(open)), Some(&Value::Number(closed))) =
            (element.open.as_ref(), element.closed.as_ref())
            && closed < open
        {
            let message =
                format!("{closed} closed is less than {open} open: a valve leaks less than it lets through");
            return Err(fault(&format!("{path}.closed"), message));
        }
        let smooth = element.smooth.unwrap_or(0.0);
        let law = match element.steepness {
            Some(steepness) => Law::Valve { open, closed, steepness },
            None => Law::Diode { open, closed, smooth },
        };
        let at = self.branch(ends, law, None);
        self.drops.push((element.name.clone(), ends));
        Ok(FlowOf::Resistive(at))
    }

    fn inertance(&mut self, element: &Element, ends: Ends, path: &str) -> Result<FlowOf, SetupError> {
        let value = element.value.as_ref();
        let value = self.value(element, path, Measure::Inertance, ("value", "L", value))?;
        let output = format!("q_{}", element.name);
        let name = format!("stored_{output}");
        let quantity = Quantity::new(&name, Measure::Flow.label(self.units))
            .role(Measure::Flow.role())
            .says(&format!("Flow through `{}`.", element.name));
        let state = self.state(quantity, element.initial.unwrap_or(0.0));
        self.measures.push((output, name));
        self.circuit.inertances.push(Inertance { ends, value, state, says: element.name.clone() });
        Ok(FlowOf::Inertance(self.circuit.inertances.len() - 1))
    }

    /// A resistance to a chamber of its own, the chamber's compliance to the ground, and a resistance out of it.
    fn rcr(&mut self, element: &Element, ends: Ends, path: &str) -> Result<FlowOf, SetupError> {
        let value = element.proximal.as_ref();
        let proximal = self.value(element, path, Measure::Resistance, ("proximal", "Rp", value))?;
        let value = element.compliance.as_ref();
        let compliance = self.value(element, path, Measure::Compliance, ("compliance", "C", value))?;
        let value = element.distal.as_ref();
        let distal = self.value(element, path, Measure::Resistance, ("distal", "Rd", value))?;
        let against = match (&element.to, element.venous.as_ref()) {
            (Some(_), None) => None,
            (_, venous) => Some(self.value(element, path, Measure::Pressure, ("venous", "Pv", venous))?),
        };
        let chamber = self.chamber(&element.name, path)?;
        let into = Ends { from: ends.from, to: chamber };
        let flow = self.branch(into, Law::Linear { resistance: proximal }, None);
        let stored = Ends { from: chamber, to: 0 };
        let (name, initial) = (element.name.as_str(), element.initial);
        self.capacitor(Storage { name, path, ends: stored, compliance, outside: None, initial })?;
        self.branch(Ends { from: chamber, to: ends.to }, Law::Linear { resistance: distal }, against);
        Ok(FlowOf::Resistive(flow))
    }

    fn pressure(&mut self, element: &Element, ends: Ends, path: &str) -> Result<FlowOf, SetupError> {
        let level = match (&element.value, &element.input, &element.shift) {
            (Some(value), None, None) => {
                let slot = ("value", "P", Some(value));
                Level::Parameter(self.value(element, path, Measure::Pressure, slot)?)
            }
            (Some(_), _, _) => {
                let message =
                    "a pressure source has a constant `value`, or an `input`: remove one of the two";
                return Err(fault(path, message));
            }
            (None, _, _) => Level::Signal(self.source(element, Measure::Pressure, path)?),
        };
        let (says, path) = (element.name.clone(), path.to_owned());
        self.circuit.ties.push(Tie { ends, kind: TieKind::Pressure(level), says, path });
        Ok(FlowOf::Tie(self.circuit.ties.len() - 1))
    }

    /// The signal of a source.
    fn source(&mut self, element: &Element, measure: Measure, path: &str) -> Result<usize, SetupError> {
        let shift = match element.shift.as_ref() {
            Some(shift) => Some(self.value(element, path, Measure::Time, ("shift", "shift", Some(shift)))?),
            None => None,
        };
        let input = element.input.as_ref().unwrap_or(&element.name);
        self.signal(input, measure, shift, &format!("{path}.input"))
    }

    /// A capacitor, joined with those between the same nodes.
    fn capacitor(&mut self, storage: Storage<'_>) -> Result<FlowOf, SetupError> {
        let Ends { from, to } = storage.ends;
        // The ground comes last, so that the state is a node's pressure.
        let (ends, sign) = if from == 0 { (Ends { from: to, to: from }, -1.0) } else { (storage.ends, 1.0) };
        let beside = self.circuit.ties.iter().position(|tie| {
            let same = tie.ends == ends || (tie.ends.from == ends.to && tie.ends.to == ends.from);
            same && matches!(tie.kind, TieKind::Capacitors { .. })
        });
        let Some(at) = beside else {
            let state = self.stored_pressure(&storage, ends, sign)?;
            let part = Capacitor { compliance: storage.compliance, outside: storage.outside, sign };
            let kind = TieKind::Capacitors { state, parts: vec![part] };
            let (says, path) = (storage.name.to_owned(), storage.path.to_owned());
            self.circuit.ties.push(Tie { ends, kind, says, path });
            return Ok(FlowOf::Capacitor(self.circuit.ties.len() - 1, 0));
        };
        if storage.initial.is_some() {
            let message = format!(
                "`{}` is joined to the same nodes as `{}`, so it starts with it: give `initial` there",
                storage.name, self.circuit.ties[at].says
            );
            return Err(fault(&format!("{}.initial", storage.path), message));
        }
        let sign = if self.circuit.ties[at].ends == storage.ends { 1.0 } else { -1.0 };
        let part = Capacitor { compliance: storage.compliance, outside: storage.outside, sign };
        let TieKind::Capacitors { parts, .. } = &mut self.circuit.ties[at].kind else {
            unreachable!("only capacitors were looked for")
        };
        parts.push(part);
        Ok(FlowOf::Capacitor(at, parts.len() - 1))
    }

    /// The state of a new capacitor: the pressure of its node, or the drop across it where it is not grounded.
    fn stored_pressure(&mut self, storage: &Storage<'_>, ends: Ends, sign: f64) -> Result<usize, SetupError> {
        let pressure = Measure::Pressure;
        let quantity = |name: &str| Quantity::new(name, pressure.label(self.units)).role(pressure.role());
        if ends.to != 0 {
            let name = format!("stored_v_{}", storage.name);
            let quantity = quantity(&name).says(&format!("Pressure drop across `{}`.", storage.name));
            return Ok(self.state(quantity, storage.initial.unwrap_or(0.0)));
        }
        let node = &self.circuit.nodes[ends.from];
        let output = format!("p_{node}");
        let name = format!("stored_{output}");
        let quantity = quantity(&name).says(&format!("Pressure at node `{node}`."));
        let listed = self.node_initial.iter().position(|(node, _, _)| *node == ends.from);
        let listed = listed.map(|at| self.node_initial.remove(at));
        let initial = match (listed, storage.initial) {
            (Some((_, _, place)), Some(_)) => {
                let message =
                    format!("`{}` gives this node's pressure at the start too: remove one", storage.name);
                return Err(fault(&place, message));
            }
            (Some((_, value, _)), None) => value,
            (None, Some(value)) => sign * value,
            (None, None) => self.units.initial_pressure(),
        };
        self.measures.push((output, name));
        Ok(self.state(quantity, initial))
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map(|first| first.to_uppercase().collect::<String>() + letters.as_str())
        .unwrap_or_default()
}
