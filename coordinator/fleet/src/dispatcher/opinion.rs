//! What workers say of one and the same job, and who of them is wrong.
//!
//! A worker that contradicts itself is wrong; otherwise the value that two workers share against one is right. Nothing is asked
//! here. Next file to read: [`super::dispute`].

use std::collections::BTreeSet;

use starlings_proto::State;

use super::message::WorkerId;
use crate::wire::Prediction;

/// Relative difference up to which runs of a program outside count as rounded differently.
const ROUNDING: f64 = 1e-6;

/// A prediction, or a failure of the model in words.
pub(super) type Said = Result<Prediction, String>;

/// What one worker says of a job.
#[derive(Clone, Debug)]
pub(super) struct Opinion {
    pub(super) by: WorkerId,
    /// Its name with its build.
    pub(super) name: String,
    pub(super) said: Said,
}

/// Who is wrong, as far as the opinions tell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// These.
    Wrong(BTreeSet<WorkerId>),
    /// Nobody can tell yet.
    Open,
}

/// Whether two predictions are the same to the last bit. A state that did not come inside is compared by its name, which says its
/// values.
fn same_bits(a: &Prediction, b: &Prediction) -> bool {
    let bits = |values: &[f64], others: &[f64]| {
        values.len() == others.len() && values.iter().zip(others).all(|(v, w)| v.to_bits() == w.to_bits())
    };
    let same_state = match (&a.state, &b.state) {
        (State::Values(a), State::Values(b)) => bits(a, b),
        (State::Named(a), State::Named(b)) => a == b,
        _ => false,
    };
    bits(&a.outputs, &b.outputs) && same_state
}

/// The values of a state that came inside; none of another.
fn inside(state: &State) -> &[f64] {
    if let State::Values(values) = state { values } else { &[] }
}

/// Whether two workers say the same.
pub(super) fn alike(a: &Said, b: &Said) -> bool {
    match (a, b) {
        (Ok(a), Ok(b)) => same_bits(a, b),
        // Words may carry numbers that differ by rounding; that there is no prediction is what counts.
        (Err(_), Err(_)) => true,
        _ => false,
    }
}

/// The workers that said different things of the job.
pub(super) fn unsteady(opinions: &[Opinion]) -> BTreeSet<WorkerId> {
    let contradicts = |o: &&Opinion| opinions.iter().any(|p| p.by == o.by && !alike(&p.said, &o.said));
    opinions.iter().filter(contradicts).map(|o| o.by).collect()
}

/// The workers of each value, of those that did not contradict themselves.
fn camps(opinions: &[Opinion]) -> Vec<BTreeSet<WorkerId>> {
    let unsteady = unsteady(opinions);
    let mut camps = Vec::<(&Said, BTreeSet<WorkerId>)>::new();
    for opinion in opinions.iter().filter(|o| !unsteady.contains(&o.by)) {
        match camps.iter_mut().find(|(said, _)| alike(said, &opinion.said)) {
            Some((_, camp)) => _ = camp.insert(opinion.by),
            None => camps.push((&opinion.said, BTreeSet::from([opinion.by]))),
        }
    }
    camps.into_iter().map(|(_, camp)| camp).collect()
}

fn all_but(opinions: &[Opinion], right: &BTreeSet<WorkerId>) -> Verdict {
    Verdict::Wrong(opinions.iter().map(|o| o.by).filter(|by| !right.contains(by)).collect())
}

/// Who is wrong, while others can still be asked: two workers that agree outweigh one.
pub(super) fn verdict(opinions: &[Opinion]) -> Verdict {
    let camps = camps(opinions);
    let most = camps.iter().map(BTreeSet::len).max().unwrap_or(0);
    let mut largest = camps.iter().filter(|camp| camp.len() == most);
    match (largest.next(), largest.next()) {
        (Some(right), None) if most >= 2 => all_but(opinions, right),
        _ => Verdict::Open,
    }
}

/// Who is wrong when nobody is left to ask: those that contradicted themselves, and those that are gone.
pub(super) fn last_verdict(opinions: &[Opinion], is_there: impl Fn(WorkerId) -> bool) -> Verdict {
    let camps = camps(opinions);
    if let [right] = camps.as_slice() {
        return all_but(opinions, right);
    }
    let present = camps.iter().filter(|camp| camp.iter().any(|by| is_there(*by))).collect::<Vec<_>>();
    match present.as_slice() {
        [right] => all_but(opinions, right),
        _ => Verdict::Open,
    }
}

/// The first value in which two opinions differ, in words.
pub(super) fn difference(opinions: &[Opinion]) -> String {
    let Some(first) = opinions.first() else { return String::new() };
    let Some(other) = opinions.iter().find(|o| !alike(&o.said, &first.said)) else { return String::new() };
    let (a, b) = (&first.name, &other.name);
    match (&first.said, &other.said) {
        (Ok(x), Ok(y)) => {
            let values =
                |p: &Prediction| p.outputs.iter().chain(inside(&p.state)).copied().collect::<Vec<_>>();
            let (outputs, x, y) = (x.outputs.len(), values(x), values(y));
            let at = x.iter().zip(&y).position(|(x, y)| x.to_bits() != y.to_bits());
            let Some(at) = at.or_else(|| (x.len() != y.len()).then_some(x.len().min(y.len()))) else {
                return format!(
                    "all predicted values agree, and the state at the end is another one on worker {a} than on {b}"
                );
            };
            let what = if at < outputs {
                format!("predicted value {}", at + 1)
            } else {
                format!("state {}", at - outputs + 1)
            };
            let of = |values: &[f64]| values.get(at).map_or_else(|| "absent".to_owned(), ToString::to_string);
            format!("{what} is {} on worker {a} and {} on worker {b}", of(&x), of(&y))
        }
        (Ok(_), Err(why)) => format!("worker {a} has a prediction and worker {b} none ({why})"),
        (Err(why), Ok(_)) => format!("worker {b} has a prediction and worker {a} none ({why})"),
        (Err(_), Err(_)) => String::new(),
    }
}

/// Whether all opinions agree but for rounding.
pub(super) fn rounded(opinions: &[Opinion]) -> bool {
    let predictions = opinions.iter().map(|o| o.said.as_ref().ok()).collect::<Option<Vec<_>>>();
    let Some([first, others @ ..]) = predictions.as_deref() else { return false };
    let close = |a: &[f64], b: &[f64]| {
        let size = a.iter().chain(b).fold(0.0_f64, |most, v| most.max(v.abs()));
        a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() <= ROUNDING * size)
    };
    // Of large states nobody knows by how much they differ: what is predicted decides.
    let close_state = |a: &State, b: &State| match (a, b) {
        (State::Named(_), State::Named(_)) => true,
        (State::Values(a), State::Values(b)) => close(a, b),
        _ => false,
    };
    others.iter().all(|p| close(&p.outputs, &first.outputs) && close_state(&p.state, &first.state))
}
