//! A network as the lines of `[model.layout]`.

use std::fmt::Write;

use super::network::{Element, GROUND, Kind, Network};

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
