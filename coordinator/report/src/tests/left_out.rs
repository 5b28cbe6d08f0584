//! What a page does not draw is counted on it.

use starlings_study::predicted::{Figure, PredictedCourse, PredictedOutput};

use crate::data::{Autocorrelation, ChannelPlot};
use crate::{render, sample};

#[test]
fn outputs_that_are_not_drawn_are_counted_where_others_are() {
    let mut data = sample::run(60);
    let channel = data.channels[0].clone();
    data.channels = (1..=30).map(|k| ChannelPlot { record: format!("r-{k}"), ..channel.clone() }).collect();
    let series = data.autocorrelation[0].clone();
    data.autocorrelation =
        (1..=30).map(|k| Autocorrelation { record: format!("r-{k}"), ..series.clone() }).collect();
    let course = PredictedCourse {
        record: "r-1".to_owned(),
        output: String::new(),
        unit: String::new(),
        time: vec![0.0, 1.0],
        median: vec![1.0, 2.0],
        lo: vec![0.5, 1.5],
        hi: vec![1.5, 2.5],
    };
    data.predicted =
        (1..=30).map(|k| PredictedCourse { output: format!("q{k}"), ..course.clone() }).collect();
    let number = Figure { estimate: 1.5, interval95: [1.0, 2.0] };
    data.predictions = vec![PredictedOutput {
        record: "r-1".to_owned(),
        output: "q1".to_owned(),
        unit: String::new(),
        mean: number,
        lowest: number,
        highest: number,
    }];
    let page = render(&data).unwrap();
    assert!(page.contains("6 more are in run.db."), "30 fits, of which 24 are drawn");
    assert!(page.contains("6 courses more are in predicted.csv."));
    assert!(page.contains("Residuals of 6 outputs and records more are in run.db."));
}
