//! How large an effect must be to be felt: its terms evaluated along the run of the model as it is.
//!
//! A probe with a share of what the term is added to gives a response that is neither lost in rounding nor far from linear.
//! Only a first guess: the screening measures the response and corrects it. Next file to read: [`super::screening`].

use starlings_models::effect::Addition;
use starlings_models::equations::{At, Expression, Slot};
use starlings_models::{Drive, Quantity};
use starlings_study::Study;

use crate::fit::candidate::Candidate;
use crate::locate::Track;

/// The times and courses of a run.
pub(crate) struct ReferenceRun<'a> {
    /// The variant that was run.
    pub study: &'a Study,
    /// Parameter values of the first trained record, physical, in the order of the setup.
    pub theta: &'a [f64],
    /// The courses.
    pub tracks: &'a [Track],
}

/// The amplitude with which the terms of a candidate, at this point of its grid, are as large as what they are added to:
/// the largest over its terms. Nothing where a term cannot be evaluated along the run (memory of its own, delays).
pub(crate) fn natural_amplitude(
    along: &ReferenceRun<'_>,
    candidate: &Candidate,
    point: &[f64],
) -> Option<f64> {
    let ratios: Vec<f64> =
        candidate.def.adds.iter().filter_map(|add| ratio(along, candidate, point, add)).collect();
    let largest = ratios.iter().copied().fold(0.0, f64::max);
    (largest > 0.0 && largest.is_finite()).then(|| 1.0 / largest)
}

/// Root mean square of a term at amplitude one over that of what it is added to.
fn ratio(along: &ReferenceRun<'_>, candidate: &Candidate, point: &[f64], add: &Addition) -> Option<f64> {
    let names = std::cell::RefCell::new(Vec::<String>::new());
    let known = |name: &str| value(along, candidate, point, name, 0, 0).is_some();
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
    let program = Expression::parse(&add.term).ok()?.compile(&resolve, &|_| None).ok()?;
    let names = names.into_inner();
    let (mut term, mut host, mut n) = (0.0, 0.0, 0_u32);
    for (record, of_record) in along.study.records.iter().enumerate().filter(|(_, r)| r.is_trained()) {
        let stride = (of_record.times.len() / 200).max(1);
        for (step, &t) in of_record.times.iter().enumerate().step_by(stride) {
            let values: Option<Vec<f64>> =
                names.iter().map(|name| value(along, candidate, point, name, record, step)).collect();
            let at = At { t, x: &[], theta: &values?, u: Drive::NONE, y: &[] };
            term += program.eval(&at).powi(2);
            host += size(along, &add.to, record, step).powi(2);
            n += 1;
        }
    }
    let (term, host) = ((term / f64::from(n)).sqrt(), (host / f64::from(n)).sqrt());
    (host > 0.0 && term.is_finite()).then(|| term / host)
}

/// A name's value at one time: amplitude one, grid values, parameters, constants, courses, and `ddt:` of a course.
fn value(
    along: &ReferenceRun<'_>,
    candidate: &Candidate,
    point: &[f64],
    name: &str,
    record: usize,
    step: usize,
) -> Option<f64> {
    if let Some(of) = name.strip_prefix("ddt:") {
        return slope(along, of, record, step);
    }
    let setup = &along.study.setup;
    if let Some(i) = candidate.def.parameters.iter().position(|p| p.name == name) {
        return Some(if i == 0 { 1.0 } else { *point.get(i - 1)? });
    }
    let course = || along.tracks.iter().find(|t| t.name == name)?.values.get(record)?.get(step).copied();
    let fitted = || along.theta.get(setup.parameters.iter().position(|p| p == name)?).copied();
    let default = || along.study.spec.parameters.iter().find(|q| q.name == name)?.default;
    course().or_else(fitted).or_else(|| setup.model.constants.get(name).copied()).or_else(default)
}

/// Slope of a course.
fn slope(along: &ReferenceRun<'_>, name: &str, record: usize, step: usize) -> Option<f64> {
    let track = along.tracks.iter().find(|t| t.name == name)?;
    track.slope(record, step, &along.study.records[record].times)
}

/// The size of what a term is added to: a state's rate, an output's or input's distance from its mean, a parameter's value.
fn size(along: &ReferenceRun<'_>, to: &str, record: usize, step: usize) -> f64 {
    let has = |list: &[Quantity]| list.iter().any(|q| q.name == to);
    if has(&along.study.spec.states) {
        return slope(along, to, record, step).unwrap_or(0.0);
    }
    if let Some(course) = along.tracks.iter().find(|t| t.name == to).and_then(|t| t.values.get(record)) {
        let mean = course.iter().sum::<f64>() / course.len() as f64;
        return course[step] - mean;
    }
    let setup = &along.study.setup;
    let fitted = setup.parameters.iter().position(|p| p == to).and_then(|i| along.theta.get(i)).copied();
    fitted.or_else(|| setup.model.constants.get(to).copied()).unwrap_or(0.0)
}
