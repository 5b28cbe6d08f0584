//! One basis function that the caller writes as closures.
//!
//! Read next: `basis.rs`.

use std::fmt;

use super::functions::Functions;

type Value = dyn Fn(f64, &[f64]) -> f64 + Send + Sync;
type Slopes = dyn Fn(f64, &[f64], &mut [f64]) + Send + Sync;

/// A function φ(x, t) with its slopes.
pub struct Function {
    name: String,
    value: Box<Value>,
    slopes: Option<Box<Slopes>>,
}

impl Function {
    /// From its value at (time, sample) and its slopes ∂φ/∂x_l there, which are zero where nothing is written.
    pub fn new(
        name: impl Into<String>,
        value: impl Fn(f64, &[f64]) -> f64 + Send + Sync + 'static,
        slopes: impl Fn(f64, &[f64], &mut [f64]) + Send + Sync + 'static,
    ) -> Self {
        Self { name: name.into(), value: Box::new(value), slopes: Some(Box::new(slopes)) }
    }

    /// One whose value depends on no state: on time and inputs only.
    pub fn of_inputs(
        name: impl Into<String>,
        value: impl Fn(f64, &[f64]) -> f64 + Send + Sync + 'static,
    ) -> Self {
        Self { name: name.into(), value: Box::new(value), slopes: None }
    }
}

impl fmt::Debug for Function {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Function").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Functions for Function {
    fn names(&self) -> Vec<String> {
        vec![self.name.clone()]
    }

    fn values(&self, time: f64, x: &[f64], values: &mut [f64]) {
        values[0] = (self.value)(time, x);
    }

    fn slopes(&self, time: f64, x: &[f64], slopes: &mut [f64]) {
        slopes.fill(0.0);
        if let Some(of_states) = &self.slopes {
            of_states(time, x, slopes);
        }
    }
}
