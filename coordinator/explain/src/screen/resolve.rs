//! The candidates of a study with every number in the model's units.
//!
//! Parameters that count on the course of a quantity, in parts of the record or in sampling intervals are turned into the units
//! of the model. Next file to read: [`super::natural_amplitude`].

use starlings_models::effect::{EffectDef, EffectParameter, Scale, scale};
use starlings_models::equations::Expression;
use starlings_study::{Record, Study};

use super::candidates::kind_of;
use super::residual_timing::Timing;
use crate::fit::candidate::Candidate;
use crate::locate::Track;

/// The candidates made of these effects of a study, every number in the model's units. `tracks` are the courses of the model as it is.
pub(crate) fn resolved_candidates(
    study: &Study,
    defs: &[EffectDef],
    tracks: &[Track],
    timing: &Timing,
) -> Vec<Candidate> {
    let mut candidates = kinded(study, resolved(study, defs, tracks, timing));
    for candidate in &mut candidates {
        let Some(def) = defs.iter().find(|def| def.name == candidate.def.name) else { continue };
        let instants = instants(def);
        let places = candidate.def.parameters.iter().enumerate().filter(|(_, p)| instants.contains(&p.name));
        candidate.instants = places.map(|(k, _)| (k, sampling(study))).collect();
        let is_jump = |point: &Vec<f64>| {
            candidate.instants.iter().any(|(k, _)| *k > 0 && timing.jumps.contains(&point[k - 1]))
        };
        candidate.jumps = (0..candidate.points.len()).filter(|p| is_jump(&candidate.points[*p])).collect();
    }
    candidates
}

/// The candidates made of these effects as they are, with their kinds.
pub(crate) fn kinded(study: &Study, defs: impl IntoIterator<Item = EffectDef>) -> Vec<Candidate> {
    let candidate = |def: EffectDef| {
        let kind = kind_of(study, &def.name);
        Candidate::new(def).of_kind(kind)
    };
    defs.into_iter().map(candidate).collect()
}

/// The instants among the parameters of an effect: those that count in parts of the record, and those at which a term switches in time, as
/// `t_on` in `step(t - t_on)`.
fn instants(def: &EffectDef) -> Vec<String> {
    let terms = def.adds.iter().map(|add| &add.term).chain(def.states.iter().map(|state| &state.rate));
    let parsed = terms.filter_map(|term| Expression::parse(term).ok());
    let switches: Vec<Expression> = parsed.flat_map(|term| term.discontinuities()).collect();
    let is_own = |name: &str| def.parameters.iter().any(|parameter| parameter.name == name);
    let switches_at = |name: &str| {
        switches.iter().any(|at| {
            let names = at.names();
            at.uses_time() && names.iter().any(|(n, _)| n == name) && names.iter().all(|(n, _)| is_own(n))
        })
    };
    let inner = def.parameters.iter().skip(1);
    let is_instant =
        |p: &&EffectParameter| matches!(p.scale, Scale::Record | Scale::Jump) || switches_at(&p.name);
    let instants = inner.filter(is_instant);
    instants.map(|p| p.name.clone()).collect()
}

/// The effects with their numbers in the model's units. An effect whose quantity is constant along the run is left out, since its
/// numbers count in the course of that quantity. A duration inside a term is screened at the dominant periods of the residuals,
/// an instant at their change points as well, and a jump at theirs alone ([`super::residual_timing`]).
fn resolved(study: &Study, defs: &[EffectDef], tracks: &[Track], timing: &Timing) -> Vec<EffectDef> {
    let course = |name: &str| tracks.iter().find(|t| t.name == name).map(Track::ends);
    let times = || study.records.iter().filter(|r| r.is_trained()).filter_map(Record::train_span);
    let from = times().map(|s| s[0]).fold(f64::INFINITY, f64::min);
    let to = times().map(|s| s[1]).fold(f64::NEG_INFINITY, f64::max);
    let resolve = |def: &EffectDef| {
        let mut resolved = scale::resolve(def, &course, [from, to], sampling(study));
        if !scale::is_resolved(&resolved) {
            return None;
        }
        for wanted in def.parameters.iter().skip(1) {
            let Some(parameter) = resolved.parameters.iter_mut().find(|p| p.name == wanted.name) else {
                continue;
            };
            let [lo, hi] = parameter.range;
            let within =
                |values: &[f64]| values.iter().copied().filter(|v| lo < *v && *v < hi).collect::<Vec<_>>();
            match wanted.scale {
                Scale::Duration if !within(&timing.periods).is_empty() => {
                    parameter.grid = within(&timing.periods);
                }
                Scale::Record => parameter.grid.extend(within(&timing.change_points)),
                // Without a jump in its range there is nothing to seek.
                Scale::Jump if within(&timing.jumps).is_empty() => return None,
                Scale::Jump => parameter.grid = within(&timing.jumps),
                Scale::Absolute if instants(def).contains(&wanted.name) => {
                    let further = timing.jumps.iter().filter(|at| !timing.change_points.contains(at));
                    let all: Vec<f64> = timing.change_points.iter().chain(further).copied().collect();
                    parameter.grid.extend(within(&all));
                }
                _ => {}
            }
        }
        Some(resolved)
    };
    defs.iter().filter_map(resolve).collect()
}

/// The median interval between observations of the first trained record.
fn sampling(study: &Study) -> f64 {
    let record = study.records.iter().find(|r| r.is_trained());
    let mut steps: Vec<f64> =
        record.map(|r| r.times.windows(2).map(|w| w[1] - w[0]).collect()).unwrap_or_default();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use starlings_models::effect::Addition;

    #[test]
    fn a_parameter_at_which_a_term_switches_in_time_is_an_instant() {
        let of = |term: &str| {
            let named = |name: &str| EffectParameter { name: name.to_owned(), ..EffectParameter::default() };
            let adds = vec![Addition { to: "sensor:y".to_owned(), term: term.to_owned() }];
            let parameters = vec![named("size"), named("t_on"), named("level")];
            instants(&EffectDef { adds, parameters, ..EffectDef::default() })
        };
        assert_eq!(of("size*step(t - t_on)"), ["t_on"]);
        assert_eq!(of("size*max(2*(t - t_on), 0)"), ["t_on"]);
        assert_eq!(of("if(t > t_on, size*x, 0)"), ["t_on"]);
        assert_eq!(of("size*step(x - level)"), [""; 0], "a threshold of a state");
        assert_eq!(of("size*sign(x - level*t)"), [""; 0], "a line in time that a state crosses");
        assert_eq!(of("size*exp(-t/t_on)"), [""; 0], "a time constant");
    }
}
