//! Names by which blocks of a file refer to others: each must be that of a block.
//!
//! Whether what is named fits there is seen where it is joined: [`super::blocks`].

use starlings_models::{did_you_mean, nearest};

use super::file::File;

/// Refuses a name that no block has, with its place and the name that it may stand for.
pub(super) fn check(file: &File) -> Result<(), String> {
    let boundaries: Vec<&str> = file.boundary_conditions.iter().map(|b| b.bc_name.as_str()).collect();
    let vessels = file.vessels.iter().map(|vessel| vessel.vessel_name.as_str());
    let chambers = file.chambers.iter().map(|chamber| chamber.name.as_str());
    let blocks: Vec<&str> = vessels.chain(chambers).chain(boundaries.iter().copied()).collect();
    let (at_vessels, between) = (at_vessels(file), between(file));
    let used: Vec<&str> = at_vessels.iter().chain(&between).map(|(_, name)| *name).collect();
    let unknown = |what: &str, known: &[&str], (place, name): &(String, &str)| {
        // What nothing else refers to is what is likely meant.
        let free = known.iter().filter(|known| !used.contains(*known));
        let hint = match nearest(name, free).or_else(|| nearest(name, known)) {
            Some(near) => did_you_mean(near),
            None => format!("known are {}", known.join(", ")),
        };
        format!("{place}: no {what} is called `{name}`; {hint}")
    };
    if let Some(wrong) = at_vessels.iter().find(|(_, name)| !boundaries.contains(name)) {
        return Err(unknown("boundary condition", &boundaries, wrong));
    }
    match between.iter().find(|(_, name)| !blocks.contains(name)) {
        Some(wrong) => Err(unknown("vessel, chamber or boundary condition", &blocks, wrong)),
        None => Ok(()),
    }
}

/// The boundary conditions that vessels name, with their places.
fn at_vessels(file: &File) -> Vec<(String, &str)> {
    let mut found = Vec::new();
    for (i, vessel) in file.vessels.iter().enumerate() {
        let ends = &vessel.boundary_conditions;
        for (end, name) in [("inlet", &ends.inlet), ("outlet", &ends.outlet)] {
            let place = format!("vessels[{i}].boundary_conditions.{end}");
            found.extend(name.as_deref().map(|name| (place, name)));
        }
    }
    found
}

/// The blocks that junctions, valves and closed loops name, with their places.
fn between(file: &File) -> Vec<(String, &str)> {
    let mut found = Vec::new();
    let mut lists = Vec::new();
    for (i, junction) in file.junctions.iter().enumerate() {
        lists.push((format!("junctions[{i}].inlet_blocks"), &junction.inlet_blocks));
        lists.push((format!("junctions[{i}].outlet_blocks"), &junction.outlet_blocks));
    }
    for (i, closed) in file.closed_loop_blocks.iter().enumerate() {
        lists.push((format!("closed_loop_blocks[{i}].outlet_blocks"), &closed.outlet_blocks));
    }
    for (place, names) in lists {
        found.extend(names.iter().enumerate().map(|(k, name)| (format!("{place}[{k}]"), name.as_str())));
    }
    for (i, valve) in file.valves.iter().enumerate() {
        let (inside, place) = (&valve.params, format!("valves[{i}]"));
        let ends = [
            (format!("{place}.params.upstream_block"), &inside.upstream_block),
            (format!("{place}.upstream_block"), &valve.upstream_block),
            (format!("{place}.params.downstream_block"), &inside.downstream_block),
            (format!("{place}.downstream_block"), &valve.downstream_block),
        ];
        found.extend(ends.into_iter().filter_map(|(place, name)| Some((place, name.as_deref()?))));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::file::read;
    use super::check;

    /// What is said of two vessels with a junction, a valve and a loop, where one text stands in the place of another.
    fn said(from: &str, to: &str) -> String {
        let text = r#"{ "simulation_parameters": {},
            "boundary_conditions": [{ "bc_name": "VEN", "bc_type": "PRESSURE", "bc_values": {} },
                                    { "bc_name": "RCR1", "bc_type": "RCR", "bc_values": {} }],
            "vessels": [{ "vessel_id": 0, "vessel_name": "vein", "zero_d_element_type": "BloodVessel", "zero_d_element_values": {},
                          "boundary_conditions": { "inlet": "VEN" } },
                        { "vessel_id": 1, "vessel_name": "aorta", "zero_d_element_type": "BloodVessel", "zero_d_element_values": {},
                          "boundary_conditions": { "outlet": "RCR1" } }],
            "junctions": [{ "junction_name": "J", "junction_type": "NORMAL_JUNCTION", "inlet_blocks": ["vein"], "outlet_blocks": ["aorta"] }],
            "closed_loop_blocks": [{ "closed_loop_type": "", "outlet_blocks": ["aorta"] }],
            "valves": [{ "type": "ValveTanh", "name": "mitral",
                         "params": { "Rmax": 1, "Rmin": 1, "upstream_block": "vein", "downstream_block": "aorta" } }] }"#;
        let file = read(&text.replacen(from, to, 1)).expect("a file");
        check(&file).err().unwrap_or_default()
    }

    #[test]
    fn a_name_that_no_block_has_is_told_with_its_place_and_the_nearest() {
        assert_eq!(said("", ""), "");
        for (from, to, wanted) in [
            (
                r#""outlet": "RCR1""#,
                r#""outlet": "RCR_1""#,
                "vessels[1].boundary_conditions.outlet: no boundary condition is called `RCR_1`; did you mean `RCR1`?",
            ),
            (
                r#""upstream_block": "vein""#,
                r#""upstream_block": "veinn""#,
                "valves[0].params.upstream_block: no vessel, chamber or boundary condition is called `veinn`; did you mean `vein`?",
            ),
            (
                r#""outlet_blocks": ["aorta"] }],
            "valves""#,
                r#""outlet_blocks": ["nope"] }],
            "valves""#,
                "closed_loop_blocks[0].outlet_blocks[0]: no vessel, chamber or boundary condition is called `nope`; known are vein, aorta, \
                 VEN, RCR1",
            ),
        ] {
            assert_eq!(said(from, to), wanted);
        }
    }
}
