//! Figures and sentences agree.

use super::*;

fn figures() -> Vec<Adequacy> {
    let mut all = Vec::new();
    for n in [0, 1, 2, 3, 19, 20, 60, 1000] {
        for rmse_over_noise in [0.0, 1e-9, 0.008, 0.3, 0.69, 0.8, 1.0, 1.2, 1.24, 2.5, 4.6, 547.0, 1e12] {
            // Fewer than twenty values are not tested.
            for whiteness in [None, Some(0.0), Some(9e-4), Some(1.1e-3), Some(0.5), Some(1.0)]
                .into_iter()
                .filter(|p| n >= 20 || p.is_none())
            {
                for inflation in [1.0, 3.3, 200.0] {
                    for over_spread in [1e-9, 1e-3, 0.5, f64::INFINITY] {
                        for noise_freedom in [5.0, f64::INFINITY] {
                            all.push(Adequacy {
                                n,
                                rmse_over_noise,
                                whiteness,
                                inflation,
                                over_spread,
                                noise_freedom,
                            });
                        }
                    }
                }
            }
        }
    }
    all
}

#[test]
fn no_sentence_contradicts_the_figures_that_it_stands_beside() {
    for a in figures() {
        let text = a.says();
        let (tested, square) = (a.whiteness.is_some(), a.rmse_over_noise.powi(2));
        if text.contains("could be noise") {
            let (lo, hi) = a.band(LEVEL);
            assert!(tested && square >= lo.min(0.5) && square <= hi.max(1.5), "{text}: {a:?}");
        }
        if text.contains("correlated in time") && !text.contains("whether they are") {
            assert!(a.whiteness.is_some_and(|p| p < NOT_WHITE), "{text}: {a:?}");
        }
        assert_eq!(
            text.contains("no sign of correlation"),
            !a.is_numerical() && a.n > 0 && tested && a.whiteness >= Some(NOT_WHITE),
            "{text}: {a:?}"
        );
        if text.contains("the noise is larger than stated") {
            assert!(square > 1.5, "{text}: {a:?}");
        }
        if text.contains("the noise is smaller than stated") {
            assert!(square < 0.5, "{text}: {a:?}");
        }
        if text.contains("error of integration") {
            assert!(a.over_spread < 1e-6 && square > 1.0, "{text}: {a:?}");
        }
        assert_eq!(text.contains("do not vary"), a.n > 1 && a.over_spread.is_infinite(), "{text}: {a:?}");
        assert_eq!(
            text.contains(&format!("{} the stated noise", times(a.rmse_over_noise))),
            a.n > 0,
            "{text}: {a:?}"
        );
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    }
}

#[test]
fn one_sample_is_not_called_correlated_and_two_and_a_half_times_the_noise_not_noise() {
    let one = Adequacy {
        n: 1,
        rmse_over_noise: 0.4,
        whiteness: None,
        inflation: 1.0,
        over_spread: f64::INFINITY,
        noise_freedom: f64::INFINITY,
    };
    assert_eq!(one.nature(), Nature::Noise);
    assert!(one.says().contains("too few in a row"), "{}", one.says());
    let far = Adequacy {
        n: 60,
        rmse_over_noise: 2.5,
        whiteness: Some(0.6),
        inflation: 6.2,
        over_spread: 0.1,
        ..one
    };
    assert_eq!(far.nature(), Nature::Larger);
    // A noise found from 28 samples: five degrees of freedom.
    let found = Adequacy { noise_freedom: 5.0, ..far };
    assert_eq!(found.nature(), Nature::Noise, "so uncertain a noise may be two and a half times as large");
    assert_eq!(Adequacy { noise_freedom: 500.0, ..far }.nature(), Nature::Larger);
    let of_200 = |rmse_over_noise| Adequacy { n: 200, noise_freedom: 150.0, rmse_over_noise, ..far };
    assert!(of_200(1.2).nature() == Nature::Noise && of_200(1.2).may_hide_a_gap());
    assert!(!of_200(1.1).may_hide_a_gap(), "one in ten by chance");
    assert_eq!(
        far.says(),
        "the residuals are 2.50 times the stated noise, with no sign of correlation in time: the noise is larger than stated, or \
         what is missing changes from sample to sample"
    );
    let hidden = Adequacy { rmse_over_noise: 0.008, whiteness: Some(0.0), inflation: 1.0, ..far };
    assert_eq!(hidden.nature(), Nature::Hidden);
    let alternating = |rmse_over_noise, inflation| Adequacy { rmse_over_noise, inflation, ..hidden }.nature();
    assert_eq!(alternating(0.95, 1.0), Nature::Hidden, "neighbours alternate, and the noise covers it");
    assert_eq!(alternating(1.01, 1.0), Nature::Correlated, "more than the noise");
    assert_eq!(alternating(0.95, 1.1), Nature::Correlated, "a memory");
    assert!(!hidden.is_gap() && hidden.says().contains("would hide as much"), "{}", hidden.says());
}
