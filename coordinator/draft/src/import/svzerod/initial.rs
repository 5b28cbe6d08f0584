//! The state that a file begins with.
//!
//! A closed loop keeps the blood that it begins with, so its initial condition is read; a network that is driven forgets it in a few
//! cycles. Next file to read: [`super::super::plan`].

use super::super::plan::{Course, Origin};
use super::blocks::Blocks;
use super::file::File;
use super::network::{GROUND, Kind, Node};

/// Cycles after which a network that is driven hardly knows where it started.
const FORGET: usize = 10;
/// Periods that the program runs in search of a steady state, which a network with chambers does not have: 31 steps of a tenth.
const BEFORE: usize = 3;

/// The states that the initial condition gives; what it does not name is zero.
pub(super) fn states(
    file: &File,
    blocks: &Blocks,
    course: &mut Course,
    notes: &mut Vec<String>,
) -> Result<Vec<(String, f64)>, String> {
    let given = &file.initial_condition;
    let keeps = !(file.chambers.is_empty() && file.closed_loop_blocks.is_empty());
    if !keeps {
        if given.is_empty() && file.initial_condition_d.is_empty() {
            return Ok(Vec::new());
        }
        if course.all || course.cycles < FORGET {
            return Err(format!(
                "initial_condition: not read, and after {} cycles it still counts; ask for the last of at least {FORGET} cycles",
                if course.all { 0 } else { course.cycles }
            ));
        }
        notes.push(
            "`initial_condition` is not read: the last of many cycles is shown, which hardly knows it"
                .to_owned(),
        );
        return Ok(Vec::new());
    }
    if course.from == Origin::Steady && course.all {
        notes.push(
            "a network with chambers starts from `initial_condition`; the program runs some three periods under the means of the inputs \
             before (steady_initial), which the first of the periods shown know"
                .to_owned(),
        );
    } else if course.from == Origin::Steady {
        course.cycles += BEFORE;
        notes.push(format!(
            "a network with chambers starts from `initial_condition`; for the {BEFORE} periods under the means of the inputs that the program \
             runs before (steady_initial), as many more are run"
        ));
    }
    course.from = Origin::Zero;
    let mut states = Vec::new();
    let mut unread = Vec::new();
    for (key, value) in given {
        match state(file, blocks, key, *value)? {
            Some(state) => states.push(state),
            None => unread.push(format!("`{key}`")),
        }
    }
    if !unread.is_empty() {
        notes.push(format!(
            "of `initial_condition` {} {} no state of the network and not read",
            unread.join(", "),
            if unread.len() == 1 { "is" } else { "are" }
        ));
    }
    Ok(states)
}

/// The state that a variable is, and its value.
fn state(file: &File, blocks: &Blocks, key: &str, value: f64) -> Result<Option<(String, f64)>, String> {
    if let Some(state) = blocks.states.get(key) {
        return Ok(Some((state.clone(), value)));
    }
    let parts: Vec<&str> = key.split(':').collect();
    let ["pressure" | "flow", up, down] = parts[..] else { return Ok(None) };
    if parts[0] == "flow" {
        // The inertance is at a vessel's outlet; without a wall its flow is the one at the inlet too.
        let stiff = blocks.ends.contains_key(down) && behind(file, blocks, down)?.is_none();
        let name = blood(blocks, up).or_else(|| if stiff { blood(blocks, down) } else { None });
        return Ok(name.map(|name| (format!("stored_q_{name}"), value)));
    }
    let node = |block: &str, end: usize| -> Option<Node> {
        let chamber = blocks.chambers.get(block).map(|ends| ends[end]);
        chamber.or_else(|| blocks.ends.get(block).and_then(|ends| ends[end]))
    };
    let Some(node) = node(down, 0).or_else(|| node(up, 1)) else { return Ok(None) };
    if let Some((state, drop)) = behind(file, blocks, down)? {
        return Ok(Some((state, value - drop)));
    }
    Ok(stored_at(blocks, node).map(|state| (state, value)))
}

/// The element that is the inertance of a vessel.
fn blood(blocks: &Blocks, vessel: &str) -> Option<String> {
    let name = format!("{vessel}_blood");
    let found =
        blocks.network.elements.iter().find(|e| e.name == name && matches!(e.kind, Kind::Inertance(_)));
    found.map(|element| element.name.clone())
}

/// The capacitor of a vessel behind its resistance, and the pressure drop up to it at the flow that the file gives.
fn behind(file: &File, blocks: &Blocks, vessel: &str) -> Result<Option<(String, f64)>, String> {
    let Some(found) = file.vessels.iter().find(|v| v.vessel_name == vessel) else { return Ok(None) };
    let values = found.values(vessel)?;
    let wall = format!("{vessel}_wall");
    let Some(element) = blocks.network.elements.iter().find(|e| e.name == wall) else { return Ok(None) };
    let inflow = |key: &&String| key.starts_with("flow:") && key.ends_with(&format!(":{vessel}"));
    let flow = file.initial_condition.keys().find(inflow).map_or(0.0, |key| file.initial_condition[key]);
    let state = format!("stored_p_{}", blocks.network.name(element.from));
    let drop = if found.zero_d_element_type == "BloodVesselCRL" { 0.0 } else { values.R_poiseuille * flow };
    Ok(Some((state, drop)))
}

/// The state of a capacitor to the ground at a node.
fn stored_at(blocks: &Blocks, node: Node) -> Option<String> {
    let network = &blocks.network;
    let found = network.at(node, |kind| matches!(kind, Kind::Capacitor { .. }))?;
    (network.root(found.to) == GROUND).then(|| format!("stored_p_{}", network.name(node)))
}
