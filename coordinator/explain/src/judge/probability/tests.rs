//! Probabilities sum to one, and a verdict is worth what it was counted to be.

use super::*;

#[test]
fn the_probabilities_sum_to_one_and_stand_as_the_weights() {
    let mut weights = Vec::new();
    for (name, weight) in [("drag", 40.0), ("friction", 37.0), ("drag", 38.0)] {
        add(&mut weights, vec![name.to_owned()], &[], weight);
    }
    let of = shared(weights, 0.9, 0.2);
    let sum: f64 = of.sets.iter().map(|set| set.probability).sum();
    // Three sums of exponentials.
    assert!((sum + of.nothing_missing + of.none_of_these - 1.0).abs() < 1e-12);
    let [drag, friction] = of.sets.as_slice() else { panic!("{of:?}") };
    assert_eq!((drag.names[0].as_str(), friction.names[0].as_str()), ("drag", "friction"));
    assert!((drag.probability / friction.probability - 3.0_f64.exp()).abs() < 1e-9);
    assert_eq!(
        of.lines(),
        [
            "86 %: drag",
            "4 %: friction",
            "10 %: none of these: something that was not tried",
            "20 % of the gap is left"
        ]
    );
}

#[test]
fn a_name_that_no_test_of_correlation_could_refuse_is_worth_no_more_than_the_prior() {
    let listed = |verdict, is_untested| {
        let of_verdict = odds(verdict, &[Kind::Library], is_untested) * UNLISTED / (1.0 - UNLISTED);
        1.0 / (1.0 + of_verdict)
    };
    for verdict in [Verdict::Named, Verdict::Tie] {
        assert!((listed(verdict, true) - (1.0 - UNLISTED)).abs() < 1e-12);
        assert!(listed(verdict, false) > listed(verdict, true));
    }
    assert!(listed(Verdict::Unexplained, true) < 0.2, "nothing was named");
}

#[test]
fn two_names_are_told_with_less_than_one_and_a_proposal_with_less_than_both() {
    let of = |verdict, kinds: &[Kind]| odds(verdict, kinds, false);
    let one = of(Verdict::Named, &[Kind::Generic]);
    let two = of(Verdict::Named, &[Kind::Library, Kind::Study]);
    let made = of(Verdict::Named, &[Kind::Proposal]);
    assert!(one < two && two < made, "{one} {two} {made}");
    let beside = of(Verdict::Tie, &[Kind::Library, Kind::Proposal]);
    assert!(beside.total_cmp(&made).is_eq() && of(Verdict::Tie, &[Kind::Library]) < beside);
    assert!(made < of(Verdict::Unexplained, &[Kind::Proposal]), "what was refused is no proposal");
}

#[test]
fn what_is_left_beyond_chance_is_in_no_list() {
    let left = |rmse_over_noise| Adequacy {
        n: 200,
        rmse_over_noise,
        whiteness: Some(0.4),
        inflation: 1.5,
        over_spread: 0.1,
        noise_freedom: 150.0,
    };
    assert!((still_listed(0.95, &left(1.25), 0.5) - 0.475).abs() < 1e-12, "half of the gap");
    assert!((still_listed(0.95, &left(1.1), 0.5) - 0.95).abs() < 1e-12, "as chance leaves it");
}

#[test]
fn without_any_set_nothing_is_missing_or_it_is_in_no_list() {
    let of = shared(Vec::new(), 0.2, 1.0);
    assert!((of.nothing_missing - 0.2).abs() < 1e-12 && (of.none_of_these - 0.8).abs() < 1e-12);
    let of = of.with_gap(true);
    assert!(of.nothing_missing.abs() < 1e-12 && (of.none_of_these - 1.0).abs() < 1e-12, "a gap is no chance");
    let of = of.with_noise(false).with_noise(true);
    assert!((of.nothing_missing - 0.5).abs() < 1e-12 && (of.none_of_these - 0.5).abs() < 1e-12);
}
