//! Comparisons of made-up runs: what is said of them, and their page.

use super::*;
use crate::tests::page::{n_figure, without_scripts};

fn estimate(name: &str, value: f64, sd: f64) -> Estimate {
    Estimate {
        name: name.to_owned(),
        unit: "kPa".to_owned(),
        estimate: value,
        sd,
        interval95: [value - 2.0 * sd, value + 2.0 * sd],
        sd_given_residuals: None,
        interval95_given_residuals: None,
        prior_median: 1.0,
        prior_interval95: [0.1, 10.0],
    }
}

fn run(folder: &str, parameters: &[Estimate], log_likelihood: f64, observed: f64) -> Read {
    let fit = |name: &str| ChannelFit {
        name: name.to_owned(),
        noise: 2.0,
        train_rmse: Some(2.1),
        held_out_rmse: None,
    };
    let text = serde_json::json!({
        "study": "s", "model": "m", "estimator": "roukf", "seed": 1, "parameters": parameters, "correlation": [],
        "fit": { "channels": [fit("p")], "records": [], "nis_per_observation": 1.0, "log_likelihood": log_likelihood },
        "runs": { "total": 10, "failed": 0, "retried": 0, "rescued": 0 }, "workers": 1, "wall_s": 2.0, "warnings": [],
        "conditional_on": ""
    });
    let compared = Compared {
        folder: folder.to_owned(),
        study: "<script>alert(1)</script>".to_owned(),
        model: "m".to_owned(),
        finished: true,
        state: "finished".to_owned(),
        version: "1".to_owned(),
        runs: Some(10),
        wall_s: Some(2.0),
        warnings: Vec::new(),
    };
    let fitted = vec![("r".to_owned(), "p".to_owned(), 0, Some(observed.to_bits()), 2.0_f64.to_bits())];
    Read { compared, study: String::new(), summary: serde_json::from_value(text).expect("a summary"), fitted }
}

fn comparison(all: Vec<Read>) -> Comparison {
    Comparison {
        settings: Vec::new(),
        parameters: parameters(&all),
        errors: errors(&all),
        evidence: evidence(&all),
        runs: all.into_iter().map(|run| run.compared).collect(),
    }
}

#[test]
fn parameters_are_set_side_by_side_by_name_and_their_distance_is_in_sd_of_the_difference() {
    let one = run("runs/one", &[estimate("R", 1.0, 0.3), estimate("C", 5.0, 1.0)], -10.0, 7.0);
    let two = run("runs/two", &[estimate("R", 3.5, 0.4)], -12.0, 7.0);
    let found = comparison(vec![one, two]);
    // |1 − 3.5| over the root of 0.3² + 0.4² = 0.5; exact but for the root's last bit.
    assert!((found.parameters[0].apart.expect("two values") - 5.0).abs() < 1e-12);
    assert_eq!(found.parameters[1].values[1], None);
    assert_eq!(found.parameters[1].apart, None, "one value has no distance");
    assert_eq!(found.evidence.below_best, Some(vec![0.0, -2.0]));
    let says = found.verdict();
    assert_eq!(
        says,
        "1 of 1 shared parameters differ by more than two standard deviations of their difference. The evidence is \
                      largest for one, by 2.0 in its logarithm."
    );
}

#[test]
fn values_in_different_units_stand_under_both_and_have_no_distance() {
    let other = Estimate { unit: "mmHg".to_owned(), ..estimate("R", 7.5, 0.3) };
    let all = [estimate("R", 1.0, 0.3), other].map(|e| run("runs/one", &[e], -10.0, 7.0));
    let found = comparison(all.into());
    assert_eq!((found.parameters[0].unit.as_str(), found.parameters[0].apart), ("kPa, mmHg", None));
}

#[test]
fn evidence_of_other_data_is_not_compared() {
    let of = |observed| run("runs/same", &[estimate("R", 1.0, 0.3)], -10.0, observed);
    let found = comparison(vec![of(7.0), of(7.5)]);
    assert_eq!(found.evidence.below_best, None);
    assert!(found.evidence.says.contains("not fitted to the same values"), "{}", found.evidence.says);
    assert_eq!(found.labels(), ["runs/same", "runs/same"], "folders of one name go by their paths");
}

#[test]
fn the_page_has_a_figure_per_parameter_and_no_markup_from_a_study() {
    let one = run("runs/one", &[estimate("R", 1.0, 0.3), estimate("C", 5.0, 1.0)], -10.0, 7.0);
    let mut two = run("runs/two", &[], -12.0, 7.0);
    two.summary = None;
    two.compared.state = "not finished: --resume goes on".to_owned();
    let page = compare_page(&comparison(vec![one, two])).expect("a page");
    assert_eq!(n_figure(&page), 2);
    let read = without_scripts(&page);
    assert!(!read.contains("<script") && read.contains("&lt;script&gt;"));
    assert!(read.contains("not finished") && !read.contains("NaN"));
}

#[test]
fn a_run_that_is_not_finished_is_named_where_nothing_can_be_compared() {
    let [one, mut two] =
        ["runs/one", "runs/two"].map(|name| run(name, &[estimate("R", 1.0, 0.3)], -10.0, 7.0));
    (two.compared.finished, two.summary) = (false, None);
    assert_eq!(
        comparison(vec![one, two]).verdict(),
        "Not finished, and so without estimates to compare: two."
    );
}
