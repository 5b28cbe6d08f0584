//! A model made of expressions.
//!
//! It evaluates; [`crate::integrate`] integrates. Next file to read: [`crate::integrate`].

use std::collections::BTreeMap;

use super::at::{At, Direction, Slot};
use super::build::{self, Built};
use super::def::EquationsDef;
use super::program::Programs;
use crate::integrate::Solver;
use crate::segment::Drive;
use crate::slopes::{LANES, Point, Slopes, Take};
use crate::{Memory, Model, SetupError, Spec};

/// A model whose equations a study states.
#[derive(Clone, Debug)]
pub struct EquationsModel {
    def: EquationsDef,
    constants: BTreeMap<String, f64>,
    built: Built,
    /// n − 1 zeros and a one: its ends are the unit vectors.
    unit: Vec<f64>,
}

impl EquationsModel {
    /// Checks and compiles the equations.
    ///
    /// Names that are neither state, input, output, `t` nor `pi` are parameters, in the order of first use: states first,
    /// each with its initial value and then its rate, then outputs.
    ///
    /// # Errors
    /// [`SetupError::Expression`] with place and column, [`SetupError::Twice`], or [`SetupError::Invalid`] for a state
    /// without rate or initial value, an unusable name or an unusable solver.
    pub fn new(def: &EquationsDef) -> Result<Self, SetupError> {
        Self::with_constants(def, &BTreeMap::new())
    }

    /// As [`EquationsModel::new`], for a study that fixes some parameters: a delay of a state or output by a constant needs
    /// no other bound.
    ///
    /// # Errors
    /// As [`EquationsModel::new`].
    pub fn with_constants(def: &EquationsDef, constants: &BTreeMap<String, f64>) -> Result<Self, SetupError> {
        let built = build::build(def, constants)?;
        let mut unit = vec![0.0; def.states.len()];
        if let Some(last) = unit.last_mut() {
            *last = 1.0;
        }
        Ok(Self { def: def.clone(), constants: constants.clone(), built, unit })
    }

    /// The same model with the named rate terms left out, wherever they occur; parameters that only they used are gone.
    ///
    /// # Errors
    /// [`SetupError::Unknown`] for a term that is not replaceable.
    pub fn without(&self, terms: &[&str]) -> Result<Self, SetupError> {
        Self::with_constants(&self.def.without(terms)?, &self.constants)
    }
}

impl Model for EquationsModel {
    fn spec(&self) -> &Spec {
        &self.built.spec
    }

    fn initial(&self, theta: &[f64], x: &mut [f64]) {
        self.built.initial.write(&At { t: 0.0, x: &[], theta, u: Drive::NONE, y: &[] }, x);
    }

    fn rhs(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        self.built.rates.write(&At { t, x, theta, u, y: &[] }, dx);
    }

    fn output(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, y: &mut [f64]) {
        self.built.outputs.write(&At { t, x, theta, u, y: &[] }, y);
    }

    fn solver(&self) -> Solver {
        self.built.solver
    }

    fn n_noise(&self) -> usize {
        self.built.noise.sources.len()
    }

    fn noise(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, b: &mut [f64]) {
        let n = self.unit.len();
        b.fill(0.0);
        for amplitude in &self.built.noise.amplitudes {
            b[amplitude.source * n + amplitude.state] = amplitude.value.eval(&At { t, x, theta, u, y: &[] });
        }
    }

    fn n_switch(&self) -> usize {
        self.built.switches.len()
    }

    fn switches(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, g: &mut [f64]) {
        self.built.switches.write(&At { t, x, theta, u, y: &[] }, g);
    }

    fn memories(&self) -> &[Memory] {
        &self.built.memories
    }

    fn remembered(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, values: &mut [f64]) {
        let at = At { t, x, theta, u, y: &[] };
        for (value, source) in values.iter_mut().zip(&self.built.sources) {
            *value = match *source {
                Slot::State(i) => x[i],
                Slot::Output(i) => self.built.outputs.one(i, &at),
                _ => f64::NAN,
            };
        }
    }

    fn jacobian(
        &self,
        t: f64,
        x: &[f64],
        theta: &[f64],
        u: Drive<'_>,
        dfdx: &mut [f64],
        dfdt: &mut [f64],
    ) -> bool {
        let n = self.unit.len();
        let at = At { t, x, theta, u, y: &[] };
        dfdx.fill(0.0);
        for (first, columns) in (0..n).step_by(LANES).zip(dfdx.chunks_mut(LANES * n)) {
            let n_column = columns.len() / n;
            let along: [Direction<'_>; LANES] = std::array::from_fn(|k| {
                let x = self.unit.get((n - 1).wrapping_sub(first + k)..).unwrap_or_default();
                Direction { x, ..Direction::default() }
            });
            hand_on(&self.built.rates, &at, &along[..n_column], &mut |i, _, slopes| {
                for (j, (column, slope)) in (first..).zip(columns.chunks_exact_mut(n).zip(slopes)) {
                    // A rate without the state has no slope, whatever values that are not finite would make of it.
                    if self.built.depends[i].contains(&j) {
                        column[i] = *slope;
                    }
                }
            });
        }
        let along = [Direction { t: 1.0, u: u.slope, ..Direction::default() }];
        self.built.rates.each_along(&at, &along, |i, _, [slope]| dfdt[i] = slope);
        true
    }

    fn slopes(&self) -> Result<&dyn Slopes, String> {
        match &self.built.not_smooth {
            Some(why) => Err(why.clone()),
            None => Ok(self),
        }
    }
}

impl Slopes for EquationsModel {
    fn initial(&self, theta: &[f64], along: &[Direction<'_>], take: &mut Take<'_>) {
        hand_on(&self.built.initial, &At { t: 0.0, x: &[], theta, u: Drive::NONE, y: &[] }, along, take);
    }

    fn rhs(&self, at: Point<'_>, along: &[Direction<'_>], take: &mut Take<'_>) {
        hand_on(&self.built.rates, &at.into(), along, take);
    }

    fn output(&self, at: Point<'_>, along: &[Direction<'_>], take: &mut Take<'_>) {
        hand_on(&self.built.outputs, &at.into(), along, take);
    }
}

/// Hands on values and derivatives along the directions, by code for as many of them or a few more.
fn hand_on(programs: &Programs, at: &At<'_>, along: &[Direction<'_>], take: &mut Take<'_>) {
    match along.len() {
        0..=2 => padded::<2>(programs, at, along, take),
        3..=4 => padded::<4>(programs, at, along, take),
        _ => padded::<LANES>(programs, at, along, take),
    }
}

fn padded<const N: usize>(programs: &Programs, at: &At<'_>, along: &[Direction<'_>], take: &mut Take<'_>) {
    let mut all = [Direction::default(); N];
    all[..along.len()].copy_from_slice(along);
    programs.each_along(at, &all, |i, value, slopes| take(i, value, &slopes[..along.len()]));
}
