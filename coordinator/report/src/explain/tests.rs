//! Tests of the whole page. Next file to read: `tests/numbers.rs`, for what figures make of odd numbers.

mod numbers;

use starlings_explain::result::{Explanation, Nulls};
use starlings_explain::{Curve, Figures, Verdict};

use super::sample::{about, found};
use super::{StudyAbout, explain_page};
use crate::tests::page::{n_figure, without_scripts};

const VERDICTS: [Verdict; 4] = [Verdict::Named, Verdict::Tie, Verdict::Unexplained, Verdict::NoGap];
/// The order in which a reader meets the sections.
const SECTIONS: [&str; 14] = [
    "result",
    "warnings",
    "gap",
    "courses",
    "effect",
    "where",
    "candidates",
    "alarm",
    "shifts",
    "remaining",
    "runs",
    "untried",
    "conditional",
    "reproduce",
];

fn assert_well_formed(page: &str) {
    let places: Vec<usize> =
        SECTIONS.iter().map(|id| page.find(&format!("id=\"{id}\"")).expect(id)).collect();
    assert!(places.is_sorted(), "sections out of order: {places:?}");
    assert_eq!(page.matches("<script").count(), 1 + n_figure(page), "no text of a study opens a script");
    assert_eq!(page.matches("</script>").count(), 1 + n_figure(page));
    let page = &*without_scripts(page);
    let outside = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for forbidden in [
        "http://", "https://", "<link", "<img", "@import", "url(", "src=", "href=\"h", "NaN", "inf\"",
        ">inf", "None",
    ] {
        assert!(!outside.contains(forbidden), "the page contains {forbidden}");
    }
    assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count());
    assert_eq!(page.matches("<svg").count(), page.matches("role=\"img\" aria-label=").count());
    assert_eq!(n_figure(page), page.matches("<figcaption>").count());
}

fn page_of((explanation, figures): &(Explanation, Figures)) -> String {
    let page = explain_page(explanation, figures, &about()).unwrap();
    assert_well_formed(&page);
    // A slash in a text is written as its character reference.
    page.replace("&#x2f;", "/")
}

/// Writes what a person may want to look at when `REPORT_SAMPLE_DIR` names a folder.
fn show(name: &str, text: &str) {
    if let Some(folder) = std::env::var_os("REPORT_SAMPLE_DIR") {
        std::fs::write(std::path::Path::new(&folder).join(name), text).expect("the folder can be written");
    }
}

#[test]
fn the_correlation_of_the_noise_stands_beside_what_is_left() {
    let page = page_of(&found(Verdict::Named, 1, 40));
    assert!(page.contains("pressure over 0.021 s (97 % of its variance)"));
}

#[test]
fn every_verdict_has_its_banner_and_its_headline() {
    for (verdict, class) in VERDICTS.into_iter().zip(["named", "tie", "unexplained", "no-gap"]) {
        let sample = found(verdict, 1, 420);
        let page = page_of(&sample);
        show(&format!("explain-{class}.html"), &page);
        assert!(page.contains(&format!("class=\"verdict {class}\"")), "{class}");
        let headline = page.find(&sample.0.headline).expect("the headline");
        assert!(headline < page.find("id=\"warnings\"").unwrap(), "the headline comes first");
    }
}

#[test]
fn a_named_effect_is_told_with_its_equations_and_its_coefficient() {
    let page = page_of(&found(Verdict::Named, 2, 420));
    for text in [
        "The inlet pressure rises with the flow itself.",
        "pressure += Zc*flow",
        "d p/dt += -leak*p",
        "d wall/dt = -wall/tau",
        "<b>0.0943</b> <small>± 0.0022</small>",
        "0.0901 to 0.0987",
        "inertance, a gain of the flow meter.",
        "Westerhof, Lankhaar &amp; Westerhof (2009)",
        "<code>explained.toml</code>",
        "pressure where flow &gt; 50 mL/s: 14.7 mmHg rms against 2.0 expected",
        "the held-out RMSE grows from 9.1 to 9.8 mmHg",
        "absorbed by the parameters",
        "100 simulations of the fitted model with its noise.",
        "What remains is a ripple of 0.9 mmHg at 7 1/s.",
        "wall-viscosity",
        "<li>pressure (held out) at 2.46 times its noise, 2.21 times beyond the uncertainty of the estimate</li>",
        "it needs: a state with the role temperature",
        "Training RMSE 9.43 mmHg before, 2.11 mmHg after; held-out span RMSE 9.12 mmHg before, 2.34 mmHg after",
        "× 0.26",
        "Seed 1, version 0.1.0",
    ] {
        assert!(page.contains(text), "the page lacks {text}");
    }
    // C went from 1.91 to 1.248 with an sd of 0.02.
    assert!(page.contains("−33.1 sd"), "the shift in standard deviations");
    // Two curves with their residuals, two maps before and after, one spectrum, one input twice, one histogram.
    assert_eq!(n_figure(&page), 2 + 2 * 2 + 1 + 2 + 1);
}

#[test]
fn a_measured_rate_of_false_alarms_stands_with_its_bound() {
    let mut sample = found(Verdict::Named, 1, 60);
    assert!(!page_of(&sample).contains("Measured:"));
    let measured = Nulls { names: 1, of: 40, upper95: 0.129, runs: 9000 };
    sample.0.false_alarm.nulls = Some(measured.clone());
    let told = "Measured: 1 of 40 simulated recordings without a gap got a name";
    assert!(page_of(&sample).contains(&format!("{told} (at most 12.9 % with 95\u{a0}% confidence).")));
    sample.0.false_alarm.nulls = Some(Nulls { upper95: f64::NAN, ..measured });
    assert!(page_of(&sample).contains(&format!("{told} (at most – with 95\u{a0}% confidence).")));
}

#[test]
fn a_tie_lists_its_class_and_the_experiment_that_would_decide() {
    let page = page_of(&found(Verdict::Tie, 1, 60));
    for text in [
        "source-gain + leak",
        "Double the stroke volume",
        "a difference in χ² of 412 at most",
        "data at hand give 3.1",
    ] {
        assert!(page.contains(text), "the page lacks {text}");
    }
    assert!(!page_of(&found(Verdict::Named, 1, 60)).contains("Cannot be told apart"));
}

#[test]
fn where_nothing_was_added_there_is_no_after() {
    let unexplained = page_of(&found(Verdict::Unexplained, 1, 60));
    assert!(unexplained.contains("What came nearest") && unexplained.contains("there is no after"));
    let no_gap = page_of(&found(Verdict::NoGap, 1, 60));
    assert!(no_gap.contains("nothing is missing that these data could show"));
    for page in [unexplained, no_gap] {
        assert!(!page.contains("after: with the effect"));
        // The errors of the model as it is stand in the table.
        assert!(page.contains("9.43"));
    }
}

#[test]
fn an_explanation_of_nothing_says_what_is_missing() {
    let mut empty = found(Verdict::Unexplained, 0, 0);
    empty.1 = Figures::default();
    let e = &mut empty.0;
    (e.closest, e.screened, e.rejected) = (Vec::new(), Vec::new(), Vec::new());
    (e.places, e.warnings, e.untried) = (Vec::new(), Vec::new(), Vec::new());
    let page = explain_page(&empty.0, &empty.1, &StudyAbout::default()).unwrap();
    assert_well_formed(&page);
    for text in [
        "No curves were stored",
        "No errors were stored",
        "No effect is named",
        "No place is surely worse than its noise",
        "No candidate was screened",
        "No simulation without a gap was stored",
        "The budget left no candidate out",
    ] {
        assert!(page.contains(text), "the page lacks {text}");
    }
}

#[test]
fn eight_records_of_eight_hundred_times_and_three_channels_stay_below_three_megabytes() {
    let mut sample = found(Verdict::Named, 8, 800);
    let curves = sample.1.curves.clone();
    let named = |name: &str| -> Vec<Curve> {
        curves.iter().map(|c| Curve { channel: name.into(), ..c.clone() }).collect()
    };
    sample.1.curves.extend(["inlet", "outlet"].into_iter().flat_map(named));
    let page = page_of(&sample);
    show("explain-large.html", &page);
    assert_eq!(page.matches(": measured and simulated</strong>").count(), 24);
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
}

#[test]
fn of_a_field_three_components_are_drawn_and_the_others_are_counted() {
    let mut sample = found(Verdict::Named, 1, 60);
    let component = |k: usize| Curve { channel: format!("wall[{k}]"), ..sample.1.curves[0].clone() };
    sample.1.curves = (0..30).map(component).collect();
    let page = page_of(&sample);
    for shown in ["wall[0], record", "wall[15], record", "wall[29], record", "27 curves more"] {
        assert!(page.contains(shown), "the page lacks {shown}");
    }
}

#[test]
fn a_channel_that_was_never_fitted_is_marked_as_held_out() {
    let mut sample = found(Verdict::Named, 1, 60);
    sample.1.curves[0].held_out = true;
    sample.0.gap.iter_mut().for_each(|row| row.usage = "held-out-channel".into());
    let page = page_of(&sample);
    assert!(page.contains("Held-out channel RMSE") && page.contains(">held out</span>"));
    assert!(!page.contains("training span</span>"));
}

#[test]
fn names_from_the_study_cannot_become_markup() {
    let attack = "<script>alert('x')</script>\"&";
    let mut sample = found(Verdict::Tie, 1, 60);
    let (e, f) = (&mut sample.0, &mut sample.1);
    (e.study, e.headline, e.effects[0].says) = (attack.into(), attack.into(), attack.into());
    e.effects[0].adds[0] = (attack.into(), attack.into());
    (e.rejected[0].reason, e.places[0].sentence) = (attack.into(), attack.into());
    (e.screened[0].name, e.parameter_shifts[0].name) = (attack.into(), attack.into());
    (f.curves[0].channel, f.before.maps[0].x.0) = (attack.into(), attack.into());
    (f.before.correlations[0].with, f.before.forces[0].state) = (attack.into(), attack.into());
    let page = page_of(&sample);
    assert!(page.contains("&lt;script&gt;"));
}
