//! The result in one sentence.

use super::data::{ParameterRow, ReportData, Track};
use super::number;

/// More parameters than this are counted, not listed.
const LISTED: usize = 4;

/// The headline of the data, or one made from its parameters and fit figures.
pub(crate) fn of(data: &ReportData) -> String {
    if let Some(said) = data.headline.as_ref().filter(|said| !said.trim().is_empty()) {
        return said.clone();
    }
    if data.parameters.is_empty() {
        return so_far(data);
    }
    let mut listed: Vec<String> = data.parameters.iter().take(LISTED).map(estimate).collect();
    if data.parameters.len() > LISTED {
        listed.push(format!("and {} more", data.parameters.len() - LISTED));
    }
    let given = if data.residuals_first { " given the residuals" } else { "" };
    format!("{} (95\u{a0}% intervals{given}){}.", listed.join(", "), held_out(data))
}

fn estimate(row: &ParameterRow) -> String {
    valued(&row.name, &row.unit, [row.lo, row.estimate, row.hi], row.sd)
}

fn valued(name: &str, unit: &str, [lo, value, hi]: [f64; 3], sd: f64) -> String {
    let digits = |value| number::with_sd(value, sd);
    let unit = if unit.is_empty() { String::new() } else { format!("\u{a0}{unit}") };
    format!("{name}\u{a0}=\u{a0}{} [{} to {}]{unit}", digits(value), digits(lo), digits(hi))
}

/// What a run that is not finished has come to.
fn so_far(data: &ReportData) -> String {
    let last = |track: &Track| {
        let pass = track.passes.last()?;
        let ends = [*pass.lo.last()?, *pass.estimate.last()?, *pass.hi.last()?];
        // An interval of 95 % is about four sd long.
        Some(valued(&track.name, &track.unit, ends, 0.25 * (ends[2] - ends[0])))
    };
    let mut listed: Vec<String> = data.tracks.iter().filter_map(last).take(LISTED).collect();
    if listed.is_empty() {
        return "The run has no estimate yet.".to_owned();
    }
    if data.tracks.len() > LISTED {
        listed.push(format!("and {} more", data.tracks.len() - LISTED));
    }
    format!("The run is not finished; so far {} (95\u{a0}% intervals).", listed.join(", "))
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

#[cfg(test)]
mod tests {
    use super::super::data::PassTrack;
    use super::*;

    #[test]
    fn a_run_that_is_not_finished_says_what_it_has_come_to() {
        assert_eq!(of(&ReportData::default()), "The run has no estimate yet.");
        let pass = |pass, estimate: f64| PassTrack {
            pass,
            time: vec![1.0, 2.0],
            estimate: vec![0.0, estimate],
            lo: vec![0.0, estimate - 2.0],
            hi: vec![0.0, estimate + 2.0],
        };
        let track = Track {
            name: "k".to_owned(),
            unit: "N/m".to_owned(),
            passes: vec![pass(1, 30.0), pass(2, 40.0)],
            ..Track::default()
        };
        let said = of(&ReportData { tracks: vec![track], ..ReportData::default() }).replace('\u{a0}', " ");
        assert_eq!(said, "The run is not finished; so far k = 40.0 [38.0 to 42.0] N/m (95 % intervals).");
    }
}
