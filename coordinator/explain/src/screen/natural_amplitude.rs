//! The natural amplitude of a candidate: that at which its terms are as large as what they are added to.
//!
//! The terms are evaluated reference the run of the model as it is, without a further run. A probe with a small share of the
//! natural amplitude gives a response that is neither lost in rounding nor far from linear. This is a first guess, which the
//! screening corrects by the response that it measures. Next file to read: [`super::screening`].

use starlings_models::effect::Addition;
use starlings_models::equations::{At, Expression, Slot};
use starlings_models::{Drive, Quantity};
use starlings_study::Study;

use crate::fit::candidate::Candidate;
use crate::locate::Track;

/// The run reference which terms are evaluated.
pub(super) struct ReferenceRun<'a> {
    /// The variant that was run.
    pub study: &'a Study,
    /// Parameter values of the first trained record, physical, in the order of the setup.
    pub theta: &'a [f64],
    /// The courses.
    pub tracks: &'a [Track],
}

/// The amplitude with which the terms of a candidate, at this point of its grid, are as large as what they are added to:
/// the largest over its terms. Nothing where a term cannot be evaluated reference the run (memory of its own, delays).
pub(super) fn natural_amplitude(
    reference: &ReferenceRun<'_>,
    candidate: &Candidate,
    point: &[f64],
) -> Option<f64> {
    let ratios: Vec<f64> =
        candidate.def.adds.iter().filter_map(|add| ratio(reference, candidate, point, add)).collect();
    let largest = ratios.iter().copied().fold(0.0, f64::max);
    (largest > 0.0 && largest.is_finite()).then(|| 1.0 / largest)
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
    let names = std::cell::RefCell::new(Vec::<String>::new());
    let known = |name: &str| value(reference, candidate, point, name, 0, 0).is_some();
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
    let names = names.into_inner();
    let one = |step: &usize| {
        let t = *reference.study.records[record].times.get(*step)?;
        let values: Option<Vec<f64>> =
            names.iter().map(|name| value(reference, candidate, point, name, record, *step)).collect();
        Some(program.eval(&At { t, x: &[], theta: &values?, u: Drive::NONE, y: &[] }))
    };
    steps.iter().map(one).collect()
}

/// Root mean square of a term at amplitude one over that of what it is added to.
fn ratio(reference: &ReferenceRun<'_>, candidate: &Candidate, point: &[f64], add: &Addition) -> Option<f64> {
    let (mut term, mut host, mut n) = (0.0, 0.0, 0_u32);
    for (record, of_record) in reference.study.records.iter().enumerate().filter(|(_, r)| r.is_trained()) {
        let stride = (of_record.times.len() / 200).max(1);
        let steps: Vec<usize> = (0..of_record.times.len()).step_by(stride).collect();
        for (value, step) in
            along_run(reference, candidate, point, &add.term, record, &steps)?.iter().zip(&steps)
        {
            term += value.powi(2);
            host += size(reference, &add.to, record, *step).powi(2);
            n += 1;
        }
    }
    let (term, host) = ((term / f64::from(n)).sqrt(), (host / f64::from(n)).sqrt());
    (host > 0.0 && term.is_finite()).then(|| term / host)
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
fn slope(reference: &ReferenceRun<'_>, name: &str, record: usize, step: usize) -> Option<f64> {
    let track = reference.tracks.iter().find(|t| t.name == name)?;
    track.slope(record, step, &reference.study.records[record].times)
}

/// The size of what a term is added to: a state's rate, an output's or input's distance from its mean, a parameter's value.
fn size(reference: &ReferenceRun<'_>, to: &str, record: usize, step: usize) -> f64 {
    let has = |list: &[Quantity]| list.iter().any(|q| q.name == to);
    if has(&reference.study.spec.states) {
        return slope(reference, to, record, step).unwrap_or(0.0);
    }
    if let Some(course) = reference.tracks.iter().find(|t| t.name == to).and_then(|t| t.values.get(record)) {
        let mean = course.iter().sum::<f64>() / course.len() as f64;
        return course[step] - mean;
    }
    let setup = &reference.study.setup;
    let fitted = setup.parameters.iter().position(|p| p == to).and_then(|i| reference.theta.get(i)).copied();
    fitted.or_else(|| setup.model.constants.get(to).copied()).unwrap_or(0.0)
}
