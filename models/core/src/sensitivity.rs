//! A model together with the derivatives of its state by the values of a job: forward sensitivities.
//!
//! With S = dx/dv the state (x, S) obeys x' = f(x), S' = (df/dx) S + df/dv, and the outputs are y and (dh/dx) S + dh/dv (Hairer, Nørsett &
//! Wanner 1993, section I.14, their equation of first variation). It is a model like any other: the step control holds the errors of S as it
//! holds those of x. At a kink the rate is continuous, and so is S. Next file to read: [`crate::slopes`].

use std::array::from_fn;

use crate::binding::{Binding, Target};
use crate::integrate::Solver;
use crate::segment::Drive;
use crate::slopes::{Direction, LANES, Point, Slopes, Take};
use crate::{Model, Quantity, SetupError, Spec};

/// A model with its sensitivities. State and outputs of the model come first, then their derivatives by each value in turn.
pub(crate) struct Sensitive {
    inner: Box<dyn Model>,
    spec: Spec,
    /// What each value moves.
    values: Vec<Target>,
    /// States whose start the setup or a job gives.
    given: Vec<usize>,
    /// Zeros and a one: its ends are the unit vectors along the parameters.
    unit: Vec<f64>,
}

impl Sensitive {
    /// Adds the derivatives by the values that a job gives.
    ///
    /// # Errors
    /// When the model has no derivatives.
    pub(crate) fn new(inner: Box<dyn Model>, binding: &Binding) -> Result<Self, SetupError> {
        let kind = &inner.spec().kind;
        if let Err(why) = inner.slopes() {
            return Err(SetupError::Invalid(format!(
                "derivatives of the model `{kind}` are not to be had: {why}"
            )));
        }
        let mut spec = inner.spec().clone();
        let (states, outputs) = (spec.states.clone(), spec.outputs.clone());
        for name in binding.names() {
            let by = |q: &Quantity| Quantity { name: format!("d({})/d({name})", q.name), ..q.clone() };
            spec.states.extend(states.iter().map(by));
            spec.outputs.extend(outputs.iter().map(by));
        }
        let mut unit = vec![0.0; spec.parameters.len()];
        if let Some(last) = unit.last_mut() {
            *last = 1.0;
        }
        Ok(Self { spec, unit, values: binding.targets().to_vec(), given: binding.given().collect(), inner })
    }

    /// Number of states of the inner model.
    fn n(&self) -> usize {
        self.inner.spec().n_state()
    }

    /// The directions of the values from this one on, at a state with its sensitivities; `x` may be empty.
    fn along<'a>(&'a self, first: usize, x: &'a [f64]) -> [Direction<'a>; LANES] {
        let n = self.n();
        from_fn(|k| {
            let x = x.get(n * (1 + first + k)..n * (2 + first + k)).unwrap_or_default();
            let theta = match self.values.get(first + k) {
                Some(Target::Parameter(i)) => &self.unit[self.unit.len() - 1 - i..],
                _ => &[],
            };
            Direction { x, theta, ..Direction::default() }
        })
    }

    /// Puts values and derivatives, which `evaluate` hands on for the given directions, into their places: `n` values and `n` derivatives by
    /// each value of a job.
    fn place(
        &self,
        n: usize,
        x: &[f64],
        places: &mut [f64],
        evaluate: impl Fn(&dyn Slopes, &[Direction<'_>], &mut Take<'_>),
    ) {
        // `new` asked for them: a model does not change its mind.
        let Ok(slopes) = self.inner.slopes() else { return places.fill(f64::NAN) };
        let (values, derivatives) = places.split_at_mut(n);
        for first in (0..self.values.len()).step_by(LANES) {
            let n_along = LANES.min(self.values.len() - first);
            evaluate(slopes, &self.along(first, x)[..n_along], &mut |i, value, slopes| {
                values[i] = value;
                let columns = derivatives[n * first..].chunks_exact_mut(n);
                for (column, slope) in columns.zip(slopes) {
                    column[i] = *slope;
                }
            });
        }
    }
}

impl Model for Sensitive {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, theta: &[f64], x: &mut [f64]) {
        let n = self.n();
        self.place(n, &[], x, |slopes, along, take| slopes.initial(theta, along, take));
        for (column, value) in x.chunks_exact_mut(n).skip(1).zip(&self.values) {
            for &i in &self.given {
                column[i] = 0.0;
            }
            if let Target::Initial(i) = *value {
                column[i] = 1.0;
            }
        }
    }

    fn rhs(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        let n = self.n();
        self.place(n, x, dx, |slopes, along, take| {
            slopes.rhs(Point { t, x: &x[..n], theta, u }, along, take);
        });
    }

    fn output(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, y: &mut [f64]) {
        let (n, n_output) = (self.n(), self.inner.spec().n_output());
        self.place(n_output, x, y, |slopes, along, take| {
            slopes.output(Point { t, x: &x[..n], theta, u }, along, take);
        });
    }

    fn solver(&self) -> Solver {
        self.inner.solver()
    }

    fn n_switch(&self) -> usize {
        self.inner.n_switch()
    }

    fn switches(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, g: &mut [f64]) {
        self.inner.switches(t, &x[..self.n()], theta, u, g);
    }
}
