//! The result in one sentence.

use super::data::{ParameterRow, ReportData};
use super::number;

/// More parameters than this are counted, not listed.
const LISTED: usize = 4;

/// The headline of the data, or one made from its parameters and fit figures.
pub(crate) fn of(data: &ReportData) -> String {
    if let Some(said) = data.headline.as_ref().filter(|said| !said.trim().is_empty()) {
        return said.clone();
    }
    if data.parameters.is_empty() {
        return "The run has no estimate yet.".to_owned();
    }
    let mut listed: Vec<String> = data.parameters.iter().take(LISTED).map(estimate).collect();
    if data.parameters.len() > LISTED {
        listed.push(format!("and {} more", data.parameters.len() - LISTED));
    }
    let given = if data.residuals_first { " given the residuals" } else { "" };
    format!("{} (95\u{a0}% intervals{given}){}.", listed.join(", "), held_out(data))
}

fn estimate(row: &ParameterRow) -> String {
    let digits = |value| number::with_sd(value, row.sd);
    let unit = if row.unit.is_empty() { String::new() } else { format!("\u{a0}{}", row.unit) };
    format!(
        "{}\u{a0}=\u{a0}{} [{} to {}]{unit}",
        row.name,
        digits(row.estimate),
        digits(row.lo),
        digits(row.hi)
    )
}

/// The held-out error of the only channel that has one.
fn held_out(data: &ReportData) -> String {
    let mut channels =
        data.channels.iter().filter_map(|c| Some((c, c.held_out_rmse.filter(|v| v.is_finite())?)));
    match (channels.next(), channels.next()) {
        (Some((channel, rmse)), None) => format!(
            "; RMSE on held-out {} {} {}",
            channel.channel,
            number::significant(rmse, 3),
            channel.unit
        )
        .trim_end()
        .to_owned(),
        _ => String::new(),
    }
}
