//! `[spectrum]` of a study: which observers to compare, at which gains, and the decay that is wanted.
//!
//! Next file to read: [`crate::check`].

use std::ops::Range;

use toml::Spanned;

use super::table::Table;

/// `[spectrum]`.
#[derive(Debug, Default)]
pub(crate) struct SpectrumSection {
    pub(crate) observers: Vec<Spanned<String>>,
    pub(crate) gains: Vec<Spanned<f64>>,
    pub(crate) decay: Option<DecaySection>,
}

/// `decay = { factor = 10, time = 0.1 }`.
#[derive(Debug)]
pub(crate) struct DecaySection {
    pub(crate) span: Range<usize>,
    pub(crate) factor: Option<Spanned<f64>>,
    pub(crate) time: Option<Spanned<f64>>,
}

/// Reads the section; empty where the file has none.
pub(crate) fn read(root: &Table<'_>) -> SpectrumSection {
    let Some(t) = root.table("spectrum", "[spectrum]", &["observers", "gains", "decay"]) else {
        return SpectrumSection::default();
    };
    let decay = t.table("decay", "`decay`", &["factor", "time"]).map(|t| {
        for key in ["factor", "time"] {
            if t.get(key).is_none() {
                t.missing(key, "such as `decay = { factor = 10, time = 0.1 }`");
            }
        }
        DecaySection { span: t.span.clone(), factor: t.number("factor"), time: t.number("time") }
    });
    SpectrumSection { observers: t.texts("observers"), gains: t.numbers("gains"), decay }
}
