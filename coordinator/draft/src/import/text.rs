//! The text of a study that was imported, with comments that say what is the file's and what is not.
//!
//! Next file to read: [`super::write`].

use std::fmt::Write;

use super::plan::{Origin, Plan};
use crate::files::quoted;

/// Parts of a study that are known only when its model has run.
#[derive(Debug, Default)]
pub(super) struct Known {
    /// Whether `initial.csv` holds the state at the start.
    pub(super) initial: bool,
    /// Standard deviations of the channels' noise, in their order; without one, the channel's is 1.
    pub(super) noise: Vec<f64>,
    /// One sentence each, of what the model's run told.
    pub(super) notes: Vec<String>,
}

/// Factor of one standard deviation of the priors.
const FACTOR: f64 = 1.5;

/// Writes the study file.
pub(super) fn text(plan: &Plan, known: &Known) -> String {
    let mut text = String::new();
    // Writing to a text cannot fail.
    let _ = write_all(&mut text, plan, known);
    text
}

fn write_all(text: &mut String, plan: &Plan, known: &Known) -> std::fmt::Result {
    let program = plan.program;
    writeln!(
        text,
        "# {} of {program} as a study: `starlings check study.toml` says what a run would do.",
        plan.name
    )?;
    writeln!(
        text,
        "# Model and inputs are the file's. What it does not say is marked `TODO`: recordings, noise and unknowns."
    )?;
    for note in plan.notes.iter().chain(&known.notes) {
        writeln!(text, "# Note: {note}")?;
    }
    writeln!(text, "\n[study]\nname = {}", quoted(&plan.name))?;
    writeln!(text, "says = {}", quoted(&format!("Imported from {program}.")))?;
    writeln!(text, "seed = 1\ntime_unit = \"s\"\n\n[model]\nkind = \"{}\"", plan.kind)?;
    if known.initial {
        let start = match (plan.course.all, plan.course.from) {
            (false, _) => format!("the last of the periods that {program} runs"),
            (true, Origin::Rest) => "all periods: rest".to_owned(),
            (true, Origin::Steady) => {
                "all periods: the steady state under the means of the inputs".to_owned()
            }
            (true, Origin::Zero) => "all periods: pressures and flows of zero".to_owned(),
        };
        writeln!(text, "initial = \"initial.csv\"      # the start of {start}")?;
    }
    if !plan.constants.is_empty() {
        writeln!(text, "\n[model.constants]")?;
        plan.constants.iter().try_for_each(|(name, number)| writeln!(text, "{name} = {number:?}"))?;
    }
    writeln!(text, "\n[model.layout]\n{}", plan.layout.trim_end())?;
    writeln!(
        text,
        "\n# TODO: what you do not know. These begin at the file's values; every other value is fixed at what stands above."
    )?;
    for unknown in &plan.unknowns {
        writeln!(text, "[[parameters]]\nname = {}\nunit = {}", quoted(&unknown.name), quoted(unknown.unit))?;
        writeln!(
            text,
            "prior = {{ transform = \"log\", median = {:?}, factor = {FACTOR:?} }}\n",
            unknown.value
        )?;
    }
    record(text, plan, known)
}

fn record(text: &mut String, plan: &Plan, known: &Known) -> std::fmt::Result {
    writeln!(
        text,
        "# TODO: your recording in place of predicted.csv, which holds what the model itself predicts, without noise; and the\n\
         # standard deviation of its errors (here 2 % of the range)."
    )?;
    writeln!(text, "[[records]]\nname = \"predicted\"\nfile = \"predicted.csv\"\ntime = \"time\"")?;
    let inputs = plan.inputs.signals.iter().map(|s| format!("{} = \"inputs.csv:{}\"", s.name, s.name));
    writeln!(text, "inputs = {{ {} }}", inputs.collect::<Vec<_>>().join(", "))?;
    writeln!(text, "channels = [")?;
    for (i, (output, unit)) in plan.channels.iter().enumerate() {
        let noise = known.noise.get(i).copied().unwrap_or(1.0);
        let (output, unit) = (quoted(output), quoted(unit));
        writeln!(text, "    {{ column = {output}, output = {output}, unit = {unit}, noise = {noise:?} }},")?;
    }
    writeln!(text, "]")
}
