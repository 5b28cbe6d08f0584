//! The natural amplitude of a candidate: that at which its terms are as large as what they are added to.
//!
//! The terms are evaluated along the run of the model as it is, without a further run. A probe with a small share of the
//! natural amplitude gives a response that is neither lost in rounding nor far from linear. This is a first guess, which the
//! screening corrects by the response that it measures. Next files to read: [`super::along_run`], then [`super::screening`].

use starlings_models::Quantity;
use starlings_models::effect::Addition;

use super::along_run::{ReferenceRun, along_run, slope};
use crate::fit::candidate::Candidate;

/// The amplitude with which the terms of a candidate, at this point of its grid, are as large as what they are added to:
/// the largest over its terms. Nothing where a term cannot be evaluated along the run (memory of its own, delays).
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
