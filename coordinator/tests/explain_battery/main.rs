//! The battery of `explain`: systems with an effect missing, with none, and with one that no search knows.
//!
//! The truth is simulated more finely than the model. A small part runs with every test; the whole is `just explain-battery`
//! and writes the tables of docs/battery.md. Next file to read: [`systems`].
#![allow(missing_docs, unreachable_pub, clippy::unwrap_used, clippy::print_stdout)]

mod case;
mod draw;
mod information;
mod plan;
mod reliability;
mod runner;
mod structure;
mod systems;
mod tally;
mod world;

use std::path::{Path, PathBuf};

use starlings_models::BuildSetup;

use case::{Kind, Outcome};
use draw::{STRENGTH, STRENGTH_WITHIN, change_of, draw};
use plan::Plan;
use systems::System;
use tally::Group;
use world::World;

/// Systems named in `BATTERY_SYSTEMS`, or all.
fn chosen() -> Vec<System> {
    let only = std::env::var("BATTERY_SYSTEMS").unwrap_or_default();
    systems::all().into_iter().filter(|system| only.is_empty() || only.contains(system.name)).collect()
}

#[test]
fn the_model_reproduces_the_finer_truth_that_lacks_nothing() {
    for system in systems::all() {
        let world = World::new(&system, 250);
        for seed in 0..2 {
            let draw = draw(&world, None, seed).expect("a run");
            let model = world.model.build().expect("checked");
            let simulated = world.run(model.as_ref(), &draw.theta).expect("a run");
            // Of the smallest noise of the battery, 1 % of the signal.
            let off = change_of(&draw.clean, &simulated) / 0.01;
            println!("{} {seed}: {off:.1e} of the noise", system.name);
            // A thousandth of the noise carries no information: χ² of 1000 values rises by 1e-3. The tube's own steps leave
            // more, most of which its parameters imitate.
            let allowed = if matches!(system.finer, systems::Finer::LayoutStep(_)) { 0.1 } else { 1e-3 };
            assert!(off < allowed, "{} {seed}: {off:e}", system.name);
        }
    }
}

#[test]
fn every_effect_changes_the_outputs_by_the_wanted_share() {
    for system in systems::all() {
        let world = World::new(&system, 250);
        let aliens = [system.alien_names(), system.unlisted_names()].concat();
        let truths = system.truths.iter().chain(system.absorbed).map(|truth| truth.name);
        for name in truths.chain(aliens.iter().map(String::as_str)) {
            let draw = draw(&world, Some(name), 1).unwrap_or_else(|| panic!("{} {name}", system.name));
            assert!((draw.change - STRENGTH).abs() <= STRENGTH_WITHIN, "{name}: {}", draw.change);
        }
        for truth in system.truths.iter().chain(system.absorbed) {
            let known = truth.relatives();
            assert!(known.iter().all(|name| world.effect(name).name == *name));
            assert!(truth.equals.iter().all(|(_, why)| !why.is_empty()));
        }
    }
}

#[test]
fn a_small_battery_is_explained() {
    let systems = systems::all();
    let (white, levels) = (vec![0.0], vec![0.03]);
    let plan = Plan { levels, rhos: white, ..Plan::of_seeds(0..2) };
    let small = [
        ("oscillator", "coulomb-friction"),
        ("oscillator", "cubic-stiffness"),
        ("pendulum", "quadratic-drag"),
        ("tanks", "overflow:h1"),
        ("motor", "throat-erosion"),
        ("windkessel", "series-resistance"),
        ("windkessel", "inertance"),
        ("building", "heat-from-input:air:sun"),
    ];
    let mut cases = plan.cases(&systems);
    cases.retain(|case| {
        let system = systems[case.system].name;
        let effect = case.effect.as_deref().unwrap_or_default();
        match case.kind {
            Kind::Library => small.contains(&(system, effect)),
            Kind::Generic => effect == "loss:X",
            Kind::Null => system != "tube",
            Kind::Alien => matches!(effect, "telegraph-force" | "straining" | "chuffing"),
            Kind::Unlisted => effect == "square-times:v:x:v",
            Kind::LeftOut => small[..2].contains(&(system, effect)),
            Kind::Pair => (system, effect) == ("windkessel", "series-resistance"),
            Kind::Absorbed => matches!(effect, "linear-support" | "sensor-gain:thrust"),
        }
    });
    let results = runner::run(&systems, &cases, plan.threads);
    println!("{}", tally::report(&results, &systems));
    println!("{}", tally::csv(&results, &systems));
    let of = |kind: Kind| Group::of("", &results, move |r| r.case.kind == kind);
    let informed = Group::of("", &results, |r| r.case.kind == Kind::Library && r.lambda > tally::INFORMATION);
    assert!(informed.results.len() >= 4, "{} cases carry the information", informed.results.len());
    assert_eq!(of(Kind::Library).count(Outcome::Wrong), 0);
    assert!(informed.share(&[Outcome::Right, Outcome::RightInTie]) >= 0.8);
    for quiet in [Kind::Null, Kind::Absorbed] {
        let quiet = of(quiet);
        assert_eq!(quiet.count(Outcome::Wrong) + quiet.count(Outcome::TieWithout), 0);
    }
    assert_eq!(of(Kind::Alien).count(Outcome::Wrong), 0);
    let pairs = of(Kind::Pair);
    assert!(!pairs.results.is_empty() && pairs.results.iter().all(|r| r.lambda > tally::INFORMATION));
    assert!((pairs.share(&[Outcome::Right, Outcome::RightInTie]) - 1.0).abs() < 1e-9);
    probabilities_hold(&results);
}

/// What is told of a case sums to one, and answers told with 90 % and more are so in about as large a share: of the twenty at hand one may
/// be off.
fn probabilities_hold(results: &[case::Result]) {
    for result in results.iter().filter(|result| !result.told.is_empty()) {
        let sum: f64 = result.told.iter().map(|(p, _)| p).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{sum} in {:?}", result.case);
    }
    let table = reliability::reliability(results);
    let sure = table.iter().find(|answers| answers.told[0] >= 0.9).expect("answers told with 90 % and more");
    let (n, told, so) = (sure.n, sure.mean, sure.so);
    assert!(n >= 10 && (so - told).abs() < 0.05, "{n} answers told with {told:.3}, of which {so:.3} are so");
    let picture = reliability::picture(results);
    assert_eq!(picture.matches("<circle").count(), table.len(), "{picture}");
}

/// Noise that is correlated in time is no gap, and hides no effect that it leaves audible.
#[test]
fn a_small_battery_with_correlated_noise_is_explained() {
    let systems = systems::all();
    let (levels, rhos) = (vec![0.03], vec![0.6]);
    let plan = Plan { levels, rhos, ..Plan::of_seeds(0..2) };
    let small = [
        ("oscillator", "cubic-stiffness"),
        ("pendulum", "quadratic-drag"),
        ("motor", "sensor-lag:thrust"),
        ("windkessel", "inertance"),
        ("building", "heat-from-input:air:sun"),
    ];
    let mut cases = plan.cases(&systems);
    cases.retain(|case| {
        let named = (systems[case.system].name, case.effect.as_deref().unwrap_or_default());
        match case.kind {
            Kind::Library => small.contains(&named),
            Kind::Null => !matches!(named.0, "tube" | "tanks" | "reactor"),
            Kind::Alien => named.1 == "telegraph-force",
            Kind::Generic => named.1 == "loss:X",
            Kind::LeftOut | Kind::Pair | Kind::Absorbed | Kind::Unlisted => false,
        }
    });
    let results = runner::run(&systems, &cases, plan.threads);
    println!("{}", tally::report(&results, &systems));
    println!("{}", tally::csv(&results, &systems));
    let informed = Group::of("", &results, |r| r.case.kind == Kind::Library && r.lambda > tally::INFORMATION);
    assert!(informed.results.len() >= 4, "{} cases carry the information", informed.results.len());
    assert!(informed.share(&[Outcome::Right, Outcome::RightInTie]) >= 0.9);
    let nulls = Group::of("", &results, |r| r.case.kind == Kind::Null);
    assert_eq!(nulls.count(Outcome::NoGap), nulls.results.len());
    let others = Group::of("", &results, |r| r.case.kind != Kind::Null);
    assert_eq!(others.count(Outcome::Wrong), 0);
}

#[test]
#[ignore = "hours: `just explain-battery`"]
fn the_whole_battery_is_tallied() {
    let systems = systems::all();
    let plan = Plan::from_environment();
    let cases = plan.cases(&systems);
    println!("{} cases on {} threads", cases.len(), plan.threads);
    let results = runner::run(&systems, &cases, plan.threads);
    let report = tally::report(&results, &systems);
    println!("{report}");
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(folder.join("battery.md"), report).unwrap();
    std::fs::write(folder.join("battery.csv"), tally::csv(&results, &systems)).unwrap();
    println!("written to {}", folder.display());
    if std::env::var_os("STARLINGS_WRITE_PAGES").is_some() {
        let white: Vec<case::Result> = results.into_iter().filter(|r| r.case.rho <= 0.0).collect();
        let pictures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/pictures");
        std::fs::write(pictures.join("battery-reliability.svg"), reliability::picture(&white)).unwrap();
    }
}

#[test]
#[ignore = "prints what the lists of truths were made from"]
fn the_structure_of_the_systems_is_printed() {
    for system in chosen() {
        let world = World::new(&system, 250);
        for effect in &world.effects {
            for line in structure::lines(&world, &effect.name, 0..2) {
                println!("{line}");
            }
        }
    }
}
