//! Studies whose wall was measured as registered surfaces: what is compared, what is refused, and that nothing else changes.
// Values that are copied are compared exactly; the helpers of a test file are tests too.
#![allow(clippy::float_cmp, clippy::unwrap_used)]
mod study_kit;
mod wall_kit;

use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::Study;
use starlings_coordinator::study::identify::{At, identify};
use starlings_coordinator::study::trial::trial;
use study_kit::fleets::Mortal;
use study_kit::{Case, Done, csv};
use wall_kit::{COLUMN, SD, SURFACE, TRUTH, displacements, flow, profiles, rest, study, truth};

/// The same displacements as plain columns.
fn columns(noise: f64) -> String {
    let (times, columns) = displacements(noise);
    let flow = truth();
    let flow = &flow.values[flow.columns.iter().position(|c| c == "flow").unwrap()];
    let names: Vec<String> = (0..5).map(|i| format!("displacement[{i}]")).collect();
    let all: Vec<&[f64]> =
        [times.as_slice(), flow.as_slice()].into_iter().chain(columns.iter().map(Vec::as_slice)).collect();
    csv(&format!("time,flow,{}", names.join(",")), &all)
}

fn surface_case(channel: &str, extra: &str, profiles: String) -> Case {
    let files = [("flow.csv", flow()), ("rest.csv", rest()), ("profiles.csv", profiles)];
    Case::new(&format!("{}{extra}", study(channel)), &files)
}

fn bits(done: &Done) -> (u64, u64) {
    let e = done.estimate("E1");
    (e.estimate.to_bits(), e.sd.to_bits())
}

#[test]
fn on_a_straight_tube_a_surface_tells_what_a_displacement_does() {
    for extra in ["", "[estimator]\nkind = \"batch\"\n", "[estimator]\npoints = \"star\"\npasses = 2\n"] {
        let surface = surface_case(SURFACE, extra, profiles(SD, 0.0)).run();
        let column = Case::new(&format!("{}{extra}", study(COLUMN)), &[("flow.csv", columns(SD))]).run();
        let (s, c) = (surface.estimate("E1"), column.estimate("E1"));
        // Chords between nodes 5 cm apart lean by a few thousandths of displacements of millimetres.
        assert!((s.estimate - c.estimate).abs() < 0.05 * c.sd, "{} {} sd {}", s.estimate, c.estimate, c.sd);
        assert!((s.sd / c.sd - 1.0).abs() < 1e-3 && (c.estimate - TRUTH).abs() < 3.0 * c.sd);
        let fit = &surface.summary.fit.channels;
        assert!(fit.len() == 1 && fit[0].name == "displacement", "{fit:?}");
        // The root mean square distance is the scatter of the surface: 205 values of it.
        assert!((fit[0].train_rmse.unwrap() / SD - 1.0).abs() < 0.15, "{fit:?}");
    }
}

#[test]
fn identify_and_trial_see_distances_and_not_displacements() {
    let case = surface_case(SURFACE, "", profiles(0.0, 0.0));
    let study = case.study();
    let shown = trial(&study).unwrap();
    let rms = shown.iter().map(|c| c.rmse).fold(0.0, f64::max);
    // At the prior median of 5 instead of 3.5 million the wall is displaced by less, not by nothing.
    assert!((0.01..0.1).contains(&rms) && shown.iter().all(|c| c.n_obs == 41), "{rms}");
    let of = |study: &Study| identify(study, &mut InProcess::new(2), &At::Prior, &mut |_| {}).unwrap();
    let plain = Case::new(&self::study(COLUMN), &[("flow.csv", columns(0.0))]).study();
    let (surface, column) = (of(&study), of(&plain));
    let norm = |i: &starlings_coordinator::study::identify::Identification| i.parameters[0].sensitivity_norm;
    // As above.
    assert!((norm(&surface) / norm(&column) - 1.0).abs() < 1e-3, "{} {}", norm(&surface), norm(&column));
}

#[test]
fn a_node_past_the_end_of_a_surface_is_not_observed() {
    // Slid by 5 cm, the surface begins at 4 cm: the first node is off it.
    let done = surface_case(SURFACE, "", profiles(0.0, 5.0)).run();
    let rows = done.table("predictions", "output, observed");
    assert!(done.warns("signed distances") && done.warns("No surface shows 1 of its 5 nodes"));
    assert!(rows.len() == 4 * 41 && rows.iter().all(|row| row[0] != "displacement[0]"), "{}", rows.len());
    // What is left is compared with the wall 5 cm upstream, which the pulse reaches a hundredth of a second earlier.
    assert!((done.estimate("E1").estimate / TRUTH - 1.0).abs() < 0.05, "{}", done.estimate("E1").estimate);
}

#[test]
fn times_without_a_surface_are_run_over_and_not_observed() {
    let all = profiles(SD, 0.0);
    let every_tenth = |line: &&str| {
        line.split(',').next().unwrap().parse::<f64>().map_or(true, |t| (t * 5.0).fract() < 1e-9)
    };
    let some: Vec<&str> = all.lines().filter(every_tenth).collect();
    let done = surface_case(SURFACE, "", some.join("\n")).run();
    assert_eq!(done.table("predictions", "output").len(), 5 * 5);
    assert!((done.estimate("E1").estimate - TRUTH).abs() < 3.0 * done.estimate("E1").sd);
}

#[test]
fn the_bytes_do_not_depend_on_workers_or_on_a_resumed_run() {
    let case = surface_case(SURFACE, "[estimator]\npasses = 2\n", profiles(SD, 0.0));
    let one = case.run_on(&mut InProcess::new(1)).unwrap();
    let four = case.run_on(&mut InProcess::new(4)).unwrap();
    assert_eq!((bits(&one), &one.csv), (bits(&four), &four.csv));
    for successes in [0, 7, 40] {
        let path = case.fresh();
        let mut fleet = Mortal::new(successes);
        assert!(case.go(&path, &mut fleet).is_err());
        let resumed = case.go(&path, &mut InProcess::new(2)).unwrap();
        assert_eq!(one.csv, resumed.csv);
    }
}

#[test]
fn an_observer_corrects_by_the_displacement_that_reaches_the_surface() {
    let observer = "[observer]\nkind = \"sdf\"\ngain = 20.0\n";
    let run = |noise: f64, extra: &str| surface_case(SURFACE, extra, profiles(noise, 0.0)).run();
    // On noise-free data the estimate does not move with the gain: at the truth there is nothing to correct.
    let (with, without) = (run(0.0, observer), run(0.0, ""));
    let [with_e, without_e] = [&with, &without].map(|d| d.estimate("E1").estimate);
    assert!(
        (with_e / without_e - 1.0).abs() < 2e-3 && (with_e / TRUTH - 1.0).abs() < 2e-3,
        "{with_e} {without_e}"
    );
    // With noise it does what it does by displacements; chords as above.
    let surface = run(SD, observer);
    let column = Case::new(&format!("{}{observer}", study(COLUMN)), &[("flow.csv", columns(SD))]).run();
    let (s, c) = (surface.estimate("E1"), column.estimate("E1"));
    assert!((s.estimate - c.estimate).abs() < 0.05 * c.sd, "{} {} sd {}", s.estimate, c.estimate, c.sd);
    let off = |d: &Done| d.summary.observer.clone().unwrap();
    let ratio = |d: &Done| off(d).innovation_rms_with / off(d).innovation_rms_without;
    assert!((ratio(&surface) - ratio(&column)).abs() < 1e-2, "{} {}", ratio(&surface), ratio(&column));
}
