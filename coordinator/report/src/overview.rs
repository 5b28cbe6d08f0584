//! The picture of a result: predicted against measured beside the parameter intervals, as one SVG file.
//!
//! It stands alone: colours, sizes and style are in it. Next file to read: [`super::plot::scene`].

use std::fmt::Write as _;

use super::data::{ChannelPlot, ParameterRow, ReportData};
use super::page::figures::fit;
use super::plot::drawing::standalone_style;
use super::plot::figure::with_unit;
use super::plot::interval::{self, BarArea};
use super::plot::palette::{ALL, BLUE, Colour, INK, MUTED, PURPLE};
use super::plot::svg::{escape, head};
use super::{headline, number};

const WIDTH: f64 = 900.0;
const HEIGHT: f64 = 420.0;
/// Where the title ends and the two panels begin.
const HEAD: f64 = 78.0;
/// Width of the left panel.
const LEFT: f64 = 580.0;
/// More parameters than this do not fit.
const ROWS: usize = 5;
/// Letters that fit on a line of the right panel.
const LETTERS: usize = 38;

/// Draws the overview: 900 × 420, on white, complete in itself.
pub fn overview_svg(data: &ReportData) -> String {
    let title = format!("{}: result of the run", data.study);
    let size = format!("width=\"{WIDTH}\" height=\"{HEIGHT}\" viewBox=\"0 0 {WIDTH} {HEIGHT}\"");
    let mut text = head(&size, &title, &headline::of(data));
    let _ = write!(
        text,
        "<style>text{{font:14px Helvetica,Arial,sans-serif;fill:{}}}.tick,.note{{fill:{}}}.title{{font:bold 19px \
         Helvetica,Arial,sans-serif}}.axis{{fill:none;stroke:{}}}{}</style><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>",
        INK.hex,
        MUTED.hex,
        MUTED.hex,
        standalone_style(&ALL)
    );
    let names = [data.study.as_str(), data.model.as_str()];
    let line = names.into_iter().filter(|name| !name.is_empty()).collect::<Vec<_>>().join(" · ");
    write(&mut text, (14.0, 32.0), &line, "class=\"title\"");
    legend(&mut text);
    match shown_channel(&data.channels) {
        Some(channel) => {
            let size = (LEFT - 14.0, HEIGHT - HEAD - 8.0);
            text += &fit::scene(channel, &data.time_unit).standalone((14.0, HEAD), size);
        }
        None => write(&mut text, (14.0, HEAD + 60.0), "no prediction stored", "class=\"note\""),
    }
    intervals(&mut text, data);
    text + "</svg>\n"
}

fn write(text: &mut String, (x, y): (f64, f64), words: &str, attributes: &str) {
    let _ = write!(text, "<text {attributes} x=\"{x}\" y=\"{y}\">{}</text>", escape(words));
}

/// The channel that shows most: one that was fitted in part, otherwise the first.
fn shown_channel(channels: &[ChannelPlot]) -> Option<&ChannelPlot> {
    let partly = |c: &&ChannelPlot| c.held_out_rmse.is_some() && fit::trained(c).is_some();
    channels.iter().find(partly).or_else(|| channels.first())
}

fn legend(text: &mut String) {
    let entries: [(f64, &str, Colour); 3] = [
        (14.0, "measured", INK),
        (124.0, "predicted, training span", BLUE),
        (330.0, "predicted, held out", PURPLE),
    ];
    for (x, words, colour) in entries {
        let _ =
            write!(text, "<rect x=\"{x}\" y=\"55\" width=\"18\" height=\"2.5\" fill=\"{}\"/>", colour.hex);
        write(text, (x + 24.0, 61.0), words, "class=\"note\"");
    }
}

fn intervals(text: &mut String, data: &ReportData) {
    let (left, right) = (LEFT + 18.0, WIDTH - 16.0);
    let rows = &data.parameters[..data.parameters.len().min(ROWS)];
    let height = 290.0 / rows.len().max(3) as f64;
    for (k, row) in rows.iter().enumerate() {
        let top = height.mul_add(k as f64, HEAD + 16.0);
        let value = interval_text(row);
        write(text, (left, top), &name_beside(row, &value), "");
        write(text, (right, top), &value, "text-anchor=\"end\"");
        *text += &interval::bars(row, data.log_axis(&row.name), BarArea { left, right, middle: top + 19.0 });
    }
    let note = "blue: after the data, grey: before";
    let note = match data.parameters.len() - rows.len() {
        0 => note.to_owned(),
        more => format!("{note}; {more} more"),
    };
    write(text, (left, HEIGHT - 14.0), &note, "class=\"note\"");
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
