//! Which cases are run: from the environment for the full battery, fixed for the small one.
//!
//! Next file to read: [`crate::case`].

use rand::RngExt;
use starlings_models::effect::library::{GENERIC, family_of};

use crate::case::{Case, Kind};
use crate::draw::random;
use crate::systems::{System, Truth};

/// Levels of noise in standard deviations of the signal.
const LEVELS: [f64; 3] = [0.01, 0.03, 0.1];
/// White noise, and an autoregression of order one.
const RHOS: [f64; 2] = [0.0, 0.6];
/// Samples, and of those seeds that record longer.
const SHORT: usize = 250;
const LONG: usize = 1000;

/// What is run.
pub struct Plan {
    pub systems: Vec<String>,
    pub kinds: Vec<String>,
    /// Names of effects.
    pub effects: Vec<String>,
    pub levels: Vec<f64>,
    /// Correlations of the noise of neighbouring samples.
    pub rhos: Vec<f64>,
    pub seeds: std::ops::Range<u64>,
    pub threads: usize,
}

impl Plan {
    /// Everything of these seeds, on two threads.
    pub fn of_seeds(seeds: std::ops::Range<u64>) -> Self {
        let all = Vec::new;
        let (levels, rhos) = (LEVELS.to_vec(), RHOS.to_vec());
        Self { systems: all(), kinds: all(), effects: all(), levels, rhos, seeds, threads: 2 }
    }

    /// From `BATTERY_SYSTEMS`, `BATTERY_KINDS`, `BATTERY_EFFECTS`, `BATTERY_NOISE`, `BATTERY_CORRELATION`, `BATTERY_SEEDS` (`0..10`) and `BATTERY_THREADS`.
    pub fn from_environment() -> Self {
        let list = |name: &str| -> Vec<String> {
            let text = std::env::var(name).unwrap_or_default();
            text.split(',').map(str::trim).filter(|word| !word.is_empty()).map(str::to_owned).collect()
        };
        let numbers =
            |name: &str| -> Vec<f64> { list(name).iter().map(|word| word.parse().unwrap()).collect() };
        let (levels, rhos) = (numbers("BATTERY_NOISE"), numbers("BATTERY_CORRELATION"));
        let seeds = std::env::var("BATTERY_SEEDS").unwrap_or_else(|_| "0..10".to_owned());
        let (first, end) = seeds.split_once("..").expect("BATTERY_SEEDS is like 0..10");
        let threads = std::env::var("BATTERY_THREADS").ok().and_then(|word| word.parse().ok());
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Self {
            systems: list("BATTERY_SYSTEMS"),
            kinds: list("BATTERY_KINDS"),
            effects: list("BATTERY_EFFECTS"),
            levels: if levels.is_empty() { LEVELS.to_vec() } else { levels },
            rhos: if rhos.is_empty() { RHOS.to_vec() } else { rhos },
            seeds: first.parse().unwrap()..end.parse().unwrap(),
            threads: threads.unwrap_or(cores),
        }
    }

    /// Every case of the plan.
    pub fn cases(&self, systems: &[System]) -> Vec<Case> {
        let mut cases = Vec::new();
        for (index, system) in systems.iter().enumerate() {
            if !self.systems.is_empty() && !self.systems.iter().any(|name| name == system.name) {
                continue;
            }
            for seed in self.seeds.clone() {
                for (&level, &rho) in self.levels.iter().flat_map(|l| self.rhos.iter().map(move |r| (l, r))) {
                    let n = if system.long && seed % 5 == 4 { LONG } else { SHORT };
                    let first = cases.len();
                    of_system(index, system, &mut cases);
                    for case in &mut cases[first..] {
                        let what =
                            [case.kind.word(), case.effect.as_deref().unwrap_or(""), &level.to_string()];
                        // Correlated noise is always told: its size cannot be found from third differences.
                        let auto = random(&what, seed).random_range(0..2) == 0 && rho <= 0.0;
                        (case.seed, case.level, case.rho, case.n, case.auto) = (seed, level, rho, n, auto);
                    }
                }
            }
        }
        let is_in = |list: &[String], name: &str| list.is_empty() || list.iter().any(|known| known == name);
        cases.retain(|case| {
            let effects =
                [case.effect.as_deref().unwrap_or_default(), case.second.as_deref().unwrap_or_default()];
            is_in(&self.kinds, case.kind.word()) && effects.iter().any(|effect| is_in(&self.effects, effect))
        });
        cases
    }
}

/// One case of every effect in a system, seed and noise still open.
fn of_system(index: usize, system: &System, cases: &mut Vec<Case>) {
    let case = |kind: Kind, effect: Option<&str>, accepted: Vec<String>, without: Vec<String>| {
        let effect = effect.map(str::to_owned);
        Case {
            system: index,
            kind,
            effect,
            second: None,
            accepted,
            accepted_second: Vec::new(),
            alone: Vec::new(),
            without,
            level: 0.0,
            rho: 0.0,
            n: 0,
            seed: 0,
            auto: false,
        }
    };
    let none = Vec::new;
    for truth in system.truths {
        let name = Some(truth.name);
        if family_of(truth.name) == Some(GENERIC) {
            cases.push(case(Kind::Generic, name, truth.accepted(), none()));
            continue;
        }
        cases.push(case(Kind::Library, name, truth.accepted(), none()));
        cases.push(case(Kind::LeftOut, name, truth.accepted(), truth.relatives()));
    }
    // Each with the next of its system.
    let listed: Vec<&Truth> =
        system.truths.iter().filter(|truth| family_of(truth.name) != Some(GENERIC)).collect();
    for (truth, beside) in listed.iter().zip(listed.iter().skip(1)) {
        let pair = case(Kind::Pair, Some(truth.name), truth.accepted(), none());
        let second = Some(beside.name.to_owned());
        cases.push(Case { second, accepted_second: beside.accepted(), ..pair });
    }
    cases.extend(system.absorbed.iter().map(|t| case(Kind::Absorbed, Some(t.name), t.accepted(), none())));
    let unlisted = system.unlisted_names();
    cases.extend(unlisted.iter().map(|name| case(Kind::Unlisted, Some(name), vec![name.clone()], none())));
    cases.extend(system.alien_names().iter().map(|name| case(Kind::Alien, Some(name), none(), none())));
    cases.push(case(Kind::Null, None, none(), none()));
}
