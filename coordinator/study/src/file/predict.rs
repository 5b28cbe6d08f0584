//! `[predict]` of a study: which quantities to predict after a fit, measured or not.
//!
//! Next file to read: [`crate::check`].

use std::ops::Range;

use toml::Spanned;

use super::table::Table;

/// `[predict]`.
#[derive(Debug, Default)]
pub(crate) struct PredictSection {
    pub(crate) span: Range<usize>,
    pub(crate) outputs: Vec<Spanned<String>>,
    pub(crate) members: Option<Spanned<u64>>,
    pub(crate) step: Option<Spanned<f64>>,
}

/// Reads the section; empty where the file has none.
pub(crate) fn read(root: &Table<'_>) -> PredictSection {
    let Some(t) = root.table("predict", "[predict]", &["outputs", "members", "step"]) else {
        return PredictSection::default();
    };
    if t.get("outputs").is_none() {
        t.missing("outputs", "names of outputs or scalar states, such as `outputs = [\"pressure\"]`");
    }
    t.empty(
        "outputs",
        "name outputs or scalar states, such as `outputs = [\"pressure\"]`, or leave out `[predict]`",
    );
    PredictSection {
        span: t.span.clone(),
        outputs: t.texts("outputs"),
        members: t.count("members"),
        step: t.number("step"),
    }
}
