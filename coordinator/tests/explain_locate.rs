//! Where a misfit is: gaps of a known shape are found at their place, and noise of the expected size at none.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

mod study_kit;

use std::fmt::Write as _;

use starlings_coordinator::explain::Rows;
use starlings_coordinator::explain::locate::{Located, Track, View, locate, map_again};
use starlings_coordinator::study::Study;
use study_kit::{Case, csv, grid, normals};

/// Steps per record, and their spacing.
const N: usize = 500;
const DT: f64 = 0.01;

/// A study that measures one pressure in `n_record` records; a test chooses what is simulated.
fn study(n_record: usize, train: &str) -> Study {
    let mut text = "[study]\nname = \"gap\"\ntime_unit = \"s\"\n[model]\nkind = \"equations\"\n\
        outputs = [ { name = \"pressure\", unit = \"mmHg\", value = \"p\" } ]\n\
        [[model.states]]\nname = \"p\"\nunit = \"mmHg\"\ninitial = \"p0\"\nrate = \"0\"\n\
        [[parameters]]\nname = \"p0\"\nprior = { transform = \"linear\", mean = 0.0, sd = 1.0 }\n"
        .to_owned();
    for r in 0..n_record {
        write!(
            text,
            "[[records]]\nname = \"beat-{r}\"\nfile = \"data.csv\"\ntime = \"t\"\n\
             channels = [ {{ column = \"p\", output = \"pressure\", noise = 2.0 }} ]\n{train}\n"
        )
        .unwrap();
    }
    Case::new(&text, &[("data.csv", csv("t,p", &[&grid(N, DT), &[100.0; N]]))]).study()
}

/// A track with the same values in every record.
fn track(study: &Study, name: &str, unit: &str, of: impl Fn(f64) -> f64) -> Track {
    let values = study.records.iter().map(|r| r.times.iter().map(|t| of(*t)).collect()).collect();
    Track { name: name.to_owned(), unit: unit.to_owned(), values }
}

/// Inflow of a pulse per second: half a sine over 0.3 s, up to 200 mL/s.
fn flow(t: f64) -> f64 {
    let phase = t.fract();
    if phase < 0.3 { 200.0 * (std::f64::consts::PI * phase / 0.3).sin() } else { 0.0 }
}

/// Locates residuals: `shape` of time plus noise of sd 2.
fn located(study: &Study, tracks: &[Track], seed: u64, shape: impl Fn(f64) -> f64) -> Located {
    let rows = Rows::new(study);
    let noise = normals(rows.rows.len(), seed);
    let predicted: Vec<f64> =
        rows.rows.iter().zip(noise).map(|(row, e)| row.observed - shape(row.time) - 2.0 * e).collect();
    locate(&View { study, rows: &rows, predicted: &predicted, prediction_sd: None, tracks, seed })
}

#[test]
fn a_pressure_drop_in_proportion_to_flow_is_found_where_it_flows() {
    let study = study(1, "");
    let tracks = [
        track(&study, "flow", "mL/s", flow),
        track(&study, "volume", "mL", |t| (2.0 * t).sin()),
        track(&study, "pressure", "mmHg", |t| 80.0 + 20.0 * (6.0 * t + 1.0).cos()),
    ];
    let found = located(&study, &tracks, 1, |t| 0.08 * flow(t));
    let first = &found.places[0];
    assert!(first.region.starts_with("flow > "), "{first:?}");
    // Rounding is to 2 % of the range; within the noise the drop shows from about 2 mmHg, 25 mL/s, on.
    let at: f64 = first.region["flow > ".len()..].split(' ').next().unwrap().parse().unwrap();
    assert!((0.0..60.0).contains(&at), "{}", first.region);
    assert!(
        first.sentence.contains("mmHg rms against 2 expected; simulated too low by"),
        "{}",
        first.sentence
    );
    assert_eq!(found.correlations[0].with, "flow", "{:?}", found.correlations);
    assert!(found.correlations[0].coefficient > 0.9);
    let map = &found.maps[0];
    assert_eq!(map.x.0, "flow");
    // Variance of the drop against that of the noise: about 24 of 28.
    assert!(map.explained > 0.75, "{}", map.explained);
}

#[test]
fn dry_friction_goes_along_with_the_sign_of_the_velocity() {
    let study = study(1, "");
    let v = |t: f64| (-0.3 * t).exp() * (4.0 * t).sin();
    let tracks =
        [track(&study, "x", "m", |t| (-0.3 * t).exp() * (4.0 * t).cos()), track(&study, "v", "m/s", v)];
    let found = located(&study, &tracks, 2, |t| -8.0 * v(t).signum());
    assert_eq!(found.correlations[0].with, "sign of v", "{:?}", found.correlations);
    assert!(found.correlations[0].coefficient < -0.9);
    assert!(found.correlations[0].interval95[1] < 0.0);
    assert_eq!(found.maps[0].x.0, "v", "the map over v tells most");
}

#[test]
fn a_gap_from_some_time_on_is_found_at_that_time() {
    let study = study(1, "");
    let span = DT * N as f64;
    for (seed, t0) in [(3, 1.2), (4, 2.4), (5, 3.9)] {
        let tracks = [track(&study, "flow", "mL/s", flow)];
        let found = located(&study, &tracks, seed, |t| if t > t0 { 10.0 * (12.0 * t).sin() } else { 0.0 });
        let first = &found.places[0];
        // The swing starts at any value; 5 % of the record.
        assert!((first.from - t0).abs() < 0.05 * span, "{first:?} for {t0}");
        assert!(first.sentence.starts_with("pressure after t = "), "{}", first.sentence);
        assert_eq!(found.places.len(), 1, "{:?}", found.places);
    }
}

#[test]
fn a_gap_above_a_level_is_found_at_that_level() {
    let study = study(1, "");
    let level = |t: f64| 6.0 + 5.0 * (2.3 * t).sin();
    let tracks = [track(&study, "level", "V", level), track(&study, "flow", "mL/s", flow)];
    for rim in [7.0, 8.5, 9.0] {
        let found = located(&study, &tracks, 6, |t| -15.0 * (level(t) - rim).max(0.0));
        let first = &found.places[0];
        let at: f64 =
            first.region.strip_prefix("level > ").unwrap().split(' ').next().unwrap().parse().unwrap();
        // 5 % of the range of 10 V.
        assert!((at - rim).abs() < 0.5, "{} for {rim}", first.region);
        assert!(first.sentence.contains("simulated too high"), "{}", first.sentence);
    }
}

#[test]
fn a_gap_in_one_record_of_three_is_found_in_that_record() {
    let study = study(3, "");
    let rows = Rows::new(&study);
    let noise = normals(rows.rows.len(), 9);
    let gap = |record: usize, t: f64| if record == 1 && t > 2.0 { 9.0 * (7.0 * t).cos() } else { 0.0 };
    let predicted: Vec<f64> =
        rows.rows.iter().zip(noise).map(|(r, e)| r.observed - gap(r.record, r.time) - 2.0 * e).collect();
    let tracks = [track(&study, "flow", "mL/s", flow)];
    let view = View {
        study: &study,
        rows: &rows,
        predicted: &predicted,
        prediction_sd: None,
        tracks: &tracks,
        seed: 1,
    };
    let places = locate(&view).places;
    assert_eq!(places[0].region, "record beat-1", "{places:?}");
    assert!((places[0].from - 2.0).abs() < 0.25, "5 % of the span: {:?}", places[0]);
}

#[test]
fn an_even_gap_is_one_place_and_held_out_values_are_marked() {
    let study = study(1, "train = [0.0, 3.0]");
    let tracks = [track(&study, "flow", "mL/s", flow)];
    let found = located(&study, &tracks, 7, |_| 3.0);
    assert_eq!(found.places.len(), 2, "{:?}", found.places);
    assert!(found.places[0].sentence.starts_with("pressure: 3."), "{}", found.places[0].sentence);
    assert!(found.places[1].sentence.starts_with("pressure in the held-out span: 3."));
    assert!(found.places[0].to <= 3.0 && found.places[1].from > 3.0);
    assert_eq!(found.channels.len(), 2);
    assert_eq!((found.channels[0].usage.as_str(), found.channels[1].usage.as_str()), ("train", "held-out"));
    // A mean of 3 from 301 values of sd 2 is known to 0.12.
    assert!((found.channels[0].bias - 3.0).abs() < 0.4);
}

#[test]
fn noise_of_the_expected_size_is_no_place() {
    let study = study(2, "");
    let tracks = [
        track(&study, "flow", "mL/s", flow),
        track(&study, "x", "m", |t| (4.0 * t).cos()),
        track(&study, "v", "m/s", |t| (4.0 * t).sin()),
    ];
    let false_places =
        (0..20).filter(|seed| !located(&study, &tracks, *seed, |_| 0.0).places.is_empty()).count();
    assert!(false_places <= 1, "{false_places} of 20");
    let false_whiteness = (0..20)
        .filter(|seed| located(&study, &tracks, *seed, |_| 0.0).channels[0].whiteness_p < 1e-3)
        .count();
    assert_eq!(false_whiteness, 0, "expected once in 1000");
}

#[test]
fn uncertainty_of_the_fit_is_part_of_what_is_expected() {
    let study = study(1, "");
    let rows = Rows::new(&study);
    let predicted: Vec<f64> =
        rows.rows.iter().zip(normals(N, 4)).map(|(r, e)| r.observed - 20.0f64.sqrt() * e).collect();
    let view = |sd| View {
        study: &study,
        rows: &rows,
        predicted: &predicted,
        prediction_sd: sd,
        tracks: &[],
        seed: 1,
    };
    assert_eq!(locate(&view(None)).places.len(), 1);
    assert_eq!(locate(&view(Some(&[4.0; N]))).places, Vec::new());
}

#[test]
fn a_tone_in_the_residuals_is_the_peak_of_their_spectrum() {
    let study = study(1, "");
    let found = located(&study, &[], 8, |t| 3.0 * (std::f64::consts::TAU * 8.0 * t).sin());
    let spectrum = &found.spectra[0];
    // Frequencies are 0.4 Hz apart.
    assert!((spectrum.peak - 8.0).abs() < 0.41, "{}", spectrum.peak);
}

#[test]
fn the_same_bins_show_what_another_model_leaves() {
    let study = study(1, "");
    let rows = Rows::new(&study);
    let tracks = [track(&study, "flow", "mL/s", flow), track(&study, "x", "", |t| (3.0 * t).cos())];
    let noise = normals(N, 11);
    let run = |gain: f64| -> Vec<f64> {
        rows.rows.iter().zip(&noise).map(|(r, e)| r.observed - gain * flow(r.time) - 2.0 * e).collect()
    };
    let (before, after) = (run(0.1), run(0.0));
    let view = |predicted| View {
        study: &study,
        rows: &rows,
        predicted,
        prediction_sd: None,
        tracks: &tracks,
        seed: 1,
    };
    for map in locate(&view(&before)).maps {
        let same = map_again(&map, &view(&before));
        assert_eq!(same, map, "the same predictions give the same map");
        let again = map_again(&map, &view(&after));
        assert_eq!((&again.x_edges, &again.y_edges, &again.count), (&map.x_edges, &map.y_edges, &map.count));
        // Adjusted for the number of bins, the share that pure noise explains is zero with an sd of about sqrt(2·50)/500.
        assert!(again.explained < 0.08, "{}", again.explained);
    }
}

#[test]
fn everything_found_survives_json() {
    let study = study(1, "");
    let tracks = [track(&study, "flow", "mL/s", flow)];
    let found = located(&study, &tracks, 1, |t| 0.08 * flow(t));
    let text = serde_json::to_string(&found).unwrap();
    assert_eq!(serde_json::from_str::<Located>(&text).unwrap(), found);
}

#[test]
fn a_gap_that_comes_and_goes_is_found_in_eight_records_of_five_hundred_rows() {
    let study = study(8, "");
    let tracks: Vec<Track> = (0..8)
        .map(|k| track(&study, &format!("s{k}"), "", move |t| (f64::from(k + 1) * t + f64::from(k)).sin()))
        .collect();
    let found = located(&study, &tracks, 1, |t| 10.0 * (5.0 * t).sin().max(0.0));
    assert!(!found.places.is_empty());
    assert_eq!(found.channels.len(), 8, "one for every record");
}
