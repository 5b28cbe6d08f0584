//! Explanations that hold little in memory: intermediate results that are computed again give the same findings to the bit.
#![allow(missing_docs, clippy::unwrap_used)]

mod study_kit;

use starlings_coordinator::explain::{Context, Findings, Options, explain};
use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::store::Store;
use study_kit::{Case, csv, grid, normals};

/// A mass on a spring that is driven.
const STUDY: &str = include_str!("study_kit/spring.toml");

/// The rest of the recording is held out.
const TRAIN: &str = "train = [0.0, 12.0]\n";

/// The recording of a mass whose spring stiffens, by small steps of a symplectic rule.
fn recording() -> String {
    let force = |t: f64| (1.3 * t).sin() + 0.5 * (3.1 * t + 0.4).sin();
    let times = grid(750, 0.02);
    let noise = normals(times.len(), 1);
    let (mut x, mut v, mut position) = (0.08_f64, 0.0, Vec::new());
    for (t, e) in times.iter().zip(noise) {
        position.push(x + 0.002 * e);
        for k in 0..20 {
            v += 1e-3 * (force(t + 1e-3 * f64::from(k)) - 40.0 * x - v - 1500.0 * x.powi(3));
            x += 1e-3 * v;
        }
    }
    let forces: Vec<f64> = times.iter().map(|t| force(*t)).collect();
    csv("time,F,position", &[&times, &forces, &position])
}

fn holding(case: &Case, hold: usize) -> Findings {
    let path = case.fresh();
    std::fs::create_dir_all(&path).unwrap();
    let store = Store::create(&path.join("run.db"), &[]).unwrap();
    let mut context = Context { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0 };
    let options = Options { hold, ..Options::default() };
    explain(&case.study(), &mut InProcess::new(2), &store, &mut context, &options).unwrap()
}

#[test]
fn an_explanation_that_may_hold_nothing_finds_the_same() {
    let case = Case::new(&format!("{STUDY}{TRAIN}"), &[("driven.csv", recording())]);
    let plenty = holding(&case, Options::default().hold);
    assert!(!plenty.explanation.effects.is_empty(), "{:?}", plenty.explanation);
    // A limit of nothing, and one with which some are held and others are not.
    for hold in [0, 100_000] {
        let little = holding(&case, hold);
        assert_eq!(little.explanation, plenty.explanation, "{hold} bytes");
        assert_eq!(little.figures, plenty.figures, "{hold} bytes");
        assert_eq!(little.explained_study, plenty.explained_study, "{hold} bytes");
    }
}
