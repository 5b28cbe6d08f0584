//! Which outputs a program is asked for, and how its rows become those of a prediction.
//!
//! A field is asked for as a whole, whichever of its components is observed. Next file to read: [`crate::external`].

use crate::SetupError;
use crate::{Quantity, Spec, Window, nearest};

/// Outputs asked for, and the place of each predicted row among theirs.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    asked: Vec<Quantity>,
    names: Vec<String>,
    places: Vec<usize>,
}

impl Rows {
    /// Resolves the outputs of a setup; `all` asks for those too that are not among them.
    ///
    /// # Errors
    /// When a name is unknown or given twice.
    pub(super) fn new(spec: &Spec, outputs: &[String], all: bool) -> Result<Self, SetupError> {
        let mut wanted = Vec::new();
        for (i, name) in outputs.iter().enumerate() {
            if outputs[..i].contains(name) {
                return Err(SetupError::Twice(name.clone()));
            }
            let range = Spec::range_of(&spec.outputs, name).ok_or_else(|| SetupError::Unknown {
                what: "output",
                name: name.clone(),
                nearest: nearest(name, spec.outputs.iter().map(|q| &q.name)),
            })?;
            wanted.extend(range);
        }
        let (mut asked, mut place_of, mut at, mut n) = (Vec::new(), Vec::new(), 0, 0);
        for q in &spec.outputs {
            let own = at..at + q.size;
            at = own.end;
            let is_asked = all || wanted.iter().any(|place| own.contains(place));
            place_of.extend((0..q.size).map(|i| n + i));
            if is_asked {
                n += q.size;
                asked.push(q.clone());
            }
        }
        let names = asked.iter().map(|q| q.name.clone()).collect();
        Ok(Self { asked, names, places: wanted.into_iter().map(|place| place_of[place]).collect() })
    }

    /// Names of the outputs asked for.
    pub(super) fn asked(&self) -> &[String] {
        &self.names
    }

    /// The outputs asked for.
    pub(super) fn quantities(&self) -> &[Quantity] {
        &self.asked
    }

    /// Rows of the answer.
    pub(super) fn n_asked(&self) -> usize {
        self.asked.iter().map(|q| q.size).sum()
    }

    /// Rows of the prediction.
    pub(super) fn n_row(&self) -> usize {
        self.places.len()
    }

    /// The observed values of a window as those of the outputs asked for; NaN where an output is not observed.
    pub(super) fn observed(&self, window: &Window) -> Vec<f64> {
        let n = self.n_asked();
        let mut observed = vec![f64::NAN; n * window.times.len()];
        let columns = observed.chunks_exact_mut(n.max(1));
        for (column, values) in columns.zip(window.observed.chunks_exact(self.n_row().max(1))) {
            for (place, value) in self.places.iter().zip(values) {
                column[*place] = *value;
            }
        }
        observed
    }

    /// The rows of the prediction out of an answer.
    pub(super) fn picked(&self, answer: &[f64]) -> Vec<f64> {
        let columns = answer.chunks_exact(self.n_asked().max(1));
        columns.flat_map(|column| self.places.iter().map(|place| column[*place])).collect()
    }
}
