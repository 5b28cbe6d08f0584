//! What every built-in effect must do, in every model that can host it.
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod library_kit;

use std::collections::{BTreeMap, BTreeSet};

use library_kit::{Bench, amplitudes, benches};
use starlings_models::EffectDef;
use starlings_models::Model;
use starlings_models::effect::library::{FAMILIES, library, stem};
use starlings_models::effect::{Scale, Target, scale};
use starlings_models::equations::Expression;
use starlings_models::native::Windkessel2;
use starlings_models::units::Labels;

/// Kinds of effects whose amplitude may have either sign; physics lets no other be negative.
const EITHER: &[&str] = &[
    "quadratic-stiffness",
    "cubic-stiffness",
    "bias-force",
    "periodic-forcing",
    "gravity-component",
    "valve-step",
    "valve-drift",
    "bias-flow",
    "bias-heat",
    "throat-step",
    "burn-rate-shift",
    "external-pressure",
    "sensor-offset",
    "sensor-step",
    "sensor-drift",
    "sensor-gain",
    "input-gain",
    "input-offset",
    "input-drift",
    "source",
    "coupling",
    "interaction",
];

/// Every effect of the catalogue.
fn catalogue() -> Vec<EffectDef> {
    FAMILIES.iter().flat_map(starlings_models::effect::library::Family::catalogue).collect()
}

/// Every effect that some bench can host.
fn grown() -> Vec<(Bench, EffectDef)> {
    let of = |bench: Bench| library(&bench.spec).into_iter().map(move |effect| (bench.clone(), effect));
    benches().into_iter().flat_map(of).collect()
}

#[test]
fn every_kind_of_effect_stands_in_the_catalogue_once() {
    let mut stems = BTreeSet::new();
    for family in FAMILIES {
        let effects = family.catalogue();
        assert_eq!(
            effects.len(),
            family.n_grower(),
            "{}: a grower has no place in any specimen, or several kinds",
            family.name
        );
        for effect in effects {
            assert!(stems.insert(stem(&effect.name).to_owned()), "{} twice", effect.name);
        }
    }
    assert!(stems.len() > 40, "{stems:?}");
}

#[test]
fn every_effect_says_what_it_is_where_it_is_from_and_what_it_can_be_taken_for() {
    let stems: BTreeSet<String> = catalogue().iter().map(|effect| stem(&effect.name).to_owned()).collect();
    let mut faults = BTreeSet::new();
    let all = grown().into_iter().map(|(bench, effect)| (bench.spec, effect));
    let listed = catalogue().into_iter().map(|effect| (Windkessel2::default().spec().clone(), effect));
    for (spec, effect) in all.chain(listed) {
        let name = &effect.name;
        assert!(
            effect.says.starts_with(char::is_uppercase) && effect.says.ends_with('.'),
            "{name}: {}",
            effect.says
        );
        let year =
            |word: &str| word.len() == 4 && word.parse::<u32>().is_ok_and(|y| (1600..2030).contains(&y));
        assert!(effect.source.split([' ', ',', ';', '.']).any(year), "{name}: {}", effect.source);
        assert!(!effect.confounders.is_empty(), "{name} has no confounder");
        for other in &effect.confounders {
            let parameter = spec.parameters.iter().any(|q| q.name == *other);
            if !(parameter || stems.contains(other)) || other == stem(name) {
                faults.insert(format!("{} with `{other}`", stem(name)));
            }
        }
        for parameter in &effect.parameters {
            let says = &parameter.says;
            assert!(
                says.starts_with(char::is_uppercase) && says.ends_with('.'),
                "{name}, {}: {says}",
                parameter.name
            );
        }
    }
    assert!(faults.is_empty(), "confounded with itself or with nothing known: {faults:#?}");
}

#[test]
fn the_amplitude_may_be_zero_and_what_is_inside_a_term_has_a_grid_within_its_range() {
    for (bench, effect) in grown() {
        let name = format!("{}, {}", bench.name, effect.name);
        let (amplitude, inner) = effect.parameters.split_first().unwrap();
        let [lo, hi] = amplitude.range;
        assert!(lo <= 0.0 && hi > 0.0, "{name}: {lo} to {hi}");
        assert!(amplitude.grid.is_empty(), "{name}");
        assert_eq!(lo < 0.0, EITHER.contains(&stem(&effect.name)), "{name}: {lo} to {hi}");
        for parameter in inner {
            let [lo, hi] = parameter.range;
            assert!(lo.is_finite() && hi.is_finite() && lo <= hi, "{name}, {}", parameter.name);
            assert!((1..=4).contains(&parameter.grid.len()), "{name}, {}", parameter.name);
            assert!(parameter.grid.iter().all(|v| (lo..=hi).contains(v)), "{name}, {}", parameter.name);
            assert!(
                parameter.grid.len() == 1 || lo < hi,
                "{name}, {}: one value has no grid",
                parameter.name
            );
        }
    }
}

#[test]
fn names_are_given_once_in_a_library() {
    for bench in benches() {
        let (mut effects, mut parameters) = (BTreeSet::new(), BTreeMap::new());
        for effect in library(&bench.spec) {
            let own = effect.parameters.iter().map(|p| &p.name).chain(effect.states.iter().map(|s| &s.name));
            for name in own {
                if let Some(other) = parameters.insert(name.clone(), effect.name.clone()) {
                    panic!("{}: `{name}` belongs to {} and {other}", bench.name, effect.name);
                }
            }
            assert!(effects.insert(effect.name.clone()), "{}: {} twice", bench.name, effect.name);
        }
    }
}

#[test]
fn every_unit_goes_with_the_place_where_the_term_enters() {
    let mut faults = Vec::new();
    for (bench, effect) in grown() {
        let labels = Labels::new(&bench.spec, "s", true);
        faults.extend(labels.effect(&effect, &bench.spec).iter().map(|m| format!("{}: {m}", bench.name)));
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

/// How closely a model with an absent effect follows the model without.
fn absence(kind: &str) -> f64 {
    match kind {
        // A scheme of an order of its own, which is integrated or cut at other times as soon as an effect needs it.
        "fsi-tube" | "artery-1d" => 5e-2,
        // Likewise, in shorter steps and of second order.
        "rocket-motor-1d" => 1e-4,
        // Waves that take tens of thousands of steps.
        "toy-fsi" | "toy-fsi-windkessel" | "toy-fsi-stokes" => 5e-5,
        // A model's exact step becomes an integration to a relative tolerance of 1e-8, over many steps.
        _ => 1e-6,
    }
}

/// Whether an absent effect must leave every bit as it is: the model keeps its steps where an effect adds to outputs alone
/// and reads nothing of the past, which would cut them.
fn keeps_bits(effect: &EffectDef, bench: &Bench) -> bool {
    let spec = &bench.spec;
    effect.adds.iter().all(|add| {
        let target = Target::of(add, effect, spec, spec.parameters.len());
        target == Some(Target::Output) && !add.term.contains("delay(")
    })
}

#[test]
fn every_effect_is_absent_at_amplitude_zero() {
    let mut faults = Vec::new();
    for (bench, effect) in grown() {
        let Some(effect) = bench.resolved(&effect) else { continue };
        let plain = bench.run(&[], 0.0).unwrap();
        let allowed = if keeps_bits(&effect, &bench) { 0.0 } else { absence(&bench.name) };
        match bench.run(std::slice::from_ref(&effect), 0.0) {
            Ok(absent) if bench.difference(&plain, &absent) <= allowed => {}
            Ok(absent) => {
                faults.push(format!(
                    "{}, {}: {:e}",
                    bench.name,
                    effect.name,
                    bench.difference(&plain, &absent)
                ));
            }
            Err(error) => faults.push(format!("{}, {}: {error}", bench.name, effect.name)),
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn every_effect_changes_what_the_model_predicts() {
    let (mut changed, mut without) = (BTreeSet::new(), Vec::new());
    for (bench, effect) in grown() {
        let Some(effect) = bench.resolved(&effect) else { continue };
        // Integrated in the same way, so that only the effect can make a difference.
        let absent = bench.run(std::slice::from_ref(&effect), 0.0).unwrap();
        let seen = amplitudes(&effect).into_iter().any(|a| {
            let run = bench.run(std::slice::from_ref(&effect), a);
            // Ten times what the integration to a relative tolerance of 1e-8 may leave.
            run.is_ok_and(|with| bench.difference(&absent, &with) > 1e-5)
        });
        if seen {
            changed.insert(stem(&effect.name).to_owned());
        } else {
            without.push(format!("{}, {}", bench.name, effect.name));
        }
    }
    let all: BTreeSet<String> = catalogue().iter().map(|effect| stem(&effect.name).to_owned()).collect();
    let untried: Vec<&String> = all.difference(&changed).collect();
    assert!(without.is_empty() && untried.is_empty(), "without effect: {without:#?}, untried: {untried:?}");
}

#[test]
fn every_scale_belongs_to_a_quantity_of_the_model() {
    for (bench, effect) in grown() {
        for parameter in &effect.parameters {
            let (Scale::Range(name) | Scale::Amplitude(name)) = &parameter.scale else { continue };
            let spec = &bench.spec;
            let known =
                [&spec.states, &spec.outputs, &spec.inputs].into_iter().flatten().any(|q| q.name == *name);
            assert!(known, "{}, {}: {name}", bench.name, effect.name);
        }
    }
}

#[test]
fn a_resolved_effect_names_nothing_that_it_lost() {
    for (bench, effect) in grown() {
        let Some(resolved) = bench.resolved(&effect) else { continue };
        assert!(scale::is_resolved(&resolved));
        let lost = |name: &String| {
            let in_list = |def: &EffectDef| def.parameters.iter().any(|p| p.name == *name);
            in_list(&effect) && !in_list(&resolved)
        };
        let texts = resolved.adds.iter().map(|a| &a.term).chain(resolved.states.iter().map(|s| &s.rate));
        for text in texts {
            let names = Expression::parse(text).unwrap().names();
            assert!(names.iter().all(|(name, _)| !lost(name)), "{}: {text}", effect.name);
        }
    }
}
