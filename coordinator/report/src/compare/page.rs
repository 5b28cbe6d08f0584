//! The page of a comparison: one HTML document, made from the comparison alone.
//!
//! Next file to read: the template `compare/compare.html`.

use serde::Serialize;
use starlings_study::posterior::Estimate;

use super::{Comparison, ParameterAcross};
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, Slot, Slots, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::EQUALS;
use crate::plot::scene::Scene;
use crate::{ReportError, layout, number};

/// Figures of parameters at most.
const FIGURES: usize = 24;

type Draw = fn(&Comparison) -> Vec<Figure>;

#[derive(Serialize)]
struct Page<'a> {
    found: &'a Comparison,
    verdict: String,
    labels: Vec<String>,
    /// Colour of each run.
    colours: Vec<&'static str>,
    parameters: Vec<Row>,
    errors: Vec<Row>,
    evidence: Vec<String>,
    below_best: Vec<String>,
    walls: Vec<String>,
    figures: Slots,
    left_out: usize,
}

/// A row of a table with a cell per run.
#[derive(Serialize)]
struct Row {
    name: String,
    unit: String,
    cells: Vec<String>,
    apart: String,
}

/// Makes the page: one HTML document that refers to nothing outside itself.
///
/// # Errors
///
/// [`ReportError`] when a figure or the page cannot be made.
pub fn compare_page(found: &Comparison) -> Result<String, ReportError> {
    let draw: [Slot<Draw>; 1] = [Slot::named("parameters", figures)];
    let texts = |values: &[Option<f64>]| {
        values.iter().map(|v| v.map_or(number::ABSENT.to_owned(), |v| number::with_sd(v, 1.0))).collect()
    };
    let below: Vec<Option<f64>> = found.evidence.below_best.iter().flatten().copied().map(Some).collect();
    let page = Page {
        verdict: found.verdict(),
        labels: found.labels(),
        colours: (0..found.runs.len()).map(|k| EQUALS[k % EQUALS.len()].name).collect(),
        parameters: found.parameters.iter().map(parameter).collect(),
        errors: errors(found),
        evidence: texts(&found.evidence.values),
        below_best: texts(&below),
        walls: found
            .runs
            .iter()
            .map(|r| r.wall_s.map_or(number::ABSENT.to_owned(), number::duration))
            .collect(),
        figures: Slots::draw(&draw, |draw| draw(found))?,
        left_out: found.parameters.len().saturating_sub(FIGURES),
        found,
    };
    layout::document(include_str!("compare.html"), page)
}

fn parameter(p: &ParameterAcross) -> Row {
    let cell = |e: &Option<Estimate>| {
        e.as_ref().map_or(number::ABSENT.to_owned(), |e| {
            let digits = |v| number::with_sd(v, e.sd);
            format!("{} ({} to {})", digits(e.estimate), digits(e.interval95[0]), digits(e.interval95[1]))
        })
    };
    Row {
        name: p.name.clone(),
        unit: p.unit.clone(),
        cells: p.values.iter().map(cell).collect(),
        apart: p.apart.map_or(number::ABSENT.to_owned(), |d| format!("{} sd", number::significant(d, 2))),
    }
}

fn errors(found: &Comparison) -> Vec<Row> {
    let digits = |v: Option<f64>| v.map_or(number::ABSENT.to_owned(), |v| number::significant(v, 3));
    let rows = found.errors.iter().flat_map(|error| {
        let row = |name: &str, of: fn(&starlings_study::summary::ChannelFit) -> Option<f64>| Row {
            name: format!("{}, {name}", error.output),
            unit: String::new(),
            cells: error.values.iter().map(|c| digits(c.as_ref().and_then(of))).collect(),
            apart: String::new(),
        };
        [
            row("training RMSE", |c| c.train_rmse),
            row("held-out RMSE", |c| c.held_out_rmse),
            row("stated noise", |c| Some(c.noise)),
        ]
    });
    rows.collect()
}

/// One small figure per parameter: estimate and 95 % interval at the stated noise in every run.
fn figures(found: &Comparison) -> Vec<Figure> {
    found.parameters.iter().take(FIGURES).map(|p| figure(found, p)).collect()
}

fn figure(found: &Comparison, p: &ParameterAcross) -> Figure {
    let at = |k: usize| (k + 1) as f64;
    let x = Axis::counted("run", (0..found.runs.len()).map(at));
    let ends = p.values.iter().flatten().flat_map(|e| [e.interval95[0], e.interval95[1], e.estimate]);
    let y = Axis::around(&with_unit(&p.name, &p.unit), ends);
    let mut marks = Vec::new();
    let mut keys = Vec::new();
    let labels = found.labels();
    for (k, value) in p.values.iter().enumerate() {
        let colour = EQUALS[k % EQUALS.len()];
        let Some(e) = value else { continue };
        let [lo, hi] = e.interval95;
        marks.push(Mark::flat_band((at(k) - 0.08, at(k) + 0.08), (lo, hi), colour, 0.45));
        marks.push(Mark::Dots { points: vec![(at(k), e.estimate)], colour, radius: 4.0 });
        if k < EQUALS.len() {
            keys.push((format!("dot {}", colour.name), labels[k].clone()));
        }
    }
    let apart = p.apart.map_or_else(String::new, |d| {
        format!(" They lie {} standard deviations of their difference apart.", number::significant(d, 2))
    });
    let caption = format!("Estimate and 95\u{a0}% interval at the stated noise.{apart}");
    let title = format!("{} in every run", p.name);
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    Figure::new(&scene, &keys, caption)
}
