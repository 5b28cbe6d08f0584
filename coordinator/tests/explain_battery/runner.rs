//! Runs cases: draws the data, writes the study, explains it, judges. One case is one thread.
//!
//! Next file to read: [`crate::tally`].

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use starlings_coordinator::explain::{Context, Explanation, Options, explain};
use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::store::Store;
use starlings_models::EffectDef;

use crate::case::{Case, Kind, Outcome, Result};
use crate::draw::{Draw, Noise, draw, draw_pair, noisy, random};
use crate::information::{Refit, refit, refit_with};
use crate::systems::System;
use crate::world::{Told, World};

/// χ² that a model leaves on data without noise below which the data hold next to nothing against it.
pub const UNFELT: f64 = 30.0;

/// Runs all cases on so many threads; results stand in the order of the cases. A truth that cannot reach the wanted strength
/// has no result.
pub fn run(systems: &[System], cases: &[Case], threads: usize) -> Vec<Result> {
    let worlds = worlds(systems, cases);
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(case) = cases.get(index) else { break };
                    let Some(result) = one(&worlds[&(case.system, case.n)], case) else { continue };
                    let mut results = results.lock().unwrap();
                    results.push((index, result));
                    if results.len() % 50 == 0 {
                        println!("{} of {} cases", results.len(), cases.len());
                    }
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap();
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

fn worlds<'a>(systems: &'a [System], cases: &[Case]) -> BTreeMap<(usize, usize), World<'a>> {
    let mut worlds = BTreeMap::new();
    for case in cases {
        let key = (case.system, case.n);
        worlds.entry(key).or_insert_with(|| World::new(&systems[case.system], case.n));
    }
    worlds
}

/// Runs one case.
pub fn one(world: &World<'_>, case: &Case) -> Option<Result> {
    let draw = match (case.effect.as_deref(), case.second.as_deref()) {
        (Some(one), Some(other)) => draw_pair(world, [one, other], case.seed)?,
        (effect, _) => draw(world, effect, case.seed)?,
    };
    let level = format!("{} {}", case.level, case.n);
    let mut rng =
        random(&[world.system.name, case.effect.as_deref().unwrap_or("null"), "noise", &level], case.seed);
    let (data, noise) = noisy(&draw, case.level, case.rho, &mut rng);
    let (lambda, case) = informed(world, case, &draw, &noise);
    let case = &case;
    let started = Instant::now();
    let found = explained(world, case, &data, &noise.sd);
    let wall_s = started.elapsed().as_secs_f64();
    let base = Result {
        case: case.clone(),
        outcome: Outcome::Failed,
        lambda,
        amplitude: draw.effect.as_ref().map_or(0.0, |(_, values)| values[0]),
        estimate: None,
        named: String::new(),
        told: Vec::new(),
        none: f64::NAN,
        left: [f64::NAN; 4],
        rival: None,
        truth: String::new(),
        n_inner: draw.effect.as_ref().map_or(0, |(_, values)| values.len() - 1),
        replaced: 0,
        held_out: None,
        runs: 0,
        false_alarm: f64::NAN,
        wall_s,
    };
    Some(match found {
        Err(why) => Result { named: why, ..base },
        Ok(found) => judged(base, &found, &draw, world, &noise),
    })
}

/// The information about what is missing, or about the second one of two; one that the data do not feel need not be named.
fn informed(world: &World<'_>, case: &Case, draw: &Draw, noise: &Noise) -> (f64, Case) {
    let misfit = |fit: Option<Refit>| fit.map_or(f64::NAN, |refit| refit.misfit);
    let mut case = case.clone();
    let (Some(one), Some(other)) = (&draw.effect, &draw.second) else {
        return (misfit(refit(world, draw, noise)), case);
    };
    let of = |one| misfit(refit_with(world, draw, noise, std::slice::from_ref(one)));
    let (one, other) = (of(one), of(other));
    for (left, names) in [(one, &case.accepted), (other, &case.accepted_second)] {
        if left < UNFELT {
            case.alone.extend(names.iter().cloned());
        }
    }
    // Of a fit that failed nobody knows.
    (if one.is_nan() || other.is_nan() { f64::NAN } else { one.min(other) }, case)
}

fn explained(
    world: &World<'_>,
    case: &Case,
    data: &[Vec<f64>],
    noise: &[f64],
) -> std::result::Result<Explanation, String> {
    let folder = tempfile::tempdir().unwrap();
    let told = if case.auto { Told::Auto } else { Told::Sd(noise) };
    let study = world.study_of(folder.path(), data, told, case.seed + 1);
    let store = Store::create(&folder.path().join("run.db"), &[]).unwrap();
    let options = Options { without: case.without.clone(), ..Options::default() };
    let mut context = Context { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0 };
    let found = explain(&study, &mut InProcess::new(1), &store, &mut context, &options);
    found.map(|findings| findings.explanation).map_err(|error| error.to_string())
}

fn judged(base: Result, found: &Explanation, draw: &Draw, world: &World<'_>, noise: &Noise) -> Result {
    let sets = std::iter::once(found.effects.iter().map(|e| e.name.clone()).collect::<Vec<_>>())
        .chain(found.tied_with.iter().cloned());
    let named: Vec<String> = sets.map(|set| set.join(" + ")).collect();
    let mut result = Result {
        outcome: Outcome::of(found, &base.case),
        named: if found.effects.is_empty() { found.headline.clone() } else { named.join(" | ") },
        told: told(found, &base.case),
        none: found.probabilities.as_ref().map_or(f64::NAN, |of| of.none_of_these),
        left: left(found),
        truth: truth(found, &base.case.accepted),
        replaced: found.replaced.len(),
        runs: found.runs,
        false_alarm: found.false_alarm.rate,
        ..base
    };
    // A proposal is no effect of the world, unless it has the form of the truth.
    let is_known = |name: &str| world.effects.iter().any(|effect| effect.name == name);
    let is_of_world = found.effects.iter().all(|effect| is_known(&effect.name));
    if !found.effects.is_empty() && found.replaced.is_empty() && is_of_world {
        result.rival = rival(found, draw, world, noise);
    }
    if result.outcome == Outcome::Right {
        result.held_out = held_out(found, world, &noise.sd);
        let is_it = |(def, _): &(EffectDef, Vec<f64>)| def.name == found.effects[0].name;
        let same = draw.second.is_none() && draw.effect.as_ref().is_some_and(is_it);
        let amplitude = &found.effects[0].parameters[0];
        result.estimate = same.then_some((amplitude.estimate, amplitude.interval95));
    }
    result
}

/// What became of the effects that are right, and why those that were refused were.
fn truth(found: &Explanation, accepted: &[String]) -> String {
    let is_right = |name: &String| accepted.contains(name);
    let fates = found.screened.iter().filter(|s| is_right(&s.name)).map(|s| {
        let at = if s.at.is_empty() { String::new() } else { format!(" at {}", s.at) };
        format!("{} {}{at}, gain {:.1}, own {:.3}", s.name, s.fate, s.gain, s.identifiable)
    });
    let refused = found.rejected.iter().filter(|r| is_right(&r.name));
    let refused = refused.map(|r| format!("{} refused by {}: {}", r.name, r.gate, r.reason));
    fates.chain(refused).collect::<Vec<_>>().join("; ")
}

/// What the residuals with what was named look like, and the share of the gap in them.
fn left(found: &Explanation) -> [f64; 4] {
    let of = &found.remaining;
    let share = found.probabilities.as_ref().map_or(f64::NAN, |told| told.discrepancy);
    [of.rmse_over_noise, of.whiteness_p, of.inflation, share]
}

/// The probabilities that were told, with what is so.
fn told(found: &Explanation, case: &Case) -> Vec<(f64, bool)> {
    let Some(of) = &found.probabilities else { return Vec::new() };
    let is_unlisted = matches!(case.kind, Kind::LeftOut | Kind::Alien);
    let is_truth = |names: &[String]| !is_unlisted && case.is_right(names);
    let mut sets: Vec<(f64, bool)> = of.sets.iter().map(|s| (s.probability, is_truth(&s.names))).collect();
    // With and without an effect that the data do not feel is one truth.
    if case.second.is_some() && sets.iter().any(|(_, so)| *so) {
        let right = sets.iter().filter(|(_, so)| *so).map(|(probability, _)| probability).sum();
        sets.retain(|(_, so)| !so);
        sets.push((right, true));
    }
    let others = [
        (of.none_of_these, is_unlisted),
        (of.nothing_missing, matches!(case.kind, Kind::Null | Kind::Absorbed)),
    ];
    sets.into_iter().chain(others).collect()
}

/// The noise-free misfit of what was named.
fn rival(found: &Explanation, draw: &Draw, world: &World<'_>, noise: &Noise) -> Option<f64> {
    let effects: Vec<(EffectDef, Vec<f64>)> = found
        .effects
        .iter()
        .map(|effect| {
            let def = world.resolved(&effect.name, &draw.theta);
            let estimate = |name: &str| effect.parameters.iter().find(|p| p.name == name).map(|p| p.estimate);
            let values = def.parameters.iter().map(|p| estimate(&p.name)).collect::<Option<Vec<f64>>>();
            values.map(|values| (def, values))
        })
        .collect::<Option<_>>()?;
    refit_with(world, draw, noise, &effects).map(|fit| fit.misfit)
}

/// RMSE after over the true noise, root mean square over the channels.
fn held_out(found: &Explanation, world: &World<'_>, noise: &[f64]) -> Option<f64> {
    let rows: Vec<f64> = found
        .gap
        .iter()
        .filter(|row| row.usage == "held-out")
        .filter_map(|row| {
            let channel = world.system.channels.iter().position(|name| *name == row.channel)?;
            Some((row.after / noise[channel]).powi(2))
        })
        .collect();
    (!rows.is_empty()).then(|| (rows.iter().sum::<f64>() / rows.len() as f64).sqrt())
}
