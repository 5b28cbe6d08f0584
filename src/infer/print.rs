//! An inference on a terminal: verdict, warnings, the tables.

use std::path::Path;

use starlings_coordinator::infer::Inference;
use starlings_coordinator::infer::result::{CoefficientFound, MissingFound, UnknownFound};

use crate::console::{line, note, number, table, text};
use crate::failure::Failure;

/// Prints the answer.
pub(crate) fn print(found: &Inference, folder: &Path) -> Result<(), Failure> {
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
    if let Some(missing) = &found.missing {
        terms(missing)?;
    }
    line(format_args!("\ncovariance of the noise per {}", found.time_unit))?;
    text(table(&noise(found), false))?;
    line(format_args!("\n{}", found.conditional_on))?;
    note(format_args!("written: {}", folder.display()));
    Ok(())
}

/// Terms that the drift lacks, or the strongest candidates where it lacks none.
fn terms(missing: &MissingFound) -> Result<(), Failure> {
    let of = missing.candidates;
    if missing.named.is_empty() {
        line(format_args!("\nno term is missing among {of} candidates; the strongest of them"))?;
        let heading = ["name", "χ²", "by chance"].map(str::to_owned).to_vec();
        let rows = missing.strongest.iter().take(3);
        let rows = rows.map(|s| vec![s.name.clone(), format!("{:.1}", s.chi_squared), chance(s.by_chance)]);
        text(table(&std::iter::once(heading).chain(rows).collect::<Vec<_>>(), false))?;
    } else {
        line(format_args!("\nterms that the drift lacks, of {of} candidates"))?;
        let heading =
            ["name", "estimate", "sd", "90 % interval", "χ²", "by chance", "as good"].map(str::to_owned);
        let rows = missing.named.iter().map(|n| {
            let shown = |value: f64| number(value, Some(n.sd));
            let [lo, hi] = n.interval90;
            let interval = format!("{} to {}", shown(lo), shown(hi));
            let score = [format!("{:.1}", n.chi_squared), chance(n.by_chance), n.ties.join(", ")];
            [vec![n.name.clone(), shown(n.estimate), shown(n.sd), interval], score.to_vec()].concat()
        });
        text(table(&std::iter::once(heading.to_vec()).chain(rows).collect::<Vec<_>>(), false))?;
    }
    if let Some(left) = &missing.left {
        let (chi, terms, p) = (left.chi_squared, left.terms, chance(left.by_chance));
        line(format_args!("what is left of them together: χ² {chi:.1} for {terms} terms, by chance {p}"))?;
    }
    if let Some(held_out) = missing.held_out.as_ref().filter(|_| !missing.named.is_empty()) {
        let (gain, n) = (held_out.gain, held_out.n_step);
        line(format_args!("held-out records: {gain:.1} nats better with the named terms over {n} steps"))?;
    }
    Ok(())
}

fn chance(p: f64) -> String {
    if p <= 0.0 {
        return "below 1e-300".to_owned();
    }
    if p < 1e-3 { format!("{p:.0e}") } else { format!("{p:.3}") }
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
