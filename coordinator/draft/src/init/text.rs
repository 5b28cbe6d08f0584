//! The text of a study, with comments that say what is known, what was guessed and what to do next.
//!
//! Next file to read: [`super::write`].

use std::fmt::{Result, Write};

use super::parts::{ChannelPart, Numbers, Part, Parts, Unknown};
use crate::files::quoted;

/// What is written as the noise of a channel that nobody gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Noise {
    /// The study finds it in the data.
    FromData,
    /// A part of the range.
    OfRange,
}

/// Writes the study file.
pub(super) fn text(parts: &Parts, noise: Noise) -> String {
    let mut text = String::new();
    // Writing to a text cannot fail.
    let _ = write_all(&mut text, parts, noise);
    text
}

fn write_all(text: &mut String, parts: &Parts, noise: Noise) -> Result {
    writeln!(
        text,
        "# A first version: what is marked `TODO` was guessed. `starlings check study.toml` says what a run would do,\n\
         # `starlings identify study.toml` what these data can determine, `starlings run study.toml` estimates. Every key:\n\
         # docs/study-file.md."
    )?;
    for note in &parts.notes {
        writeln!(text, "# Note: {note}.")?;
    }
    writeln!(
        text,
        "\n[study]\nname = {}\nseed = 1\ntime_unit = {}",
        quoted(&parts.name),
        quoted(&parts.time_unit)
    )?;
    model(text, parts)?;
    writeln!(
        text,
        "\n# What is unknown, and what is known of it: `factor` is one standard deviation as a factor on the value, `sd` one in its unit."
    )?;
    if parts.records.len() > 1 {
        writeln!(
            text,
            "# `per_record = true` gives a parameter a value of its own in every record; the others have one for all."
        )?;
    }
    parts.unknown.iter().try_for_each(|unknown| parameter(text, unknown))?;
    parts.records.iter().try_for_each(|part| record(text, part, noise))?;
    if parts.batch {
        writeln!(
            text,
            "\n[estimator]\nkind = \"batch\"      # the model cannot start from a state: whole records are fitted"
        )?;
    }
    Ok(())
}

fn model(text: &mut String, parts: &Parts) -> Result {
    writeln!(text, "\n[model]")?;
    if parts.equations.is_some() {
        writeln!(
            text,
            "# TODO: your equations. Here every output follows its inputs with a time of its own, which fits many courses roughly and\n\
             # explains none. `starlings models` lists the built-in models, and a program of yours can be one (docs/plug-in.md)."
        )?;
    }
    write!(text, "{}", parts.model.lines)?;
    if let Some(equations) = &parts.equations {
        return write!(text, "{equations}");
    }
    constants(text, parts)?;
    if !parts.model.layout.is_empty() {
        write!(text, "\n{}", parts.model.layout.trim_end())?;
        writeln!(text)?;
    }
    Ok(())
}

/// Values that are given, and those that the model has by itself, as comments.
fn constants(text: &mut String, parts: &Parts) -> Result {
    let fixed = || parts.fixed.iter().filter_map(|q| Some((q, q.default?)));
    let given = |name: &str| parts.model.constants.iter().any(|(known, _)| known == name);
    if fixed().next().is_none() {
        return Ok(());
    }
    writeln!(
        text,
        "\n# Fixed. Behind `#` stands what the model takes by itself; a name can move to [[parameters]].\n[model.constants]"
    )?;
    fixed().try_for_each(|(quantity, value)| {
        let mark = if given(&quantity.name) { "" } else { "# " };
        let about = [&quantity.unit, &quantity.range_text(), &quantity.says];
        let about: Vec<&str> =
            about.into_iter().map(String::as_str).filter(|t| !t.is_empty() && *t != "any").collect();
        let about = if about.is_empty() { String::new() } else { format!("      # {}", about.join("; ")) };
        writeln!(text, "{mark}{} = {value:?}{about}", key(&quantity.name))
    })
}

/// A name as a key of TOML.
fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c));
    if bare { name.to_owned() } else { quoted(name) }
}

fn parameter(text: &mut String, unknown: &Unknown) -> Result {
    writeln!(text, "\n[[parameters]]")?;
    let says = if unknown.says.is_empty() { String::new() } else { format!("      # {}", unknown.says) };
    writeln!(text, "name = {}{says}", quoted(&unknown.name))?;
    if !unknown.unit.is_empty() {
        writeln!(text, "unit = {}", quoted(&unknown.unit))?;
    }
    writeln!(text, "prior = {}      # from: {}", unknown.prior.table, unknown.prior.from)
}

fn record(text: &mut String, part: &Part, noise: Noise) -> Result {
    if matches!(part.numbers, Numbers::Predicted(_)) {
        writeln!(
            text,
            "\n# TODO: your recording in the place of predicted.csv, which the model itself predicts without noise."
        )?;
    } else {
        writeln!(text)?;
    }
    writeln!(
        text,
        "[[records]]\nname = {}\nfile = {}\ntime = {}",
        quoted(&part.name),
        quoted(&part.file),
        quoted(&part.time)
    )?;
    if !part.inputs.is_empty() {
        let inputs = part.inputs.iter().map(|(name, column)| format!("{} = {}", key(name), quoted(column)));
        writeln!(text, "inputs = {{ {} }}", inputs.collect::<Vec<_>>().join(", "))?;
    }
    writeln!(text, "channels = [")?;
    part.channels.iter().try_for_each(|channel| one_channel(text, channel, noise))?;
    writeln!(text, "]")?;
    if let Some([from, to]) = part.train {
        writeln!(
            text,
            "train = [{from:?}, {to:?}]      # what is fitted; the rest is held out, and predicted"
        )?;
    }
    Ok(())
}

fn one_channel(text: &mut String, channel: &ChannelPart, noise: Noise) -> Result {
    let unit =
        if channel.unit.is_empty() { String::new() } else { format!(", unit = {}", quoted(&channel.unit)) };
    let (noise, says) = match (channel.noise, noise) {
        (Some(sd), _) => (format!("{sd:?}"), ""),
        (None, Noise::FromData) => ("\"auto\"".to_owned(), "      # TODO: the sensor's standard deviation"),
        (None, Noise::OfRange) => (
            format!("{:?}", channel.share),
            "      # TODO: the sensor's standard deviation; this is 2 % of the range",
        ),
    };
    let (column, output) = (quoted(&channel.column), quoted(&channel.output));
    writeln!(text, "    {{ column = {column}, output = {output}{unit}, noise = {noise} }},{says}")
}
