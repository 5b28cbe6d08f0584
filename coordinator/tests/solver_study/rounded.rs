//! A solver that prints few digits: the points are placed further apart, and the posterior is that of the solver that prints all.

use starlings_coordinator::study::identify::{At, identify};
use starlings_coordinator::study::trial::{Depth, dry_run};
use starlings_coordinator::study::{Study, Summary};

use crate::inside::{Inside, Place, no_host, threads};
use crate::swing::{native, recording, solver};

/// The study with a solver that rounds to so many digits after the point, or does not, after its trial.
fn tried(more: &str, decimals: Option<i32>) -> (Place, Study, Inside) {
    let data = recording(&[], &[], 7);
    let here = Place::new(&[("study.toml", &native(more)), ("swing.csv", &data)]);
    let there = Place::new(&[("study.toml", &solver(more)), ("swing.csv", &data)]);
    let inside = Inside::of(&here.load(&no_host()).unwrap(), &["v"]);
    let inside = decimals.map_or(inside.clone(), |n| inside.rounding(n));
    let mut study = there.load(&inside.solver_host()).unwrap();
    let kind = study.estimator.kind;
    dry_run(&mut study, kind, Depth::First).unwrap();
    (there, study, inside)
}

fn summary((place, study, inside): &(Place, Study, Inside)) -> Summary {
    place.run(study, &mut threads(inside), "run").unwrap()
}

/// Whether the estimates are the same to a fifth of their sd, and these to a tenth.
fn assert_near(got: &Summary, want: &Summary, what: &str) {
    for (p, q) in got.parameters.iter().zip(&want.parameters) {
        let (off, wide) = ((p.estimate - q.estimate) / q.sd, p.sd / q.sd);
        assert!(
            off.abs() < 0.2 && (wide - 1.0).abs() < 0.1,
            "{what}: {} off {off:.2} sd, {wide:.2} as wide",
            p.name
        );
    }
}

#[test]
fn points_are_further_apart_where_a_solver_rounds_and_the_posterior_is_that_of_all_digits() {
    for (more, usual) in [("", 1e-3), ("[estimator]\nkind = \"batch\"\n", 0.1)] {
        let exact = tried(more, None);
        assert!((exact.1.spread() - usual).abs() < 1e-12);
        let want = summary(&exact);
        // Of a noise of 0.02 and 0.04, 241 times.
        for decimals in [5, 4, 3] {
            let rounded = tried(more, Some(decimals));
            let told =
                rounded.1.warnings.iter().filter(|warning| warning.contains("the solver rounds")).count();
            assert_eq!(told, usize::from(rounded.1.spread() > usual), "{:?}", rounded.1.warnings);
            // What a run folder is held against is the study as it is written, tried or not.
            assert_eq!(rounded.1.estimator, exact.1.estimator);
            assert!(decimals > 3 || told == 1, "{more}");
            assert_near(&summary(&rounded), &want, &format!("{more} {decimals} decimals"));
        }
    }
}

#[test]
fn a_width_that_the_study_gives_is_kept_and_told_to_be_too_narrow() {
    let told = |more: &str, decimals| {
        let (_, study, _) = tried(more, Some(decimals));
        let told = study
            .warnings
            .iter()
            .find(|warning| warning.starts_with("the solver rounds `position`, `velocity` (to "));
        (study.spread(), told.cloned().unwrap_or_default())
    };
    let (spread, said) = told("[estimator]\nspread = 0.001\n", 3);
    assert!((spread - 0.001).abs() < 1e-12);
    assert!(
        said.contains("(to 0.001), and [estimator] spread = 0.001 places the points so close together"),
        "{said}"
    );
    let (spread, said) = told("[estimator]\nspread = 0.5\n", 3);
    assert!((spread - 0.5).abs() < 1e-12 && said.is_empty(), "{said}");
    // Half of the noise.
    let (_, said) = told("", 2);
    assert!(said.contains("which is coarse beside the noise: however far apart points are placed"), "{said}");
}

#[test]
fn points_that_are_too_close_make_intervals_too_narrow_which_is_what_the_distance_is_for() {
    let of = |more: &str, decimals| summary(&tried(more, decimals));
    let (want, got) = (of("", None), of("[estimator]\nspread = 0.001\n", Some(3)));
    let narrow =
        want.parameters.iter().zip(&got.parameters).map(|(want, got)| want.sd / got.sd).fold(0.0, f64::max);
    assert!(narrow > 7.0, "{narrow}");
}

#[test]
fn sensitivities_are_of_runs_that_rounding_does_not_drown() {
    let found = |decimals| {
        let (_, study, inside) = tried("", decimals);
        identify(&study, &mut threads(&inside), &At::Prior, &mut |_| {}).unwrap()
    };
    let (exact, rounded) = (found(None), found(Some(3)));
    assert!(
        (exact.spread - 1e-3).abs() < 1e-12 && (0.1..=0.3).contains(&rounded.spread),
        "{}",
        rounded.spread
    );
    let off = (&rounded.whitened - &exact.whitened).norm() / exact.whitened.norm();
    assert!(off < 0.05, "{off}");
}
