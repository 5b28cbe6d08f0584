//! Input files of svZeroDSolver as networks of `rcr-network`.
//!
//! Next files to read: [`file`] for what is read, [`blocks`] for what becomes of it.

mod activation;
mod blocks;
mod chambers;
mod driven;
mod file;
mod formula;
mod heart;
mod initial;
mod junctions;
mod kind;
mod layout;
mod names;
mod network;
mod outlets;
mod signal;
mod vessels;

use serde_json::Value;

use super::plan::{Course, Inputs, Origin, Plan, Unknown};
use blocks::Blocks;
use file::{File, Simulation};
use network::Kind;

/// Reads a file.
pub(super) fn plan(name: &str, text: &str) -> Result<Plan, String> {
    let file = file::read(text)?;
    refuse_blocks(&file)?;
    let mut blocks = Blocks::new(&file)?;
    let simulation = &file.simulation_parameters;
    let period = period(&blocks, simulation)?;
    blocks.sample_formulas(period)?;
    let driven = blocks.network.prescribe(&blocks.courses);
    blocks.network.mend(period);
    blocks.courses.extend(driven);
    let mut course = course(&file)?;
    let mut notes = Vec::new();
    if simulation.use_cycle_to_cycle_error {
        notes.push(format!(
            "use_cycle_to_cycle_error: the program goes on for more periods than the {} of the file until they repeat; the study has these, and \
             starlings simulate --periodic {period} gives what repeats",
            course.cycles
        ));
    }
    let initial = initial::states(&file, &blocks, &mut course, &mut notes)?;
    let Blocks { mut network, mut courses, channels, mut unknowns, activations, .. } = blocks;
    network.notes.extend(notes);
    courses.extend(activations.iter().map(|(name, shape)| shape.samples(name, period)));
    for course in &mut courses {
        if let [value] = course.values[..] {
            (course.times, course.values) = (vec![0.0, period], vec![value; 2]);
        }
    }
    if unknowns.is_empty() {
        unknowns = first_vessel(&network.elements)?;
    }
    let points = simulation.number_of_time_pts_per_cardiac_cycle.unwrap_or(101);
    if points < 2 {
        return Err("simulation_parameters.number_of_time_pts_per_cardiac_cycle: give at least 2".to_owned());
    }
    Ok(Plan {
        name: crate::names::Names::default().take(name),
        program: "svZeroDSolver",
        kind: "rcr-network",
        layout: layout::lines(&network),
        constants: Vec::new(),
        unknowns,
        channels: once_each(channels),
        inputs: Inputs::new(&courses, period),
        points,
        course,
        initial,
        omissions: network.omissions,
        notes: network.notes,
    })
}

/// The resistance or the compliance of the first vessel that has one.
fn first_vessel(elements: &[network::Element]) -> Result<Vec<Unknown>, String> {
    let unknown = elements.iter().find_map(|element| match element.kind {
        Kind::Resistance(value) => {
            Some(Unknown { name: format!("R_{}", element.name), unit: "dyn s/cm^5", value })
        }
        Kind::Loss { quadratic: value, .. } => {
            Some(Unknown { name: format!("Kq_{}", element.name), unit: "g/cm^7", value })
        }
        Kind::Capacitor { value, outside: None } => {
            Some(Unknown { name: format!("C_{}", element.name), unit: "cm^5/dyn", value })
        }
        _ => None,
    });
    Ok(vec![
        unknown.ok_or(
            "no vessel and no outlet has a resistance or a compliance: there is nothing to estimate",
        )?,
    ])
}

fn once_each(channels: Vec<(String, &'static str)>) -> Vec<(String, &'static str)> {
    let mut kept: Vec<(String, &'static str)> = Vec::with_capacity(channels.len());
    for channel in channels {
        if !kept.contains(&channel) {
            kept.push(channel);
        }
    }
    kept
}

/// Names the blocks of the file that no model here has.
fn refuse_blocks(file: &File) -> Result<(), String> {
    let mut missing = Vec::new();
    for (i, block) in file.external_solver_coupling_blocks.iter().enumerate() {
        let kind = block.get("type").and_then(Value::as_str).unwrap_or("unknown type");
        missing.push(format!("external_solver_coupling_blocks[{i}] ({kind})"));
    }
    if missing.is_empty() {
        return Ok(());
    }
    Err(format!(
        "{} {} not in `rcr-network`: run svZeroDSolver itself as an external solver for a file that another solver drives",
        missing.join(", "),
        if missing.len() == 1 { "is" } else { "are" }
    ))
}

/// The period that all signals of the file have.
fn period(blocks: &Blocks, simulation: &Simulation) -> Result<f64, String> {
    let mut found = blocks.period.as_ref().map(|(period, place)| (*period, place.as_str()));
    for course in blocks.courses.iter().filter(|course| course.values.len() > 1) {
        let own = course.times[course.times.len() - 1];
        match found {
            Some((period, other)) if (own - period).abs() > 1e-6 * period => {
                return Err(format!(
                    "`{other}` has a period of {period} and `{}` one of {own}: give all signals the same",
                    course.name
                ));
            }
            Some(_) => {}
            None => found = Some((own, &course.name)),
        }
    }
    let given = simulation.cardiac_period.filter(|period| *period != 0.0);
    match (found, given) {
        (Some((period, _)), Some(given)) if (given - period).abs() > 1e-6 * period => {
            Err(format!("simulation_parameters.cardiac_period: {given}, but the signals have {period}"))
        }
        (Some((period, _)), _) => Ok(period),
        (None, Some(given)) if given > 0.0 && given.is_finite() => Ok(given),
        (None, Some(given)) => {
            Err(format!("simulation_parameters.cardiac_period: {given} is not above zero"))
        }
        (None, None) => Ok(1.0),
    }
}

/// Where the program starts and which of its periods it shows.
fn course(file: &File) -> Result<Course, String> {
    let simulation = &file.simulation_parameters;
    if simulation.coupled_simulation {
        return Err(
            "simulation_parameters.coupled_simulation: a network that another solver drives has no inputs of its own"
                .to_owned(),
        );
    }
    let cycles = simulation
        .number_of_cardiac_cycles
        .ok_or("simulation_parameters.number_of_cardiac_cycles: not given, and needed")?;
    if cycles == 0 {
        return Err("simulation_parameters.number_of_cardiac_cycles: give at least 1".to_owned());
    }
    let from = if simulation.is_from_steady() { Origin::Steady } else { Origin::Zero };
    let all = simulation.output_all_cycles;
    Ok(Course { from, cycles, all, settled: None })
}
