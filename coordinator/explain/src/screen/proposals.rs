//! Terms that nobody listed, made from the unknown input that an equation would need.
//!
//! Every term of a small grammar ([`grammar`]) is fitted to the unknown input. They are ranked by how well they predict parts of it that the
//! fit has not seen, with one sign throughout ([`recovered`]), and the first become candidates like any other: they are run, refitted and
//! judged, and pay for all the terms that were looked at. The same grammar makes the terms that may stand in place of one that was named
//! ([`likeness`]). Next file to read: [`crate::refit::search`].

mod grammar;
mod likeness;
mod recovered;
mod taken_up;

use starlings_models::EffectDef;
use starlings_study::Study;
use starlings_study::checked::{Library, PROPOSALS};

use self::grammar::grammar;
use self::likeness::Likeness;
use self::recovered::Recovered;
use super::along_run::{ReferenceRun, along_run};
use crate::fit::candidate::Candidate;
use crate::fit::kind::Kind;
use crate::fit::same_form::same_form;
use crate::locate::{Track, UnknownInput};
use crate::options::Options;

/// Terms of one equation that become candidates.
const MOST: usize = 60;
/// Terms that are tried in place of one that was named, in each of its equations.
const NEAREST: usize = 36;

/// Terms made from unknown inputs.
#[derive(Debug, Default)]
pub(crate) struct Proposals {
    /// Those that predict the unknown input best first.
    pub(crate) candidates: Vec<Candidate>,
    /// Terms that were looked at.
    pub(crate) considered: usize,
}

impl Proposals {
    /// Terms that were looked at for every one that was made; one where none was.
    pub(crate) fn looked_at(&self) -> f64 {
        (self.considered as f64 / self.candidates.len().max(1) as f64).max(1.0)
    }
}

/// Whether a search may make terms of its own: no list limits it, and they were not left out.
pub(crate) fn are_wanted(study: &Study, options: &Options) -> bool {
    let unlimited = options.only.is_empty() && matches!(study.explain.library, Library::All);
    unlimited && !options.without.iter().any(|name| name == PROPOSALS)
}

/// The terms that predict the unknown inputs best, of a form that none of `known` has. `theta` are the values of the first trained record,
/// physical, `tracks` the courses of the run to which the inputs belong.
pub(crate) fn proposals(
    study: &Study,
    theta: &[f64],
    tracks: &[Track],
    inputs: &[UnknownInput],
    known: &[Candidate],
) -> Proposals {
    let mut all = Proposals::default();
    for input in inputs {
        // Along the model as it is, far from the data, a term is not what it is where they were measured.
        let tracks = near_data(study, tracks, input);
        let run = ReferenceRun { study, theta, tracks: &tracks };
        let Some(recovered) = Recovered::new(&run, input) else { continue };
        let is_new = |def: &EffectDef| !known.iter().any(|other| same_form(&other.def, def));
        let of_equation: Vec<Candidate> = grammar(study, &input.state, &tracks)
            .into_iter()
            .filter(is_new)
            .map(|def| Candidate::new(def).of_kind(Kind::Proposal))
            .collect();
        all.considered += of_equation.len();
        let mut scored: Vec<(f64, Candidate)> = of_equation
            .into_iter()
            .filter_map(|candidate| {
                let term = course(&run, &candidate, &candidate.points[0], input)?;
                // What the input shows of a term is blurred; a score by runs tells more.
                Some((recovered.predicted_by(&term).unwrap_or(0.0), candidate))
            })
            .collect();
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        all.candidates.extend(scored.into_iter().take(MOST).map(|(_, candidate)| candidate));
    }
    all
}

/// The terms most like what an effect adds to the equations of states, of a form that none of `known` has: what may stand in its place.
/// `theta` and `tracks` as in [`proposals`], `inner` are the values of the parameters inside the effect. None where the effect has a memory
/// of its own, or adds to no equation.
pub(crate) fn in_place_of(
    study: &Study,
    theta: &[f64],
    tracks: &[Track],
    effect: (&Candidate, &[f64]),
    known: &[Candidate],
) -> Proposals {
    let run = ReferenceRun { study, theta, tracks };
    let is_new = |def: &EffectDef| !known.iter().any(|other| same_form(&other.def, def));
    let mut all = Proposals::default();
    for add in &effect.0.def.adds {
        let Some(named) = Likeness::new(&run, effect, add) else { continue };
        let made = grammar(study, &add.to, tracks).into_iter().filter(is_new);
        let made = made.map(|def| Candidate::new(def).of_kind(Kind::Proposal));
        let mut scored: Vec<(f64, Candidate)> = made.map(|c| (named.of(&run, &c), c)).collect();
        all.considered += scored.len();
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        all.candidates.extend(scored.into_iter().take(NEAREST).map(|(_, candidate)| candidate));
    }
    all
}

/// What effects with these values of their parameters add to the equation of an unknown input, at its times. Empty where none adds to it,
/// or one that does cannot be evaluated along the run.
pub(crate) fn along(
    study: &Study,
    theta: &[f64],
    tracks: &[Track],
    effects: &[(&Candidate, Vec<f64>)],
    input: &UnknownInput,
) -> Vec<f64> {
    let tracks = near_data(study, tracks, input);
    let run = ReferenceRun { study, theta, tracks: &tracks };
    let mut sum: Vec<f64> = Vec::new();
    for (candidate, values) in effects.iter().filter(|(c, _)| c.def.adds.iter().any(|a| a.to == input.state))
    {
        let Some(of_one) = course(&run, candidate, &values[1..], input) else { return Vec::new() };
        sum.resize(of_one.len(), 0.0);
        sum.iter_mut().zip(of_one).for_each(|(sum, v)| *sum += values[0] * v);
    }
    sum
}

/// The terms of a candidate in the equation of an unknown input along the run, at amplitude one.
fn course(
    run: &ReferenceRun<'_>,
    candidate: &Candidate,
    point: &[f64],
    input: &UnknownInput,
) -> Option<Vec<f64>> {
    let record = run.study.records.iter().position(|r| r.name == input.record)?;
    let steps = steps(&run.study.records[record].times, &input.time);
    let mut sum = vec![0.0; steps.len()];
    for add in candidate.def.adds.iter().filter(|add| add.to == input.state) {
        let term = along_run(run, candidate, point, &add.term, record, &steps)?;
        sum.iter_mut().zip(term).for_each(|(sum, v)| *sum += v);
    }
    Some(sum)
}

/// The courses with the states as an unknown input and the data have them, between whose times they go straight.
fn near_data(study: &Study, tracks: &[Track], input: &UnknownInput) -> Vec<Track> {
    let mut tracks = tracks.to_vec();
    let Some(record) = study.records.iter().position(|r| r.name == input.record) else { return tracks };
    for (name, course) in &input.states {
        let Some(track) = tracks.iter_mut().find(|track| track.name == *name) else { continue };
        let Some(values) = track.values.get_mut(record) else { continue };
        for (value, t) in values.iter_mut().zip(&study.records[record].times) {
            *value = between(&input.time, course, *t);
        }
    }
    tracks
}

/// The value of a course at a time, straight between its times and constant beyond them.
fn between(times: &[f64], course: &[f64], t: f64) -> f64 {
    let (Some(first), Some(last)) = (course.first(), course.last()) else { return f64::NAN };
    let after = times.partition_point(|known| *known <= t);
    if after == 0 {
        return *first;
    }
    if after >= times.len() {
        return *last;
    }
    let share = (t - times[after - 1]) / (times[after] - times[after - 1]);
    course[after - 1] + share * (course[after] - course[after - 1])
}

/// The position of each of these times among those of a record, the last before it.
fn steps(times: &[f64], wanted: &[f64]) -> Vec<usize> {
    wanted.iter().map(|t| times.partition_point(|known| known <= t).saturating_sub(1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_its_times_a_course_goes_straight_and_stays_beyond_them() {
        let at = |t| between(&[1.0, 2.0, 4.0], &[10.0, 20.0, 0.0], t);
        for (t, value) in
            [(0.0, 10.0), (1.0, 10.0), (1.5, 15.0), (2.0, 20.0), (3.0, 10.0), (4.0, 0.0), (9.0, 0.0)]
        {
            assert!((at(t) - value).abs() < 1e-12, "{t}");
        }
        assert!(between(&[], &[], 1.0).is_nan());
    }
}
