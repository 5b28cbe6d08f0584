//! Terms evaluated along a run of the model, without a further run, and their derivatives by its parameters.
//!
//! Next file to read: [`super::natural_amplitude`].

use std::cell::RefCell;

use starlings_models::equations::{At, Direction, Expression, Program, Slot};
use starlings_models::{Drive, EffectDef};
use starlings_study::Study;

use crate::fit::candidate::Candidate;
use crate::locate::Track;

/// The run along which terms are evaluated.
pub(super) struct ReferenceRun<'a> {
    /// The variant that was run.
    pub study: &'a Study,
    /// Parameter values of the first trained record, physical, in the order of the setup.
    pub theta: &'a [f64],
    /// The courses.
    pub tracks: &'a [Track],
}

/// A term in which every name is a value to be given.
struct Term {
    program: Program,
    names: Vec<String>,
}

impl Term {
    /// `None` where it cannot be read, or reads a name that is not `known`.
    fn new(term: &str, known: impl Fn(&str) -> bool) -> Option<Self> {
        let names = RefCell::new(Vec::<String>::new());
        let resolve = |name: &str| {
            if !known(name) {
                return None;
            }
            let mut names = names.borrow_mut();
            let at = names.iter().position(|n| n == name).unwrap_or_else(|| {
                names.push(name.to_owned());
                names.len() - 1
            });
            Some(Slot::Parameter(at))
        };
        let program = Expression::parse(term).ok()?.compile(&resolve, &|_| None).ok()?;
        Some(Self { program, names: names.into_inner() })
    }

    /// What `of` makes of the term at every step of a record, where its names have the values that `value` gives.
    fn each(
        &self,
        times: &[f64],
        steps: &[usize],
        value: impl Fn(&str, usize) -> Option<f64>,
        of: impl Fn(&Program, &At<'_>) -> f64,
    ) -> Option<Vec<f64>> {
        let one = |step: &usize| {
            let t = *times.get(*step)?;
            let values: Option<Vec<f64>> = self.names.iter().map(|name| value(name, *step)).collect();
            Some(of(&self.program, &At { t, x: &[], theta: &values?, u: Drive::NONE, y: &[] }))
        };
        steps.iter().map(one).collect()
    }
}

/// A term of a candidate at amplitude one, at these steps of a record; nothing where it cannot be evaluated along the run.
pub(super) fn along_run(
    reference: &ReferenceRun<'_>,
    candidate: &Candidate,
    point: &[f64],
    term: &str,
    record: usize,
    steps: &[usize],
) -> Option<Vec<f64>> {
    let of = |name: &str, record: usize, step: usize| value(reference, candidate, point, name, record, step);
    let term = Term::new(term, |name| of(name, 0, 0).is_some())?;
    let times = &reference.study.records[record].times;
    term.each(times, steps, |name, step| of(name, record, step), Program::eval)
}

/// The derivative of a term of the model by one of its parameters, at these steps of a record: zero where the term does not read it, nothing
/// where it does and cannot be evaluated along the run.
pub(super) fn slope_along_run(
    reference: &ReferenceRun<'_>,
    term: &str,
    parameter: &str,
    record: usize,
    steps: &[usize],
) -> Option<Vec<f64>> {
    if !Expression::parse(term).ok()?.names().iter().any(|(name, _)| name == parameter) {
        return Some(vec![0.0; steps.len()]);
    }
    let none = Candidate::new(EffectDef::default());
    let of = |name: &str, record: usize, step: usize| value(reference, &none, &[], name, record, step);
    let term = Term::new(term, |name| of(name, 0, 0).is_some())?;
    let along: Vec<f64> = term.names.iter().map(|name| f64::from(u8::from(name == parameter))).collect();
    let direction = Direction { theta: &along, ..Direction::default() };
    let times = &reference.study.records[record].times;
    let slope = |program: &Program, at: &At<'_>| program.eval_dual(at, &direction).1;
    term.each(times, steps, |name, step| of(name, record, step), slope)
}

/// A name's value at one time: amplitude one, grid values, parameters, constants, courses, and `ddt:` of a course.
fn value(
    reference: &ReferenceRun<'_>,
    candidate: &Candidate,
    point: &[f64],
    name: &str,
    record: usize,
    step: usize,
) -> Option<f64> {
    if let Some(of) = name.strip_prefix("ddt:") {
        return slope(reference, of, record, step);
    }
    let setup = &reference.study.setup;
    if let Some(i) = candidate.def.parameters.iter().position(|p| p.name == name) {
        return Some(if i == 0 { 1.0 } else { *point.get(i - 1)? });
    }
    let course = || reference.tracks.iter().find(|t| t.name == name)?.values.get(record)?.get(step).copied();
    let fitted = || reference.theta.get(setup.parameters.iter().position(|p| p == name)?).copied();
    let default = || reference.study.spec.parameters.iter().find(|q| q.name == name)?.default;
    course().or_else(fitted).or_else(|| setup.model.constants.get(name).copied()).or_else(default)
}

/// Slope of a course.
pub(super) fn slope(reference: &ReferenceRun<'_>, name: &str, record: usize, step: usize) -> Option<f64> {
    let track = reference.tracks.iter().find(|t| t.name == name)?;
    track.slope(record, step, &reference.study.records[record].times)
}
