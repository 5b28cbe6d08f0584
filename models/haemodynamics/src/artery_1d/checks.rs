//! What the vessels of a layout must satisfy one by one: names, sizes, numbers of cells.
//!
//! Whether they make a network is checked in [`super::network`], the next file to read.

use std::collections::HashSet;

use starlings_models_core::SetupError;
use starlings_models_core::layout::fault;

use super::layout::{Friction, NodeEntry, NodeKind, Segment, StiffnessParameter, stiffness_parameter};
use crate::MOST_CELLS;

/// Regions of all vessels together at most: the pressures of their ends are one full system of equations in every step.
const MOST_REGIONS: usize = 1000;

/// Names become parts of parameters, states and outputs, which expressions may use.
pub(super) fn name(path: &str, name: &str) -> Result<(), SetupError> {
    let fits = name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if fits { Ok(()) } else { Err(fault(path, format!("`{name}` is no name: use letters, digits and `_`"))) }
}

/// Refuses a law of stiffness that is not above zero over the radii of a segment, between whose ends it rises or falls.
fn wall(path: &str, segment: &Segment) -> Result<(), SetupError> {
    let Some(law) = segment.wall else { return Ok(()) };
    for radius in [segment.radius, segment.radius_to.unwrap_or(segment.radius)] {
        let stiffness = law.at(radius);
        if !(stiffness > 0.0 && stiffness.is_finite()) {
            let message = format!(
                "E h/R0 = k1 e^(k2 R0) + k3 is {stiffness} at a radius of {radius} cm: give a law above zero"
            );
            return Err(fault(path, message));
        }
    }
    Ok(())
}

/// Refuses a profile that has no friction, or another than that of the friction asked for.
fn profile(path: &str, segment: &Segment) -> Result<(), SetupError> {
    if !(segment.profile >= 2.0 && segment.profile.is_finite()) {
        let message =
            format!("profile is {}: give 2 for a parabola, more for a flatter profile", segment.profile);
        return Err(fault(path, message));
    }
    if segment.friction == Friction::Womersley && segment.profile > 2.0 {
        let message = format!(
            "profile is {}: the profile of friction = \"womersley\" follows from the flow, and is a parabola when that is \
             steady; leave one of the two out",
            segment.profile
        );
        return Err(fault(path, message));
    }
    Ok(())
}

/// Length in cm of a stenosis, where node `i` is one.
///
/// # Errors
/// When it is none above zero, or another kind of node has one.
pub(super) fn stenosis(i: usize, entry: &NodeEntry) -> Result<Option<f64>, SetupError> {
    let path = format!("nodes[{i}].length");
    match (entry.kind, entry.length) {
        (NodeKind::Stenosis, Some(length)) if length > 0.0 && length.is_finite() => Ok(Some(length)),
        (NodeKind::Stenosis, Some(length)) => {
            Err(fault(&path, format!("length is {length}: give a number of cm above zero")))
        }
        (NodeKind::Stenosis, None) => {
            Err(fault(&path, format!("`{}` has no length: give that of the stenosis in cm", entry.name)))
        }
        (_, Some(_)) => {
            Err(fault(&path, format!("`{}` is no stenosis: only a stenosis has a length", entry.name)))
        }
        (_, None) => Ok(None),
    }
}

/// Refuses what no vessel can be, too many cells, and vessels whose parameters would share a name.
pub(super) fn segments(segments: &[Segment]) -> Result<(), SetupError> {
    let (mut n_cell, mut n_region, mut names) = (0_usize, 0_usize, HashSet::new());
    for (i, segment) in segments.iter().enumerate() {
        let path = |key: &str| format!("segments[{i}].{key}");
        for (key, name) in [("name", &segment.name), ("from", &segment.from), ("to", &segment.to)] {
            self::name(&path(key), name)?;
        }
        if segments[..i].iter().any(|other| other.name == segment.name) {
            return Err(fault(&path("name"), format!("two segments are called `{}`", segment.name)));
        }
        if segment.from == segment.to {
            return Err(fault(&path("to"), format!("`{}` ends where it starts", segment.name)));
        }
        let sizes = [
            ("length", segment.length),
            ("radius", segment.radius),
            ("radius_to", segment.radius_to.unwrap_or(segment.radius)),
            ("thickness", segment.thickness),
            ("thickness_to", segment.thickness_to.unwrap_or(segment.thickness)),
        ];
        for (key, size) in sizes {
            if !(size > 0.0 && size.is_finite()) {
                return Err(fault(&path(key), format!("{key} is {size}: give a number of cm above zero")));
            }
        }
        wall(&path("wall"), segment)?;
        profile(&path("profile"), segment)?;
        let (cells, regions) = (segment.cells, segment.regions);
        (n_cell, n_region) = (n_cell.saturating_add(cells), n_region.saturating_add(regions));
        for (key, n, most) in [("cells", n_cell, MOST_CELLS), ("regions", n_region, MOST_REGIONS)] {
            if n > most {
                let message = format!("{n} {key} up to here: give at most {most} in all vessels together");
                return Err(fault(&path(key), message));
            }
        }
        if regions == 0 || !cells.is_multiple_of(regions) || cells / regions < 2 {
            let message = format!(
                "{cells} cells in {regions} regions: give a whole number of cells per region, at least two"
            );
            return Err(fault(&path("cells"), message));
        }
        for region in 0..regions {
            let StiffnessParameter { name, place, .. } =
                stiffness_parameter(segment, region, segments.len() == 1);
            if !names.insert(name.clone()) {
                let message =
                    format!("the stiffness of {place} is `{name}`, and so is another: rename one of the two");
                return Err(fault(&path("name"), message));
            }
        }
    }
    Ok(())
}
