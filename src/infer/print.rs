//! An inference on a terminal: verdict, warnings, the tables.

use std::path::Path;

use starlings_coordinator::infer::Inference;
use starlings_coordinator::infer::result::{CoefficientFound, UnknownFound};

use crate::console::{line, note, number, table, text};
use crate::failure::Failure;

/// Prints the answer.
pub(super) fn print(found: &Inference, folder: &Path) -> Result<(), Failure> {
    line(format_args!("{}: {}", found.study, found.verdict))?;
    for warning in &found.warnings {
        line(format_args!("warning: {warning}"))?;
    }
    line("\ncoefficients of the drift")?;
    let rows = found.coefficients.iter().map(coefficient);
    let heading = ["name", "estimate", "sd", "90 % interval", ""].map(str::to_owned).to_vec();
    text(table(&std::iter::once(heading.clone()).chain(rows).collect::<Vec<_>>(), false))?;
    if let Some(reduced) = &found.reduced {
        let (chi, degrees) = (reduced.chi_squared, reduced.degrees);
        line(format_args!("\nreduced model, χ² {chi:.1} for {degrees} degrees of freedom"))?;
        let rows = reduced.unknowns.iter().map(unknown);
        text(table(&std::iter::once(heading).chain(rows).collect::<Vec<_>>(), false))?;
    }
    line(format_args!("\ncovariance of the noise per {}", found.time_unit))?;
    text(table(&noise(found), false))?;
    line(format_args!("\n{}", found.conditional_on))?;
    note(format_args!("written: {}", folder.display()));
    Ok(())
}

fn coefficient(c: &CoefficientFound) -> Vec<String> {
    let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| number(v, c.sd));
    let interval = c
        .interval90
        .map_or_else(|| "-".to_owned(), |[lo, hi]| format!("{} to {}", number(lo, c.sd), number(hi, c.sd)));
    let says = match (c.observed, c.may_be_zero) {
        (false, _) => "not observed",
        (true, Some(true)) => "may be zero",
        (true, _) => "",
    };
    vec![c.name.clone(), shown(c.estimate), shown(c.sd), interval, says.to_owned()]
}

fn unknown(u: &UnknownFound) -> Vec<String> {
    let shown = |value: f64| number(value, Some(u.sd));
    let [lo, hi] = u.interval90;
    vec![
        u.name.clone(),
        shown(u.estimate),
        shown(u.sd),
        format!("{} to {}", shown(lo), shown(hi)),
        String::new(),
    ]
}

fn noise(found: &Inference) -> Vec<Vec<String>> {
    let noise = &found.diffusion;
    let heading = std::iter::once(String::new()).chain(found.equations.iter().cloned());
    let row = |i: usize| {
        let cells = noise.matrix[i].iter().zip(&noise.sd[i]);
        let cells = cells.map(|(value, sd)| number(*value, Some(*sd)));
        std::iter::once(found.equations[i].clone()).chain(cells).collect()
    };
    std::iter::once(heading.collect()).chain((0..noise.matrix.len()).map(row)).collect()
}
