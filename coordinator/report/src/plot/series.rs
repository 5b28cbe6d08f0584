//! The numbers behind a figure, for the page's script: values under the pointer, tables, and a finer course where it is enlarged.
//!
//! A short series keeps its values to the last bit. A long one keeps the smallest and the largest value of every bucket of its
//! axis, in single precision; how many buckets depends on how many long series the page has, so that it stays small. Next file
//! to read: `figure.js`, which reads them.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use serde_json::{Value, json};

use super::super::ReportError;
use super::axis::Axis;
use super::drawing::key_of;
use super::figure::Key;
use super::mark::Mark;
use super::scene::Scene;
use super::thin::{self, PLAIN};

/// Buckets of all long series of a page together: about three megabytes as text.
const PAGE: usize = 280_000;
/// Buckets of one series at most and at least.
const EACH: (usize, usize) = (65_536, 700);

/// Buckets of each of so many long series.
pub(crate) fn buckets(n_long: usize) -> usize {
    (PAGE / n_long.max(1)).clamp(EACH.1, EACH.0)
}

/// The plots of one figure.
#[derive(Debug, Clone)]
pub(crate) struct FigureData {
    plots: Vec<Plot>,
}

#[derive(Debug, Clone)]
struct Plot {
    x: Axis,
    y: Axis,
    series: Vec<Series>,
}

/// Marks of one legend entry and shape: a curve has equal ends.
#[derive(Debug, Clone)]
struct Series {
    key: usize,
    is_band: bool,
    samples: Vec<Sample>,
    /// The drawn courses that it is made of: which of those of its key and shape, from where to where.
    drawn: Vec<(usize, f64, f64)>,
}

/// A value of an axis, and both ends of what is shown there.
type Sample = (f64, f64, f64);

impl Series {
    fn is_long(&self) -> bool {
        thin::is_long(self.samples.len(), self.samples.iter().map(|s| s.0))
    }
}

impl FigureData {
    /// Takes the numbers of every mark that a legend names.
    pub(crate) fn new(scenes: &[&Scene], keys: &[Key]) -> Self {
        let plot =
            |scene: &&Scene| Plot { x: scene.x.clone(), y: scene.y.clone(), series: collect(scene, keys) };
        Self { plots: scenes.iter().map(plot).collect() }
    }

    /// How many series are too long to be kept as they are.
    pub(crate) fn n_long(&self) -> usize {
        self.plots.iter().flat_map(|plot| &plot.series).filter(|series| series.is_long()).count()
    }

    /// As JSON that can stand in a script element.
    ///
    /// # Errors
    ///
    /// It cannot be written.
    pub(crate) fn json(&self, buckets: usize) -> Result<String, ReportError> {
        let mut shared = Shared::default();
        let plots: Vec<Value> = self.plots.iter().map(|plot| plot.json(buckets, &mut shared)).collect();
        let text = serde_json::to_string(&json!({ "plots": plots, "numbers": shared.text }))
            .map_err(ReportError::drawing)?;
        Ok(text.replace('<', "\\u003c"))
    }
}

impl Plot {
    fn json(&self, buckets: usize, shared: &mut Shared) -> Value {
        let series: Vec<Value> = self.series.iter().map(|s| s.json(&self.x, buckets, shared)).collect();
        json!({ "x": Ends::of(&self.x), "y": Ends::of(&self.y), "series": series })
    }
}

impl Series {
    fn json(&self, axis: &Axis, buckets: usize, shared: &mut Shared) -> Value {
        let mut value = json!({ "key": self.key, "band": self.is_band, "n": self.samples.len() });
        if self.is_long() {
            let n = buckets.min(self.samples.len());
            let envelope = thin::envelope(self.samples.iter().copied(), axis, n);
            let single = |pick: fn((f64, f64)) -> f64| {
                let bytes = envelope.iter().flat_map(|b| (b.map_or(f64::NAN, pick) as f32).to_le_bytes());
                STANDARD.encode(bytes.collect::<Vec<u8>>())
            };
            value["low"] = single(|b| b.0).into();
            value["high"] = single(|b| b.1).into();
            value["drawn"] = json!(self.drawn);
            return value;
        }
        value["x"] = shared.add(self.samples.iter().map(|s| s.0)).into();
        value["lo"] = shared.add(self.samples.iter().map(|s| s.1)).into();
        if self.is_band {
            value["hi"] = shared.add(self.samples.iter().map(|s| s.2)).into();
        }
        value
    }
}

/// Lists of numbers in double precision, each once.
#[derive(Default)]
struct Shared {
    text: Vec<String>,
}

impl Shared {
    /// The index of a list.
    fn add(&mut self, values: impl Iterator<Item = f64>) -> usize {
        let text = STANDARD.encode(values.flat_map(f64::to_le_bytes).collect::<Vec<u8>>());
        self.text.iter().position(|known| *known == text).unwrap_or_else(|| {
            self.text.push(text);
            self.text.len() - 1
        })
    }
}

/// An axis as the script needs it.
#[derive(Serialize)]
struct Ends<'a> {
    label: &'a str,
    lo: f64,
    hi: f64,
    log: bool,
}

impl<'a> Ends<'a> {
    fn of(axis: &'a Axis) -> Self {
        Self { label: &axis.label, lo: axis.lo, hi: axis.hi, log: axis.is_log() }
    }
}

/// The marks that a legend names. Parts of one course are together, and few short ones of one entry; a course that begins anew
/// is another series.
fn collect(scene: &Scene, keys: &[Key]) -> Vec<Series> {
    let mut list: Vec<Series> = Vec::new();
    let mut n_drawn = vec![[0; 2]; keys.len()];
    for mark in &scene.marks {
        let (Some(key), Some((is_band, samples))) = (key_of(mark, keys), samples(mark)) else { continue };
        let Some(&(from, ..)) = samples.first() else { continue };
        let to = samples.last().map_or(from, |s| s.0);
        let is_course = matches!(mark, Mark::Line { .. } | Mark::Dashes { .. } | Mark::Band { .. });
        let drawn = is_course.then(|| {
            let n = &mut n_drawn[key][usize::from(is_band)];
            *n += 1;
            (*n - 1, from, to)
        });
        let goes_on = |s: &Series| s.samples.last().is_some_and(|last| last.0 <= from);
        let is_short = |s: &Series| !is_band && s.samples.len() + samples.len() <= PLAIN;
        let same = |s: &&mut Series| s.key == key && s.is_band == is_band && (goes_on(s) || is_short(s));
        let Some(series) = list.iter_mut().find(same) else {
            list.push(Series { key, is_band, samples, drawn: drawn.into_iter().collect() });
            continue;
        };
        if is_short(series) {
            series.samples.push((f64::NAN, f64::NAN, f64::NAN));
        }
        series.samples.extend(samples);
        series.drawn.extend(drawn);
    }
    list
}

/// What a mark shows, and whether it is a band; regions of the record show no value.
fn samples(mark: &Mark) -> Option<(bool, Vec<Sample>)> {
    let flat = |points: &[(f64, f64)]| points.iter().map(|p| (p.0, p.1, p.1)).collect();
    match mark {
        Mark::Line { points, .. }
        | Mark::Dashes { points, .. }
        | Mark::Dots { points, .. }
        | Mark::Stems { points, .. } => Some((false, flat(points))),
        Mark::Band { points, .. } => Some((true, points.clone())),
        Mark::Bars { bars, .. } => {
            Some((false, bars.iter().map(|b| (f64::midpoint(b.0, b.1), b.2, b.2)).collect()))
        }
        Mark::Span { .. } | Mark::Heading { .. } => None,
    }
}
