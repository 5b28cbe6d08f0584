//! How outputs answer to states where runs start. Next file to read: [`super::windkessel`].

use nalgebra::DMatrix;

use crate::{Drive, Model};

/// ∂y/∂x, n_output × as many states as are named, without inputs: unit steps about rest, exact for a linear system; small ones about the
/// initial state of another one.
pub(super) fn slopes(model: &dyn Model, theta: &[f64], states: &[usize]) -> DMatrix<f64> {
    slopes_beside(model, theta, states, 0.0)
}

/// The same so far beside the state in which runs start, in parts of each component or of one, with all inputs as large and as late.
pub(super) fn slopes_beside(model: &dyn Model, theta: &[f64], states: &[usize], beside: f64) -> DMatrix<f64> {
    let spec = model.spec();
    let rest = vec![beside; spec.inputs.iter().map(|q| q.size).sum()];
    let drive = Drive { value: &rest, slope: &rest, ..Drive::NONE };
    let (mut x, mut y) = (vec![0.0; spec.n_state()], vec![0.0; spec.n_output()]);
    let is_linear = model.blocks(theta).is_some();
    if !is_linear {
        model.initial(theta, &mut x);
    }
    for x in &mut x {
        *x += beside * x.abs().max(1.0);
    }
    let mut slopes = DMatrix::zeros(y.len(), states.len());
    for (mut column, &j) in slopes.column_iter_mut().zip(states) {
        let (here, step) = (x[j], if is_linear { 1.0 } else { f64::EPSILON.cbrt() * x[j].abs().max(1.0) });
        for (sign, way) in [(0.5, step), (-0.5, -step)] {
            x[j] = here + way;
            model.output(beside.abs(), &x, theta, drive, &mut y);
            column.iter_mut().zip(&y).for_each(|(slope, y)| *slope += sign * y / step);
        }
        x[j] = here;
    }
    slopes
}
