//! A figure as the page shows it: the drawing, its caption and the meaning of its colours.

use std::collections::BTreeMap;

use serde::Serialize;

use super::super::ReportError;
use super::scene::Scene;

/// The figures of a page by the slot of its template that they fill.
pub(crate) type Slots = BTreeMap<&'static str, Vec<Figure>>;

/// A drawing with the text that belongs to it.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Figure {
    /// What is shown, in a few words.
    pub(crate) title: String,
    /// One SVG element.
    pub(crate) svg: String,
    /// The meaning of the colours.
    pub(crate) keys: Vec<Key>,
    /// The numbers of this figure and how to read it.
    pub(crate) caption: String,
}

/// One entry of the legend; `sample` is a class of the page's style sheet.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Key {
    /// Shape and colour, such as "line blue".
    pub(crate) sample: &'static str,
    /// What it stands for.
    pub(crate) text: &'static str,
}

impl Figure {
    /// Draws `scene`.
    ///
    /// # Errors
    ///
    /// The scene cannot be drawn.
    pub(crate) fn new(
        scene: &Scene,
        keys: &[(&'static str, &'static str)],
        caption: String,
    ) -> Result<Self, ReportError> {
        let keys = keys.iter().map(|&(sample, text)| Key { sample, text }).collect();
        Ok(Self { title: scene.title.clone(), svg: scene.svg()?, keys, caption })
    }
}

/// A quantity with its unit, as an axis label.
pub(crate) fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") }
}
