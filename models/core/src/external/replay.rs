//! A model that shows its last inputs: what effects on the inputs or outputs of another program are added to.
//!
//! It has the parameters of that program, so that terms may name them, and no state. Next file to read: [`super::split`].

use crate::segment::Segment;
use crate::{Drive, Model, ModelFailure, Quantity, Spec};

/// Shows the inputs from `first` on.
pub(super) struct Replay {
    spec: Spec,
    first: usize,
}

impl Replay {
    /// Shows the inputs themselves, under names that no expression can have.
    pub(super) fn of_inputs(spec: &Spec) -> Self {
        let shown = spec.inputs.iter().map(|q| Quantity { name: shown(&q.name), ..q.clone() });
        Self { spec: Spec { outputs: shown.collect(), ..bare(spec) }, first: 0 }
    }

    /// Shows recorded outputs, which are further inputs under names that no expression can have.
    pub(super) fn of_outputs(spec: &Spec) -> Self {
        let n = spec.n_output();
        let recorded = (0..n).map(|i| Quantity::new(&shown(&Spec::component(&spec.outputs, i)), ""));
        let inputs = spec.inputs.iter().cloned().chain(recorded).collect();
        Self { spec: Spec { inputs, ..bare(spec) }, first: spec.inputs.len() }
    }
}

/// The name under which a signal is shown.
pub(super) fn shown(name: &str) -> String {
    format!("recorded {name}")
}

fn bare(spec: &Spec) -> Spec {
    Spec { states: Vec::new(), measures: Vec::new(), restart: true, ..spec.clone() }
}

impl Model for Replay {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, _theta: &[f64], _x: &mut [f64]) {}

    fn rhs(&self, _t: f64, _x: &[f64], _theta: &[f64], _u: Drive<'_>, _dx: &mut [f64]) {}

    fn output(&self, _t: f64, _x: &[f64], _theta: &[f64], u: Drive<'_>, y: &mut [f64]) {
        y.copy_from_slice(&u.value[self.first..]);
    }

    fn advance(&self, _segment: Segment<'_>, _theta: &[f64], _x: &mut [f64]) -> Result<(), ModelFailure> {
        Ok(())
    }
}
