//! A network as the lines of `[model.layout]`.

use std::fmt::Write;

use super::network::{Chamber, Element, GROUND, Kind, Network, Opening};

/// The lines, in the order of the elements.
pub(super) fn lines(network: &Network) -> String {
    let mut text =
        "units = \"cgs\"      # labels only: a file of svZeroDSolver has numbers without units\nelements = [\n".to_owned();
    for element in &network.elements {
        // Writing to a text cannot fail.
        let _ = writeln!(text, "    {{ {} }},", line(network, element));
    }
    text.push_str("]\n");
    text
}

fn line(network: &Network, element: &Element) -> String {
    let (kind, values) = match &element.kind {
        Kind::Resistance(value) => ("R", format!(", value = {value:?}")),
        Kind::Loss { linear, quadratic } => {
            ("loss", format!(", linear = {linear:?}, quadratic = {quadratic:?}"))
        }
        Kind::Capacitor { value, outside: None } => ("C", format!(", value = {value:?}")),
        Kind::Capacitor { value, outside: Some(input) } => {
            ("C", format!(", value = {value:?}, input = \"{input}\""))
        }
        Kind::Under { value, around, share } => {
            let around = network.name(*around);
            ("C", format!(", value = {value:?}, around = \"{around}\", share = {share:?}"))
        }
        Kind::Chamber(chamber) => ("chamber", chamber_values(chamber)),
        Kind::Valve { open, closed, opening } => {
            let opening = match opening {
                Opening::Sharp => String::new(),
                Opening::Over(drop) => format!(", smooth = {drop:?}"),
                Opening::Steepness(steepness) => format!(", steepness = {steepness:?}"),
            };
            ("diode", format!(", open = {open:?}, closed = {closed:?}{opening}"))
        }
        Kind::Inertance(value) => ("L", format!(", value = {value:?}")),
        Kind::Flow => ("flow", String::new()),
        Kind::Pressure => ("pressure", String::new()),
        Kind::Constant(value) => ("pressure", format!(", value = {value:?}")),
        Kind::Rcr { proximal, compliance, distal, venous } => {
            let values = format!(
                ", proximal = {proximal:?}, compliance = {compliance:?}, distal = {distal:?}, venous = {venous:?}"
            );
            ("rcr", values)
        }
    };
    let end = |key: &str, node| match network.root(node) {
        GROUND => String::new(),
        _ => format!(", {key} = \"{}\"", network.name(node)),
    };
    let ends = end("from", element.from) + &end("to", element.to);
    format!("name = \"{}\", kind = \"{kind}\"{ends}{values}", element.name)
}

fn chamber_values(chamber: &Chamber) -> String {
    let Chamber { active, passive, rest: [rest, rest_active], wall, input } = chamber;
    let mut text = format!(", active = {active:?}, passive = {passive:?}, rest = {rest:?}");
    if rest_active.to_bits() != rest.to_bits() {
        // Writing to a text cannot fail.
        let _ = write!(text, ", rest_active = {rest_active:?}");
    }
    if let Some([scale, rate]) = wall {
        let _ = write!(text, ", wall = {scale:?}, stiffening = {rate:?}");
    }
    text + &format!(", input = \"{input}\"")
}
