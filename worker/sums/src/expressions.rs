//! Functions that a study writes, as a family of basis functions.
//!
//! Next file to read: [`super::question`].

use starlings_estimators::inference::Functions;
use starlings_models::equations::DriftFunction;

/// Functions of the states and inputs of a model, with their derivatives.
pub(crate) struct Expressions {
    pub(crate) functions: Vec<DriftFunction>,
    pub(crate) n_state: usize,
}

impl Functions for Expressions {
    fn names(&self) -> Vec<String> {
        self.functions.iter().map(|function| function.name.clone()).collect()
    }

    fn values(&self, time: f64, x: &[f64], values: &mut [f64]) {
        let (x, u) = x.split_at(self.n_state);
        for (value, function) in values.iter_mut().zip(&self.functions) {
            *value = function.value(time, x, u);
        }
    }

    fn slopes(&self, time: f64, x: &[f64], slopes: &mut [f64]) {
        let (x, u) = x.split_at(self.n_state);
        let mut unit = vec![0.0; self.n_state];
        for (slopes, function) in slopes.chunks_exact_mut(self.n_state).zip(&self.functions) {
            function.slopes(time, x, u, &mut unit, slopes);
        }
    }
}
