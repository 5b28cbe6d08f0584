//! Tests of the whole page and of the overview picture. Next file to read: [`extremes`], for numbers that no study gives.

mod extremes;
mod left_out;
pub(crate) mod page;

use starlings_study::constants::{ConstantEffect, Follows, HangsOn};

use super::data::{ChannelPlot, Family, ObserverPlot, ObserverRow, ParameterRow, ReportData};
use super::{overview_svg, render, sample};
use page::{n_figure, without_scripts};

/// The order in which a reader meets the sections.
const SECTIONS: [&str; 11] = [
    "result",
    "warnings",
    "parameters",
    "fit",
    "residuals",
    "tracks",
    "nis",
    "correlation",
    "fleet",
    "conditional",
    "reproduce",
];

fn assert_well_formed(page: &str) {
    // One script for all figures, and the numbers of each; nothing else opens one or closes it.
    let n_script = 1 + n_figure(page);
    assert_eq!(page.matches("<script").count(), n_script);
    assert_eq!(page.matches("</script>").count(), n_script);
    let page = &*without_scripts(page);
    let places: Vec<usize> =
        SECTIONS.iter().map(|id| page.find(&format!("id=\"{id}\"")).expect(id)).collect();
    assert!(places.is_sorted(), "sections out of order: {places:?}");
    let outside = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for forbidden in
        ["http://", "https://", "<link", "@import", "url(", "NaN", "inf\"", ">inf", "None", "none stored"]
    {
        assert!(!outside.contains(forbidden), "the page contains {forbidden}");
    }
    assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count());
    assert_eq!(page.matches("<svg").count(), page.matches("role=\"img\" aria-label=").count());
}

/// The page without the names of columns in the cells of its tables.
fn without_labels(page: &str) -> String {
    let mut parts = page.split(" data-label=\"");
    let mut text = parts.next().unwrap_or_default().to_owned();
    parts.for_each(|part| text += part.split_once('"').map_or("", |(_, rest)| rest));
    text
}

/// Writes what a person may want to look at when `REPORT_SAMPLE_DIR` names a folder.
fn show(name: &str, text: &str) {
    if let Some(folder) = std::env::var_os("REPORT_SAMPLE_DIR") {
        std::fs::write(std::path::Path::new(&folder).join(name), text).expect("the folder can be written");
    }
}

#[test]
fn a_full_report_is_self_contained_and_in_order() {
    let page = render(&sample::run(840)).unwrap();
    show("report.html", &page);
    assert_well_formed(&page);
    for text in
        ["3.367", "3.326 to 3.409", "Training RMSE 4.43 mmHg", "held-out RMSE 4.11 mmHg", "Seed 1", "−0.31"]
    {
        assert!(page.contains(text), "the page lacks {text}");
    }
    // A figure of the fit with its residuals, their autocorrelation, three tracks, the pairs, NIS and run times.
    assert_eq!(n_figure(&page), 1 + 1 + 3 + 1 + 1 + 1);
    assert!(page.find("NIS is 5.1").unwrap() < page.find("id=\"parameters\"").unwrap());
}

#[test]
fn a_report_of_nothing_says_what_is_missing() {
    let page = render(&ReportData::default()).unwrap();
    show("empty.html", &page);
    assert_well_formed(&page);
    for text in ["no estimate yet", "No prediction was stored", "No innovations were stored", "No warnings."]
    {
        assert!(page.contains(text), "the page lacks {text}");
    }
    assert!(overview_svg(&ReportData::default()).contains("no prediction stored"));
}

#[test]
fn the_bands_of_a_prediction_say_what_they_hold() {
    let known = render(&sample::run(300)).unwrap();
    assert!(known.contains("prediction ± 2 sd of parameters (dark), and of parameters and noise"), "{known}");
    let mut data = sample::run(300);
    data.channels[0].spread.clear();
    let unknown = render(&data).unwrap();
    assert!(unknown.contains("prediction ± 2 noise sd") && unknown.contains("which is not known here"));
    // One band more on each side of the end of the training span.
    let bands = |page: &str| page.matches("fill-opacity=\"0.28\"").count();
    assert!(bands(&known) > 0 && bands(&unknown) == 0, "{} {}", bands(&known), bands(&unknown));
}

#[test]
fn a_record_that_was_never_fitted_is_marked_as_held_out() {
    let mut data = sample::run(60);
    let held_out =
        ChannelPlot { record: "in-vivo-2".into(), train: None, train_rmse: None, ..data.channels[0].clone() };
    data.channels = vec![held_out];
    data.autocorrelation.clear();
    data.x_label = "iteration".into();
    let page = render(&data).unwrap();
    show("held-out.html", &page);
    assert_well_formed(&page);
    assert!(page.contains("</i>held out</span>") && page.contains("Held-out RMSE 4.11 mmHg"));
    assert!(!page.contains("</i>fitted</span>") && !page.contains("Training RMSE"));
}

#[test]
fn many_records_and_parameters_keep_the_page_readable() {
    let mut data = sample::run(840);
    let record = |k: usize| format!("in-vivo-{k}");
    let channel = data.channels[0].clone();
    data.channels = (1..=4).map(|k| ChannelPlot { record: record(k), ..channel.clone() }).collect();
    let row = data.parameters[0].clone();
    data.parameters = (1..=12)
        .map(|k| ParameterRow { name: format!("initial:pressure@{}", record(k)), ..row.clone() })
        .collect();
    data.correlation = (0..12)
        .map(|i| (0..12).map(|j| if i == j { 1.0 } else { 0.09 * f64::from(i - j) }).collect())
        .collect();
    let page = render(&data).unwrap();
    show("many.html", &page);
    show("many.svg", &overview_svg(&data));
    assert_well_formed(&page);
    assert_eq!(page.matches(": predicted against measured</strong>").count(), 4);
    assert!(overview_svg(&data).contains("7 more"));
}

/// Twenty-five components with a residual that grows along the field and changes its sign halfway through time.
fn field(n: usize) -> ReportData {
    let mut data = sample::run(n);
    let one = data.channels[0].clone();
    let component = |i: usize| {
        let residual = |t: f64| 0.2 * i as f64 * if t < 2.0 { 1.0 } else { -1.0 };
        let observed = one.time.iter().zip(&one.predicted).map(|(t, p)| Some(p + residual(*t))).collect();
        ChannelPlot { channel: format!("wall[{i}]"), observed, ..one.clone() }
    };
    data.channels.splice(0..0, (0..25).map(component));
    data
}

#[test]
fn a_field_is_shown_by_three_components_and_one_map() {
    let page = render(&field(840)).unwrap();
    show("field.html", &page);
    assert_well_formed(&page);
    let fits: Vec<usize> = (0..25)
        .filter(|i| page.contains(&format!("<strong>wall[{i}], record in-vivo-1: predicted")))
        .collect();
    assert_eq!(fits, [0, 12, 24]);
    assert_eq!(page.matches("<strong>wall, record in-vivo-1: residuals by component").count(), 1);
    // The largest mean is 0.2 · 24 over a noise of 2.
    assert!(page.contains("the fullest colour is ± 2.4"), "the scale of the map");
    // Four figures more: three fits with the numbers of their curves, and the map of 25 rows with two runs of one shade each.
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
}

#[test]
fn numbered_stiffnesses_are_drawn_along_the_vessel() {
    let mut data = sample::run(60);
    let row = data.parameters[0].clone();
    let region = |k: u32| ParameterRow {
        name: format!("E{k}"),
        estimate: f64::from(k),
        unit: "kPa".into(),
        ..row.clone()
    };
    data.parameters = (1..=4).map(region).collect();
    let members = (1..=4).zip(0..).collect();
    data.families = vec![Family { stem: "E".into(), members, stiffness: true }];
    let page = render(&data).unwrap();
    show("along.html", &page);
    assert_well_formed(&page);
    assert!(page.contains("<strong>E1 to E4 along the vessel</strong>"));
    assert!(
        page.contains("Lowest: E1") && page.contains("Highest: E4") && page.contains("4.00 times as much")
    );
    data.families[0].stiffness = false;
    assert!(render(&data).unwrap().contains("<strong>E1 to E4</strong>"));
}

#[test]
fn the_observer_is_told_in_a_sentence_and_a_figure() {
    let mut data = sample::run(60);
    assert!(!render(&data).unwrap().contains("id=\"observer\""));
    let time: Vec<f64> = (0..40).map(f64::from).collect();
    let course =
        ObserverPlot { record: "in-vivo-1".into(), with: vec![1.0; 40], without: time.clone(), time };
    let (kind, courses) = ("dvf".to_owned(), vec![course]);
    data.observer = Some(ObserverRow { kind, gain: 20.0, with: 1.04, without: 5.5, courses });
    let page = render(&data).unwrap();
    show("observer.html", &page);
    assert_well_formed(&page);
    assert!(page.contains("With the observer dvf at a gain of 20.0"));
    assert!(page.contains("by 1.04 noise sd") && page.contains("by 5.50"));
    assert!(page.contains("Record in-vivo-1: innovations with and without the observer dvf"));
}

#[test]
fn a_constant_that_the_answer_hangs_on_is_told_in_a_sentence_and_a_table() {
    let mut data = sample::run(60);
    assert!(!render(&data).unwrap().contains("id=\"constants\""));
    let moves = [("R", -4.21), ("C", 0.52), ("Zc", 0.01)];
    let moves = moves.map(|(name, sd_per_percent)| Follows { parameter: name.to_owned(), sd_per_percent });
    let constant = ConstantEffect { constant: "L".to_owned(), value: Some(0.004), moves: moves.into() };
    data.hangs_on =
        Some(HangsOn { constants: vec![constant], not_tried: vec!["p_venous".to_owned()], runs: 7 });
    let page = render(&data).unwrap();
    assert_well_formed(&page);
    assert!(page.contains("R moves by 4.2 posterior sd when L is 1 % off."));
    assert!(
        without_labels(&page).contains("<td>R</td><td class=\"number\">−4.21</td><td>C 0.52</td>"),
        "{page}"
    );
    assert!(
        page.contains(
            "Not moved, because they are zero or the model refuses: p_venous. 7 runs of the model."
        )
    );
}

#[test]
fn names_from_the_study_cannot_become_markup() {
    let attack = "<script>alert('x')</script>\"&";
    let mut data = sample::run(50);
    data.study = attack.into();
    data.warnings = vec![attack.into()];
    data.parameters[0].name = attack.into();
    data.tracks[0].name = attack.into();
    data.channels[0].record = attack.into();
    data.channels[0].unit = attack.into();
    data.fleet.workers[0].name = attack.into();
    data.command = attack.into();
    let page = render(&data).unwrap();
    assert!(!without_scripts(&page).contains("<script") && !page.contains("<script>alert"));
    assert_eq!(page.matches("<script").count(), 1 + n_figure(&page));
    assert!(page.contains("&lt;script&gt;"));
    assert!(!overview_svg(&data).contains("<script"));
}

#[test]
fn the_overview_shows_fit_and_intervals_in_one_picture() {
    let picture = overview_svg(&sample::run(840));
    show("overview.svg", &picture);
    assert!(picture.starts_with(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"900\" height=\"420\" viewBox=\"0 0 900 420\""
    ));
    assert!(picture.trim_end().ends_with("</svg>"));
    for text in ["pressure [mmHg]", "R [mmHg s/mL]", "3.367 ± 0.042", "held out"] {
        assert!(picture.contains(text), "the picture lacks {text}");
    }
}

#[test]
fn the_data_survive_being_stored_as_json() {
    let data = sample::run(60);
    let text = serde_json::to_string(&data).unwrap();
    assert!(serde_json::from_str::<ReportData>(&text).unwrap() == data);
}
