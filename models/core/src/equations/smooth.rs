//! Whether what a model of equations predicts is differentiable by its parameters.
//!
//! Next file to read: [`crate::sensitivity`].

use std::collections::BTreeMap;

use super::def::EquationsDef;
use super::expression::Expression;
use super::inline::Names;
use super::program::Program;
use crate::memory::Memory;

/// Why the derivatives by the parameters that no constant fixes are not to be had, if so. Rates and outputs, without names of outputs in them, in
/// their order.
pub(super) fn fault(
    def: &EquationsDef,
    names: &Names<'_>,
    constants: &BTreeMap<String, f64>,
    [rates, outputs]: [&[(Expression, Program)]; 2],
    memories: &[Memory],
) -> Option<String> {
    // States move with what is estimated; inputs and constants do not.
    let moves = |name: &str| names.input(name).is_none() && !constants.contains_key(name);
    let of_states = rates.iter().zip(&def.states).map(|((e, _), state)| (e, "rate of", &state.name));
    let of_outputs = outputs.iter().zip(&def.outputs).map(|((e, _), output)| (e, "output", &output.name));
    let jump =
        of_states.chain(of_outputs).find(|(e, ..)| e.jumps(&moves)).map(|(_, what, name)| (what, name));
    let starts_with_a_jump = |text: &str| Expression::parse(text).is_ok_and(|e| e.jumps(&moves));
    let start = def.states.iter().find(|state| starts_with_a_jump(&state.initial));
    if let Some((what, name)) = jump.or(start.map(|state| ("initial value of", &state.name))) {
        return Some(format!(
            "its {what} `{name}` jumps, by `sign`, `step`, `if`, a comparison or the slope of a delayed input, where parameters move it"
        ));
    }
    memories.first().map(|memory| format!("it reads the past of `{}`", memory.of))
}
