//! A figure as the page shows it: the drawing, its caption and the meaning of its colours.

use std::collections::BTreeMap;

use serde::Serialize;

use super::super::ReportError;
use super::scene::Scene;

/// A place on a page for the figures that `draw` gives.
pub(crate) struct Slot<Draw> {
    /// Its name, by which a template may set it where it likes.
    pub(crate) name: &'static str,
    /// Heading, and what is said without figures, where it is a section of its own that the template need not name.
    pub(crate) section: Option<(&'static str, &'static str)>,
    /// Draws its figures.
    pub(crate) draw: Draw,
}

impl<Draw> Slot<Draw> {
    /// A place that the template names.
    pub(crate) const fn named(name: &'static str, draw: Draw) -> Self {
        Self { name, section: None, draw }
    }

    /// A section of its own.
    pub(crate) const fn section(
        name: &'static str,
        title: &'static str,
        absent: &'static str,
        draw: Draw,
    ) -> Self {
        Self { name, section: Some((title, absent)), draw }
    }
}

/// The figures of a page.
#[derive(Debug, Serialize)]
pub(crate) struct Slots {
    /// By the name of their slot.
    #[serde(flatten)]
    by_name: BTreeMap<&'static str, Vec<Figure>>,
    /// The sections of their own: name, heading, what is said without figures.
    sections: Vec<[&'static str; 3]>,
}

impl Slots {
    /// Draws the figures of every slot.
    ///
    /// # Errors
    ///
    /// A figure cannot be drawn.
    pub(crate) fn draw<Draw>(
        slots: &[Slot<Draw>],
        figures: impl Fn(&Draw) -> Result<Vec<Figure>, ReportError>,
    ) -> Result<Self, ReportError> {
        let sections = slots.iter().filter_map(|s| s.section.map(|(title, absent)| [s.name, title, absent]));
        let by_name = slots.iter().map(|slot| Ok((slot.name, figures(&slot.draw)?)));
        Ok(Self { by_name: by_name.collect::<Result<_, ReportError>>()?, sections: sections.collect() })
    }
}

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
