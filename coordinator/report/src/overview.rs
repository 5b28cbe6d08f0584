//! The picture of a result: predicted against measured beside the parameter intervals, as one SVG file.

use plotters::element::PathElement;
use plotters::style::RGBColor;
use plotters::style::WHITE;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::data::{ChannelPlot, ParameterRow, ReportData};
use super::page::figures::fit;
use super::plot::figure::with_unit;
use super::plot::interval::{self, BarArea};
use super::plot::palette::{BLUE, INK, MUTED, VERMILION};
use super::plot::scene::{Surface, picture, stroke, units, whole, write, write_title};
use super::{ReportError, headline, number};

const WIDTH: i32 = 900;
const HEIGHT: i32 = 420;
/// Where the title ends and the two panels begin.
const HEAD: i32 = 78;
/// Width of the left panel.
const LEFT: i32 = 580;
/// More parameters than this do not fit.
const ROWS: usize = 5;
/// Letters that fit on a line of the right panel.
const LETTERS: usize = 38;

const MIDDLE_LEFT: Pos = Pos { h_pos: HPos::Left, v_pos: VPos::Center };
const MIDDLE_RIGHT: Pos = Pos { h_pos: HPos::Right, v_pos: VPos::Center };

/// Draws the overview: about 900 × 420, on white, complete in itself.
///
/// # Errors
///
/// The picture cannot be drawn.
pub fn overview_svg(data: &ReportData) -> Result<String, ReportError> {
    let title = format!("{}: result of the run", data.study);
    picture((WIDTH, HEIGHT), &title, &headline::of(data), |surface| {
        surface.fill(&WHITE).map_err(ReportError::drawing)?;
        title_line(surface, data)?;
        legend(surface)?;
        let (_, panels) = surface.split_vertically(units(HEAD));
        let panels = panels.margin(0, units(6), units(10), 0);
        let (left, right) = panels.split_horizontally(units(LEFT));
        match shown_channel(&data.channels) {
            Some(channel) => fit::scene(channel, &data.time_unit).draw(&left)?,
            None => write(&left, (units(14), units(60)), "no prediction stored", MUTED, MIDDLE_LEFT)?,
        }
        intervals(&right, data)
    })
}

/// The channel that shows most: one that was fitted in part, otherwise the first.
fn shown_channel(channels: &[ChannelPlot]) -> Option<&ChannelPlot> {
    let partly = |c: &&ChannelPlot| c.held_out_rmse.is_some() && fit::trained(c).is_some();
    channels.iter().find(partly).or_else(|| channels.first())
}

fn title_line(surface: &Surface<'_>, data: &ReportData) -> Result<(), ReportError> {
    let names = [data.study.as_str(), data.model.as_str()];
    let line = names.into_iter().filter(|name| !name.is_empty()).collect::<Vec<_>>().join(" · ");
    write_title(surface, (units(14), units(26)), &line)
}

fn legend(surface: &Surface<'_>) -> Result<(), ReportError> {
    let entries: [(i32, &str, RGBColor); 3] = [
        (14, "measured", INK),
        (124, "predicted, training span", BLUE),
        (330, "predicted, held out", VERMILION),
    ];
    let height = units(56);
    for (x, text, colour) in entries {
        let sample = PathElement::new(vec![(units(x), height), (units(x + 18), height)], stroke(colour, 2.5));
        surface.draw(&sample).map_err(ReportError::drawing)?;
        write(surface, (units(x + 24), height), text, MUTED, MIDDLE_LEFT)?;
    }
    Ok(())
}

fn intervals(surface: &Surface<'_>, data: &ReportData) -> Result<(), ReportError> {
    let right = units(WIDTH - LEFT - 10 - 16);
    let rows = &data.parameters[..data.parameters.len().min(ROWS)];
    let height = 290 / whole(rows.len().max(3));
    for (k, row) in rows.iter().enumerate() {
        let top = units(12 + height * whole(k));
        let value = interval_text(row);
        write(surface, (units(8), top), &name_beside(row, &value), INK, MIDDLE_LEFT)?;
        write(surface, (right, top), &value, INK, MIDDLE_RIGHT)?;
        let area = BarArea { left: units(8), right, middle: top + units(24) };
        interval::draw(surface, row, data.log_axis(&row.name), area)?;
    }
    let note = "blue: after the data, grey: before";
    let note = match data.parameters.len() - rows.len() {
        0 => note.to_owned(),
        more => format!("{note}; {more} more"),
    };
    write(surface, (units(8), units(HEIGHT - HEAD - 18)), &note, MUTED, MIDDLE_LEFT)
}

/// The name with its unit, without it or shortened, as the room beside `value` allows.
fn name_beside(row: &ParameterRow, value: &str) -> String {
    let room = LETTERS.saturating_sub(value.chars().count() + 2);
    let full = with_unit(&row.name, &row.unit);
    let name = if full.chars().count() <= room { full } else { row.name.clone() };
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= room {
        return name;
    }
    // Names of one family differ at their end: the middle goes.
    let head = room / 2;
    let tail = letters.len() - room.saturating_sub(head + 1);
    letters[..head].iter().chain(&['…']).chain(&letters[tail..]).collect()
}

fn interval_text(row: &ParameterRow) -> String {
    format!("{} ± {}", number::with_sd(row.estimate, row.sd), number::with_sd(2.0 * row.sd, row.sd))
}
