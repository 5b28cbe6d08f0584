//! The page and the table of an inference.

use starlings_infer::result::{
    CoefficientFound, Converging, DiffusionFound, HeldOut, Inference, JointScore, MissingFound, NamedTerm,
    RecordUsed, ReducedFound, ScoredTerm, UnknownFound,
};

use super::{coefficients_csv, infer_page};

fn coefficient(name: &str, estimate: Option<f64>, zero: bool) -> CoefficientFound {
    CoefficientFound {
        name: name.to_owned(),
        observed: estimate.is_some(),
        estimate,
        sd: estimate.map(|_| 0.25),
        interval90: estimate.map(|v| [v - 0.41, v + 0.41]),
        may_be_zero: estimate.map(|_| zero),
        at_step: None,
        prior: None,
    }
}

fn missing() -> MissingFound {
    MissingFound {
        candidates: 21,
        false_alarm: 0.01,
        named: vec![NamedTerm {
            name: "x:z".to_owned(),
            estimate: -1.0,
            sd: 0.02,
            interval90: [-1.03, -0.97],
            chi_squared: 2500.0,
            by_chance: 0.0,
            ties: vec!["x:w".to_owned()],
        }],
        strongest: vec![ScoredTerm { name: "x:u".to_owned(), chi_squared: 17.5, by_chance: 3e-5 }],
        left: Some(JointScore { terms: 20, chi_squared: 18.0, by_chance: 0.587 }),
        held_out: Some(HeldOut { records: vec!["later".to_owned()], n_step: 100, gain: 1234.5 }),
        coefficients: vec![coefficient("sigma", Some(10.5), false), coefficient("x:z", Some(-1.0), false)],
    }
}

fn sample() -> Inference {
    let values = |scale: f64| vec![Some([10.0, scale]), Some([0.1, scale]), None];
    let at = |n_block: u64| Converging {
        n_block,
        n_step: 100 * n_block,
        time: n_block as f64,
        values: values(1.0 / n_block as f64),
        diffusion: vec![1.0],
    };
    Inference {
        study: "lorenz".to_owned(),
        verdict: "400 steps give 2 of 3 coefficients".to_owned(),
        time_unit: "s".to_owned(),
        file: String::new(),
        records: vec![RecordUsed { name: "one".to_owned(), n_step: 400, span: [0.0, 4.0] }],
        step: 0.01,
        n_step: 400,
        block: 100,
        equations: vec!["x".to_owned()],
        coefficients: vec![
            coefficient("sigma", Some(10.0), false),
            coefficient("x:a,b", Some(0.1), true),
            coefficient("leak", None, false),
        ],
        covariance: Vec::new(),
        diffusion: DiffusionFound {
            degrees: None,
            form: "full".to_owned(),
            matrix: vec![vec![1600.0]],
            sd: vec![vec![36.0]],
            interval90: vec![Some([1540.0, 1660.0])],
            lag_corrected: false,
            measured_sd: None,
        },
        noise_checks: Vec::new(),
        noise_varies: Vec::new(),
        robust: false,
        richardson: None,
        reduced: Some(ReducedFound {
            unknowns: vec![UnknownFound {
                name: "k".to_owned(),
                estimate: 2.0,
                sd: 0.1,
                interval90: [1.8, 2.2],
            }],
            chi_squared: 11.5,
            degrees: 12,
            probability: 0.49,
            consistent: true,
        }),
        missing: Some(missing()),
        convergence: vec![at(1), at(2), at(4)],
        convergence_of: Some("estimates before smoothing".to_owned()),
        conditional_on: "90 % intervals".to_owned(),
        warnings: vec!["not observed: leak".to_owned()],
    }
}

#[test]
fn the_page_shows_the_verdict_the_table_and_the_convergence() {
    let page = infer_page(&sample()).expect("a page");
    for text in [
        "400 steps give 2 of 3 coefficients",
        "sigma",
        "may be zero",
        "not observed",
        "χ² 11.5 for 12",
        "<svg",
        "1600",
        "These are estimates before smoothing.",
        "Terms that the drift may lack",
        "x:w",
        "10.50",
        "3e-5",
        "χ² 18.0 together, by chance 0.587",
        "later) the log-likelihood is 1234.5 nats larger",
    ] {
        assert!(page.contains(text), "{text} is missing");
    }
    assert!(!crate::tests::page::without_scripts(&page).contains("NaN"), "what has no value is no number");
    assert_eq!(page.matches("<figcaption>").count(), 2, "the third coefficient has no estimate to draw");
}

#[test]
fn the_table_has_a_line_per_coefficient_and_entry_of_the_noise() {
    let csv = coefficients_csv(&sample());
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines[1], "sigma,10.0,0.25,9.59,10.41,false,true");
    assert_eq!(lines[2].split(',').next(), Some("\"x:a"), "a name with a comma is quoted");
    assert_eq!(lines[3], "leak,,,,,,false");
    assert_eq!(lines[4], "\"D[x,x]\",1600.0,36.0,1540.0,1660.0,,true");
}
