//! Runs of models with fields: periodic starts and relative noise of twins, what the summary pools, the effect of the observer.
// Values that are copied are compared exactly; the helpers of a test file are tests too.
#![allow(clippy::float_cmp, clippy::unwrap_used)]
mod study_kit;

use starlings_coordinator::report;
use starlings_coordinator::study::twin::{Recording, Twin, simulate};
use study_kit::tube::{STARTED, TRUTH, TUBE, blank, columns, start, truth};
use study_kit::{Case, Done, grid};

#[test]
fn the_periodic_start_of_a_twin_returns_after_every_period() {
    let times = grid(321, 0.01);
    // The recording's flow lasts two beats; the twin goes on for four.
    let of = truth(Twin { times, ..Twin::default() });
    assert!(of.n_period.is_some_and(|n| n < 30), "{:?}", of.n_period);
    for (name, values) in of.columns.iter().zip(&of.values) {
        let size = values.iter().fold(0.0, |max: f64, v| max.max(v.abs()));
        // 1e-10 of its size per period, over three periods; the samples of the periods differ by rounding of their times.
        // At a sample of the input its slope is the one before it, but at the very first, where there is none.
        for (a, b) in values[1..80].iter().zip(&values[241..320]) {
            assert!((a - b).abs() <= 1e-8 * size, "{name}: {a} and {b}");
        }
    }
}

#[test]
fn a_period_that_is_not_the_inputs_is_refused() {
    let study = Case::new(TUBE, &[("wall.csv", blank(161, 0.01, 6))]).study();
    let refused =
        |period| simulate(&study, &Twin { period: Some(period), ..Twin::default() }).unwrap_err().to_string();
    assert!(refused(1.0).contains("it has another period"), "{}", refused(1.0));
    assert!(refused(2.0).contains("before the first period does at 2"), "{}", refused(2.0));
}

#[test]
fn relative_noise_is_that_share_of_the_largest_amplitude_of_the_observed_outputs() {
    let (clean, noisy) = (truth(Twin::default()), truth(Twin { noise_share: 0.1, ..Twin::default() }));
    let sd = |of: &Recording, name: &str| of.noise.iter().find(|(n, _)| n == name).unwrap().1;
    let amplitude = |values: &Vec<f64>| {
        values.iter().fold(f64::MIN, |a, v| a.max(*v)) - values.iter().fold(f64::MAX, |a, v| a.min(*v))
    };
    let largest = clean.values[..6].iter().map(amplitude).fold(0.0, f64::max);
    assert_eq!(sd(&noisy, "displacement"), 0.1 * largest);
    assert_eq!(sd(&noisy, "pressure"), 0.0);
    assert_eq!(sd(&clean, "displacement"), 0.0);
    let spread: f64 = noisy.values[2].iter().zip(&clean.values[2]).map(|(a, b)| (a - b).powi(2)).sum();
    // 161 draws determine a variance to about a ninth.
    assert!(((spread / 161.0).sqrt() / (0.1 * largest) - 1.0).abs() < 0.2, "{spread}");
}

/// A fit of two noisy beats, told the initial state or left with the model's own.
fn fit(study: &str, share: f64, told: bool) -> Done {
    let of = truth(Twin { noise_share: share, seed: 5, ..Twin::default() });
    let wall = columns(&of, |c| c.starts_with("displacement") || c == "flow");
    let study = if told { study.replace("kind = \"fsi-tube\"", STARTED) } else { study.to_owned() };
    let sd = of.noise.iter().find(|(name, _)| name == "displacement").map_or(0.01, |(_, sd)| sd.max(1e-4));
    let study = study.replace("noise = 0.01", &format!("noise = {sd:?}"));
    Case::new(&study, &[("wall.csv", wall), ("start.csv", start(&of))]).run()
}

#[test]
fn a_field_is_one_entry_of_the_summary_and_data_ten_steps_apart_determine_the_stiffness() {
    // The tube steps by 1 ms, the recording by 10 ms.
    let done = fit(TUBE, 0.1, true);
    let names: Vec<&str> = done.summary.fit.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["displacement"]);
    assert_eq!(done.summary.fit.records[0].channels.len(), 1);
    let rows = done.table("predictions", "observed, predicted");
    let value = |row: &Vec<String>, i: usize| row[i].parse::<f64>().unwrap();
    let squares: f64 = rows.iter().map(|r| (value(r, 0) - value(r, 1)).powi(2)).sum();
    let rmse = (squares / rows.len() as f64).sqrt();
    let told = done.summary.fit.channels[0].train_rmse.unwrap();
    // The same sum in another order.
    assert!((told / rmse - 1.0).abs() < 1e-12, "{told} {rmse}");
    for (name, truth) in TRUTH {
        let p = done.estimate(name);
        // Four standard deviations: the truth lies further off in one of sixteen thousand draws.
        assert!(
            (p.estimate - truth).abs() < 4.0 * p.sd && p.sd < 0.1 * truth,
            "{name}: {} ± {}",
            p.estimate,
            p.sd
        );
    }
    assert!(done.summary.observer.is_none());
}

#[test]
fn the_summary_says_what_the_observer_does_for_a_state_that_starts_wrong() {
    let observer = "[observer]\nkind = \"nudging\"\ngain = 50.0\n";
    let tube =
        TUBE.replace("kind = \"fsi-tube\"", "kind = \"fsi-tube\"\nconstants = { \"initial:pi\" = 5e4 }");
    let wrong = fit(&format!("{tube}{observer}"), 0.02, false);
    let found = wrong.summary.observer.clone().unwrap();
    assert_eq!((found.kind.as_str(), found.gain), ("nudging", 50.0));
    assert!(
        found.innovation_rms_with < 0.8 * found.innovation_rms_without,
        "the observer holds the state: {found:?}"
    );
    let last: Vec<Vec<String>> =
        wrong.table("jobs", "pass, step").into_iter().filter(|row| row[0] == "0").collect();
    let runs = last.iter().filter(|row| row[1] == "0" || row[1] == "1").count();
    assert_eq!(runs, 2, "the free run and the one with the observer");
    let beside = last.iter().filter(|row| row[1] == "3").count();
    let points = wrong.summary.parameters.len() + 1;
    assert_eq!(beside, 2 * points, "the estimate and one beside it each, with the observer and free");
    let page = report::render(&report::reader::report_data(&wrong.folder.store).unwrap()).unwrap();
    assert!(page.contains("id=\"observer\"") && page.contains("With the observer nudging"));
    assert!(page.contains("displacement, record beats: residuals by component"));
    // First, middle and last component, and no other.
    let shown =
        |i: usize| page.contains(&format!("displacement[{i}], record beats: predicted against measured"));
    assert_eq!([0, 1, 2, 3, 4, 5].map(shown), [true, false, false, true, false, true]);
}
