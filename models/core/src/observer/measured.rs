//! Which state component each observed row measures, and what rows together say of it.
//!
//! Next file to read: [`super::nudging`].

use std::ops::Range;

use super::{Correction, Wiring};
use crate::SetupError;
use crate::setup::ObserverDef;
use crate::{Quantity, Spec, nearest};

/// One observed row and the state component that it measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Measured {
    /// Row of the predicted outputs.
    pub row: usize,
    /// Component of the outputs that it shows.
    pub output: usize,
    /// State component.
    pub state: usize,
}

/// The state component behind every observed row that measures one: the definition's `corrects` first, then the model's own
/// `measures`, which do not count where another observer of the kind stands beside it.
///
/// # Errors
/// When a name in `corrects` is unknown, or the sizes of an output and its state differ.
pub(crate) fn measured(def: &ObserverDef, wiring: &Wiring<'_>) -> Result<Vec<Measured>, SetupError> {
    let spec = wiring.spec;
    for (output, state) in &def.corrects {
        find(&spec.outputs, output, "output")?;
        find(&spec.states, state, "state")?;
    }
    let mut found = Vec::new();
    let mut row = 0;
    for output in wiring.outputs {
        let Some(rows) = shown(spec, output)? else {
            row += 1;
            continue;
        };
        if let Some(states) = behind(def, spec, output, rows.len())? {
            let shown = rows.clone().zip(states).enumerate();
            found.extend(shown.map(|(i, (output, state))| Measured { row: row + i, output, state }));
        }
        row += rows.len();
    }
    Ok(found)
}

/// The states that an observed output, or one component of it, measures.
fn behind(
    def: &ObserverDef,
    spec: &Spec,
    output: &str,
    n: usize,
) -> Result<Option<Range<usize>>, SetupError> {
    let named = |name: &str| {
        let mut measures = spec.measures.iter().filter(|_| !def.named_only);
        let own = || measures.find(|(of, _)| of == name).map(|(_, state)| state.as_str());
        def.corrects.get(name).map(String::as_str).or_else(own)
    };
    let (field, index) = match output.strip_suffix(']').and_then(|o| o.rsplit_once('[')) {
        Some((field, index)) if named(output).is_none() => (field, index.parse::<usize>().ok()),
        _ => (output, None),
    };
    let Some(state) = named(field) else { return Ok(None) };
    let states = find(&spec.states, state, "state")?;
    let outputs = find(&spec.outputs, field, "output")?;
    if outputs.len() != states.len() {
        return Err(SetupError::Invalid(format!(
            "output `{field}` has {} components and state `{state}` has {}: one cannot correct the other",
            outputs.len(),
            states.len()
        )));
    }
    let first = states.start + index.unwrap_or(0);
    Ok(Some(first..first + n))
}

/// The mean of observed − predicted over rows that show the same, and the time since any of them was observed before; `None` when none
/// is now.
pub(super) fn mean_innovation(at: &Correction<'_>, rows: &[usize]) -> Option<(f64, f64)> {
    let (mut sum, mut n) = (0.0, 0_u32);
    for &row in rows.iter().filter(|&&row| !at.observed[row].is_nan()) {
        sum += at.observed[row] - at.predicted[row];
        n += 1;
    }
    let span = rows.iter().map(|&row| at.spans[row]).fold(f64::INFINITY, f64::min);
    (n > 0).then(|| (sum / f64::from(n), span))
}

/// What rows that each pull by themselves pull together: the mean of observed − predicted, weighted by the times since each was observed
/// before, and the sum of those times; `None` when none is observed now.
pub(super) fn pull(at: &Correction<'_>, rows: &[usize]) -> Option<(f64, f64)> {
    let seen = || rows.iter().copied().filter(|&row| !at.observed[row].is_nan());
    let longest = seen().map(|row| at.spans[row]).reduce(f64::max)?;
    let (mut sum, mut weights) = (0.0, 0.0);
    for row in seen() {
        let weight = at.spans[row] / longest;
        sum += weight * (at.observed[row] - at.predicted[row]);
        weights += weight;
    }
    Some((sum / weights, weights * longest))
}

/// The outputs of a list to which these rows belong, each once; a field by its name.
///
/// # Errors
/// When an output is unknown.
pub fn outputs_of(spec: &Spec, outputs: &[String], rows: &[usize]) -> Result<Vec<String>, SetupError> {
    let (mut first, mut found) = (0, Vec::new());
    for output in outputs {
        let n = shown(spec, output)?.map_or(1, |components| components.len());
        let field = output.split('[').next().unwrap_or(output);
        if rows.iter().any(|row| (first..first + n).contains(row))
            && !found.iter().any(|known| known == field)
        {
            found.push(field.to_owned());
        }
        first += n;
    }
    Ok(found)
}

/// Components of an observed output; `None` for a recorded state, which takes one row and measures nothing.
pub(super) fn shown(spec: &Spec, name: &str) -> Result<Option<Range<usize>>, SetupError> {
    let unnamed = Spec::range_of(&spec.outputs, name).is_none();
    if unnamed && spec.scalar_state(name).is_some() {
        return Ok(None);
    }
    find(&spec.outputs, name, "output").map(Some)
}

/// Components of a named quantity or of one component of it.
pub(super) fn find(list: &[Quantity], name: &str, what: &'static str) -> Result<Range<usize>, SetupError> {
    Spec::range_of(list, name).ok_or_else(|| SetupError::Unknown {
        what,
        name: name.to_owned(),
        nearest: nearest(name, list.iter().map(|q| &q.name)),
    })
}
