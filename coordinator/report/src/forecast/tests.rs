//! The page of a made-up forecast.

use starlings_estimators::forecast::{Direction, Fan};
use starlings_study::forecast::Forecast;
use starlings_study::forecast::measurement::{Errors, From};
use starlings_study::forecast::result::{Coverage, LevelForecast, OutputForecast};

use super::forecast_page;
use crate::tests::page::without_scripts;

fn forecast(times: Vec<f64>) -> Forecast {
    let grid = [0.0, 1.0, 2.0];
    let members: Vec<Vec<f64>> = (0..5).map(|k| grid.iter().map(|t| t * f64::from(k)).collect()).collect();
    let fan = Fan::of(&grid, &members, &Fan::USUAL).unwrap();
    let says =
        if times.is_empty() { "p > 3: not crossed by any of 5 members up to 2" } else { "p > 3: crossed" };
    let level = LevelForecast {
        output: "p".to_owned(),
        unit: "bar".to_owned(),
        direction: Direction::Above,
        value: 3.0,
        crossed: times.len(),
        never: 5 - times.len(),
        probability: times.len() as f64 / 5.0,
        horizon: Some(1.5),
        probability_by_horizon: Some(0.2),
        median: None,
        interval90: None,
        says: says.to_owned(),
        times,
    };
    let output = OutputForecast {
        output: "p".to_owned(),
        unit: "bar".to_owned(),
        at_end: [4.0, 0.0, 8.0],
        measured_at_end: Some([-1.125, 9.125]),
        errors: Some(Errors { noise: 0.5, sd: 1.25, from: From::Residuals }),
        coverage90: Some(Coverage {
            train: Some(0.9),
            held_out: None,
            held_out_by_fit: None,
            sd_by_fit: None,
        }),
        fan: fan.clone(),
        measured: Some(fan),
        observed: vec![(0.0, 0.1), (1.0, 2.2)],
    };
    Forecast {
        study: "motor <1>".to_owned(),
        model: "equations".to_owned(),
        record: "fire".to_owned(),
        time_unit: "s".to_owned(),
        from: 0.0,
        measured_until: 1.0,
        until: 2.0,
        members: 5,
        failed: 0,
        seed: 1,
        model_noise: false,
        wider_given_residuals: Some(2.5),
        conditional_on: "Bands are conditional on the model".to_owned(),
        set: vec![],
        warnings: vec!["inputs stay".to_owned()],
        outputs: vec![output],
        levels: vec![level],
    }
}

#[test]
fn a_forecast_shows_its_levels_its_fan_and_its_warnings() {
    let page = without_scripts(&forecast_page(&forecast(vec![1.0, 1.9])).unwrap());
    assert_eq!(page.matches("<svg").count(), 2, "the fan and the crossings");
    let bands =
        ["−1.125 to 9.125", "1.25 bar (its training residuals)", "Bands are conditional on the model"];
    for text in ["motor &lt;1&gt;", "p &gt; 3: crossed", "inputs stay", "0.200 by 1.5", "90\u{a0}%"]
        .into_iter()
        .chain(bands)
    {
        assert!(page.contains(text) || page.contains(&text.replace('\u{a0}', "&nbsp;")), "{text}");
    }
    assert!(
        !page.contains("NaN") && !page.contains("http://") || page.contains("http://www.w3.org"),
        "self-contained"
    );
}

#[test]
fn a_level_that_nothing_crosses_has_a_sentence_and_no_figure() {
    let page = without_scripts(&forecast_page(&forecast(vec![])).unwrap());
    assert_eq!(page.matches("<svg").count(), 1);
    assert!(page.contains("not crossed by any of 5 members up to 2"));
}
