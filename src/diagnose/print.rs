//! A diagnosis on a terminal: verdict, warnings, the library.

use std::path::Path;

use starlings_coordinator::diagnose::Diagnosed;
use starlings_coordinator::diagnose::result::{ParameterFound, ScenarioFound};

use crate::console::{line, note, number, table, text};
use crate::failure::Failure;

/// Prints the answer.
pub(super) fn print(found: &Diagnosed, folder: &Path) -> Result<(), Failure> {
    line(format_args!("{}: {}", found.study, found.says))?;
    for warning in &found.warnings {
        line(format_args!("warning: {warning}"))?;
    }
    line("\nscenarios")?;
    let heading = [
        "name",
        "probability",
        "log evidence over no fault",
        "severity",
        "90 % interval",
        "left, in noise²",
        "explains",
    ];
    let heading = heading.map(str::to_owned).to_vec();
    let rows = found.scenarios.iter().map(row);
    text(table(&std::iter::once(heading).chain(rows).collect::<Vec<_>>(), false))?;
    if let Some(likeliest) = found.scenarios.iter().find(|s| found.named.first() == Some(&s.name)) {
        line(format_args!("\nparameters of `{}`", likeliest.name))?;
        let heading = ["name", "estimate", "sd", "90 % interval", "unit"].map(str::to_owned).to_vec();
        let rows = likeliest.parameters.iter().map(|p| {
            let sd = number(p.sd, Some(p.sd));
            vec![p.name.clone(), number(p.estimate, Some(p.sd)), sd, interval(p), p.unit.clone()]
        });
        text(table(&std::iter::once(heading).chain(rows).collect::<Vec<_>>(), false))?;
    }
    line(format_args!("\n{}", found.conditional_on))?;
    note(format_args!("written: {}", folder.display()));
    Ok(())
}

fn row(s: &ScenarioFound) -> Vec<String> {
    let none = || "-".to_owned();
    let severity = s.severity();
    vec![
        s.name.clone(),
        format!("{:.3}", s.probability),
        s.log_bayes_factor.map_or_else(none, |v| format!("{v:.1}")),
        severity.map_or_else(none, |p| number(p.estimate, Some(p.sd))),
        severity.map_or_else(none, interval),
        s.misfit.map_or_else(none, |v| format!("{v:.3}")),
        if s.explains { "yes" } else { "no" }.to_owned(),
    ]
}

fn interval(p: &ParameterFound) -> String {
    let [lo, hi] = p.interval90.map(|v| number(v, Some(p.sd)));
    format!("{lo} to {hi}")
}
