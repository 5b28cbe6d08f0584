//! Residuals by record and output, in units of their noise: the basis of the warnings about noise, model and correlation.
//!
//! Of a fit with one value per parameter and no observer they are those of the free run with the estimate. With drift or an
//! observer a free run says nothing of the fit; then they are the innovations of the last pass. Next file to read:
//! [`super::consistency`].

use starlings_estimators::{Pooled, effective_sample_size};

use super::super::field::field_of;
use super::super::store::{PredictionRow, Store, StoreError, table};
use super::super::{Fit, Study};

/// Residuals of one output, or of all components of a field, in one record.
pub(crate) struct Residuals {
    /// Record name.
    pub record: String,
    /// Output or field.
    pub output: String,
    /// Whitened residuals, one series per component.
    pub components: Vec<Vec<f64>>,
}

impl Residuals {
    /// Number of values.
    pub(crate) fn n(&self) -> usize {
        self.components.iter().map(Vec::len).sum()
    }

    /// All components together.
    pub(crate) fn pooled(&self) -> Pooled {
        let mut pooled = Pooled::new();
        self.components.iter().for_each(|c| pooled.add(c.clone()));
        pooled
    }

    /// Number of independent values among the squares: as many as their correlation in time leaves (Geyer 1992).
    pub(crate) fn independent_squares(&self) -> f64 {
        let of_component = |c: &Vec<f64>| {
            let squares: Vec<f64> = c.iter().map(|e| e * e).collect();
            let n = effective_sample_size(&squares);
            if n.is_finite() { n } else { c.len() as f64 }
        };
        self.components.iter().map(of_component).sum()
    }
}

/// The residuals of a finished fit.
///
/// # Errors
/// When the store cannot be read.
pub(crate) fn residuals(
    study: &Study,
    fit: &Fit,
    store: &Store,
    predictions: &[PredictionRow],
) -> Result<Vec<Residuals>, StoreError> {
    let filtered = study.estimator.kind.is_filter() && (study.drifts() || !study.observer_is_off());
    let mut all = Vec::new();
    if filtered {
        let last = fit.passes.to_string();
        let rows = table(store, "innovations", "pass, record, output, innovation, sd")?;
        for row in rows.iter().filter(|row| row[0] == last) {
            let number = |text: &String| text.parse::<f64>().unwrap_or(f64::NAN);
            add(&mut all, &row[1], &row[2], number(&row[3]) / number(&row[4]));
        }
    } else {
        for p in predictions.iter().filter(|p| p.usage == "train") {
            if let Some(observed) = p.observed {
                add(&mut all, &p.record, &p.output, (observed - p.predicted) / p.noise);
            }
        }
    }
    Ok(in_order(study, all))
}

/// A component's values as they come: record, output, residuals.
type Series = (String, String, Vec<f64>);

fn add(all: &mut Vec<Series>, record: &str, output: &str, residual: f64) {
    // Rows of one series mostly follow one another; innovations of a field take turns, always in the same order.
    let same = |s: &Series| s.1 == output && s.0 == record;
    match all.iter_mut().rev().find(|s| same(s)) {
        Some(series) => series.2.push(residual),
        None => all.push((record.to_owned(), output.to_owned(), vec![residual])),
    }
}

/// Components of a field together; in the order of the outputs, then of the records.
fn in_order(study: &Study, all: Vec<Series>) -> Vec<Residuals> {
    let mut found: Vec<Residuals> = Vec::new();
    for (record, output, series) in all {
        let field = field_of(&output);
        match found.iter_mut().find(|r| r.output == field && r.record == record) {
            Some(residuals) => residuals.components.push(series),
            None => found.push(Residuals { record, output: field.to_owned(), components: vec![series] }),
        }
    }
    let place = |r: &Residuals| {
        let output = study.setup.outputs.iter().position(|o| field_of(o) == r.output);
        (output, study.records.iter().position(|record| record.name == r.record))
    };
    found.sort_by_key(place);
    found
}
