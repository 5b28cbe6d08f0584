//! A figure as the page shows it: one plot or several over the same axis, their caption, the meaning of their colours, and the
//! numbers that the page's script shows under the pointer.

use std::collections::BTreeMap;

use serde::Serialize;

use super::super::ReportError;
use super::scene::Scene;
use super::series::{self, FigureData};

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
    by_name: BTreeMap<&'static str, Vec<Drawn>>,
    /// The sections of their own: name, heading, what is said without figures.
    sections: Vec<[&'static str; 3]>,
}

impl Slots {
    /// Draws the figures of every slot.
    ///
    /// # Errors
    ///
    /// The numbers of a figure cannot be written.
    pub(crate) fn draw<Draw>(
        slots: &[Slot<Draw>],
        figures: impl Fn(&Draw) -> Vec<Figure>,
    ) -> Result<Self, ReportError> {
        let sections = slots.iter().filter_map(|s| s.section.map(|(title, absent)| [s.name, title, absent]));
        let all: Vec<(&'static str, Vec<Figure>)> =
            slots.iter().map(|slot| (slot.name, figures(&slot.draw))).collect();
        let long = all.iter().flat_map(|(_, figures)| figures).map(|f| f.data.n_long()).sum();
        let buckets = series::buckets(long);
        let drawn = |figure: Figure| figure.drawn(buckets);
        let by_name = all.into_iter().map(|(name, figures)| {
            Ok((name, figures.into_iter().map(drawn).collect::<Result<_, ReportError>>()?))
        });
        Ok(Self { by_name: by_name.collect::<Result<_, ReportError>>()?, sections: sections.collect() })
    }
}

/// One plot or several, with the text that belongs to them.
#[derive(Debug, Clone)]
pub(crate) struct Figure {
    title: String,
    plots: Vec<String>,
    keys: Vec<Key>,
    caption: String,
    data: FigureData,
}

/// A figure, ready to be set.
#[derive(Debug, Serialize)]
pub(crate) struct Drawn {
    /// What is shown, in a few words.
    title: String,
    /// Elements of the page.
    plots: Vec<String>,
    /// The meaning of the colours.
    keys: Vec<Key>,
    /// The numbers of this figure and how to read it.
    caption: String,
    /// Its numbers, as JSON that can stand in a script element.
    data: String,
}

/// One entry of the legend; `sample` is a class of the page's style sheet.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Key {
    /// Shape and colour, such as "line blue".
    pub(crate) sample: String,
    /// What it stands for.
    pub(crate) text: String,
}

/// The entries of a legend.
pub(crate) fn keys(entries: &[(impl AsRef<str>, impl AsRef<str>)]) -> Vec<Key> {
    entries
        .iter()
        .map(|(sample, text)| Key { sample: sample.as_ref().to_owned(), text: text.as_ref().to_owned() })
        .collect()
}

impl Figure {
    /// The same with a sentence more below it.
    pub(crate) fn saying(mut self, more: &str) -> Self {
        self.caption = format!("{} {more}", self.caption);
        self
    }

    /// Draws `scene`.
    pub(crate) fn new(
        scene: &Scene,
        entries: &[(impl AsRef<str>, impl AsRef<str>)],
        caption: String,
    ) -> Self {
        let keys = keys(entries);
        let data = FigureData::new(&[scene], &keys);
        Self { title: scene.title.clone(), plots: vec![scene.html(&keys, "")], keys, caption, data }
    }

    /// Draws `scene` with a low one below it over the same horizontal axis, such as residuals below a fit.
    pub(crate) fn with_below(
        scene: &Scene,
        below: &Scene,
        entries: &[(impl AsRef<str>, impl AsRef<str>)],
        caption: String,
    ) -> Self {
        let keys = keys(entries);
        let data = FigureData::new(&[scene, below], &keys);
        let left = scene.left().max(below.left());
        let plots = vec![scene.html_with(&keys, "upper", left), below.html_with(&keys, "below", left)];
        Self { title: scene.title.clone(), plots, keys, caption, data }
    }

    /// Draws a matrix of scenes, each with its row and column counted from 1; on a narrow screen they stand in one column.
    pub(crate) fn matrix(
        title: &str,
        scenes: &[(Scene, (usize, usize))],
        n_column: usize,
        entries: &[(impl AsRef<str>, impl AsRef<str>)],
        caption: String,
    ) -> Self {
        let keys = keys(entries);
        let data = FigureData::new(&scenes.iter().map(|(scene, _)| scene).collect::<Vec<_>>(), &keys);
        let plots = scenes.iter().map(|(scene, (row, column))| {
            format!("<div style=\"grid-area:{row}/{column}\">{}</div>", scene.html(&keys, ""))
        });
        let plots = vec![format!(
            "<div class=\"plots matrix\" style=\"--columns:{n_column}\">{}</div>",
            plots.collect::<String>()
        )];
        Self { title: title.to_owned(), plots, keys, caption, data }
    }

    /// Draws a map: its marks are cells, which have no course to follow.
    pub(crate) fn map(
        scene: &Scene,
        entries: &[(impl AsRef<str>, impl AsRef<str>)],
        caption: String,
    ) -> Self {
        let keys = keys(entries);
        let data = FigureData::new(&[scene], &[]);
        Self { title: scene.title.clone(), plots: vec![scene.html(&keys, "")], keys, caption, data }
    }

    /// The figure, ready to be set; long series keep an envelope of so many buckets.
    ///
    /// # Errors
    ///
    /// Its numbers cannot be written.
    pub(crate) fn drawn(self, buckets: usize) -> Result<Drawn, ReportError> {
        let data = self.data.json(buckets)?;
        Ok(Drawn { title: self.title, plots: self.plots, keys: self.keys, caption: self.caption, data })
    }
}

/// A quantity with its unit, as an axis label.
pub(crate) fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") }
}
