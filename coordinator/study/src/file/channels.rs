//! Reading `channels` of a record: what was measured, in which column or surface.
//!
//! Next file to read: [`super::read`], for the records that they belong to.

use toml::Spanned;

use super::table::{Node, Table, choose, number, wrong_type};
use crate::problem::Source;

/// One entry of `channels`.
#[derive(Debug)]
pub(crate) struct ChannelSection {
    pub(crate) column: Spanned<String>,
    pub(crate) output: Spanned<String>,
    /// Label of the column's values; the model's where it is not given.
    pub(crate) unit: Option<Spanned<String>>,
    /// What the column holds of the output, where not the output itself.
    pub(crate) from: Option<Spanned<String>>,
    /// Value at which the integral of a rate begins.
    pub(crate) start: Option<Spanned<f64>>,
    /// Never fitted.
    pub(crate) held_out: bool,
    /// What becomes of outliers, where it is said.
    pub(crate) outliers: Option<Spanned<Outliers>>,
    /// Standard deviation in the channel's unit; `None` for `"auto"`.
    pub(crate) noise: Spanned<Option<f64>>,
    /// The surfaces that were measured, in the place of a column.
    pub(crate) surface: Option<SurfaceSection>,
}

/// The surface part of a channel.
#[derive(Debug)]
pub(crate) struct SurfaceSection {
    /// Profiles `time,z,r`, or meshes by `time,file`.
    pub(crate) file: Spanned<String>,
    /// The nodes without displacement.
    pub(crate) rest: Spanned<String>,
    /// Open ends of every mesh.
    pub(crate) open_ends: usize,
    /// Standard deviation of the surface's points across the direction of a node, along the wall; none where it does not matter.
    pub(crate) noise_along: Option<Spanned<f64>>,
}

/// What becomes of values that stand apart from all around them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outliers {
    /// They count as missing.
    LeaveOut,
    /// They count as any other.
    Keep,
}

/// Whether a record, or a channel, is to be left out of every fit.
pub(super) fn held_out(source: &Source, of: &Table<'_>) -> bool {
    let words = [("train", false), ("held-out", true)];
    choose(source, of.text("use").as_ref(), "use", &words).unwrap_or(false)
}

/// The channels of a record; an inference finds their noise by itself.
pub(super) fn channels(source: &Source, record: &Table<'_>, infers: bool) -> Vec<ChannelSection> {
    let read = |t: Table<'_>| {
        let noise = t.get("noise").and_then(|node| noise(source, node));
        if t.get("noise").is_none() && !infers {
            t.missing("noise", "the standard deviation in the channel's unit, or \"auto\"");
        }
        let surface = surface(source, &t);
        ChannelSection {
            column: match &surface {
                Some(surface) => surface.file.clone(),
                None => t.required_text("column", "a column of the record's file, or a `surface`"),
            },
            output: t.required_text("output", "the output of the model that was measured"),
            unit: t.text("unit"),
            from: t.text("from"),
            start: t.number("start"),
            held_out: held_out(source, &t),
            outliers: outliers(source, &t),
            noise: noise.unwrap_or_else(|| Spanned::new(t.span.clone(), None)),
            surface,
        }
    };
    let keys = [
        "column",
        "output",
        "unit",
        "noise",
        "use",
        "outliers",
        "from",
        "start",
        "surface",
        "rest",
        "open_ends",
        "noise_along",
    ];
    record.tables("channels", "a channel", &keys).into_iter().map(read).collect()
}

/// What a channel says of outliers.
fn outliers(source: &Source, channel: &Table<'_>) -> Option<Spanned<Outliers>> {
    let word = channel.text("outliers")?;
    let words = [("leave-out", Outliers::LeaveOut), ("keep", Outliers::Keep)];
    let found = choose(source, Some(&word), "treatment of outliers", &words)?;
    Some(Spanned::new(word.span(), found))
}

/// Open ends of a mesh where the study does not say: a tube's.
const TUBE_ENDS: usize = 2;

/// The surface part of a channel; nothing where it has a column.
fn surface(source: &Source, t: &Table<'_>) -> Option<SurfaceSection> {
    if t.get("surface").is_none() {
        for key in ["rest", "open_ends", "noise_along"] {
            if let Some(span) = t.key_span(key) {
                source.report_with(
                    span,
                    format!("`{key}` belongs to a `surface`"),
                    "remove it, or give `surface`",
                );
            }
        }
        return None;
    }
    for key in ["column", "from", "start", "outliers"] {
        if let Some(span) = t.key_span(key) {
            let message = format!("a channel with a `surface` has no `{key}`");
            source.report_with(
                span,
                message,
                "remove it: the observed value is a distance of zero to the surface",
            );
        }
    }
    let ends =
        t.count("open_ends").map_or(TUBE_ENDS, |n| usize::try_from(*n.get_ref()).unwrap_or(usize::MAX));
    Some(SurfaceSection {
        file: t.required_text("surface", "a CSV file of profiles or meshes"),
        rest: t.required_text(
            "rest",
            "a CSV file with the place of every node of the output without displacement",
        ),
        open_ends: ends,
        noise_along: t.number("noise_along"),
    })
}

fn noise(source: &Source, node: &Node<'_>) -> Option<Spanned<Option<f64>>> {
    match node.get_ref().as_str() {
        Some("auto") => Some(Spanned::new(node.span(), None)),
        Some(_) => {
            wrong_type(source, node, "`noise`", "a number or \"auto\"");
            None
        }
        None => number(source, node, "`noise`").map(|n| Spanned::new(n.span(), Some(n.into_inner()))),
    }
}
