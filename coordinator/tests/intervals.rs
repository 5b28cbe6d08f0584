//! How often the 95 % intervals hold the truth: at the stated noise and given the residuals, with white and correlated errors.
//!
//! `just intervals` makes the table of docs/intervals.md; `INTERVALS_TWINS` sets the number of twins of a row.
#![allow(clippy::unwrap_used, clippy::print_stdout)] // the figures, with --nocapture
mod intervals_kit;
mod study_kit;

use intervals_kit::{Errors, Shares, System, coverage};

const BATCH: &str = "kind = \"batch\"";
const FILTER: &str = "kind = \"roukf\"";
const NONE: &str = "";

/// Twins of a row of the table.
fn twins() -> u64 {
    std::env::var("INTERVALS_TWINS").ok().and_then(|n| n.parse().ok()).unwrap_or(200)
}

#[test]
fn correlated_errors_leave_the_interval_given_the_residuals_that_holds_the_truth() {
    let system = System::Windkessel { n: 100 };
    let shares = coverage(system, BATCH, NONE, &Errors::Correlated(0.9), 40);
    // 160 intervals: the standard error of .95 is .017, and of .4 is .04.
    assert!(shares.stated < 0.6 && shares.given >= 0.88, "{shares:?}");
}

#[test]
fn white_errors_of_the_stated_size_leave_both_intervals_alike() {
    let shares = coverage(System::Oscillator { n: 100 }, FILTER, NONE, &Errors::White, 40);
    // 120 intervals: the standard error of .95 is .02.
    assert!(shares.stated >= 0.90 && shares.given >= shares.stated, "{shares:?}");
    assert!(shares.wider < 1.25, "{shares:?}");
}

/// The rows of the table that are held to a bound, and the bound.
fn assert_row(system: System, errors: &Errors, shares: &Shares) {
    let within = match errors {
        Errors::White => (0.92..=0.97).contains(&shares.stated) && (0.92..=0.97).contains(&shares.given),
        _ => shares.given >= 0.88,
    };
    assert!(within, "{} {errors:?}: {shares:?}", system.name());
}

#[test]
#[ignore = "minutes; `just intervals`"]
fn the_table_of_coverages() {
    println!("| model | samples | estimator | errors | stated noise | given the residuals | wider by |");
    println!("|---|---|---|---|---|---|---|");
    let systems = [
        System::Windkessel { n: 100 },
        System::Windkessel { n: 400 },
        System::Oscillator { n: 100 },
        System::Oscillator { n: 400 },
    ];
    let errors = [
        Errors::White,
        Errors::Correlated(0.5),
        Errors::Correlated(0.8),
        Errors::Correlated(0.9),
        Errors::Correlated(0.95),
        Errors::Correlated(0.98),
        Errors::Smooth,
    ];
    for system in systems {
        for estimator in [BATCH, FILTER] {
            for errors in &errors {
                let shares = coverage(system, estimator, NONE, errors, twins());
                row(system, estimator, errors, &shares);
                assert_row(system, errors, &shares);
            }
        }
    }
}

#[test]
#[ignore = "minutes; `just intervals`"]
fn an_observers_interval_is_covered_by_the_same_figure() {
    for gain in [0.5, 2.0, 8.0] {
        let observer = format!("kind = \"nudging\"\ngain = {gain:?}");
        for n in [100, 400] {
            let system = System::Windkessel { n };
            let shares = coverage(system, FILTER, &observer, &Errors::White, twins());
            row(system, &format!("roukf, nudging {gain}"), &Errors::White, &shares);
            assert!(shares.given >= 0.9, "gain {gain}, {n} samples: {shares:?}");
        }
    }
}

fn row(system: System, estimator: &str, errors: &Errors, shares: &Shares) {
    let estimator = estimator.trim_start_matches("kind = ").replace('"', "");
    println!(
        "| {} | {} | {estimator} | {} | {:.3} | {:.3} | {:.2} |",
        system.name(),
        system.n(),
        errors.name(),
        shares.stated,
        shares.given,
        shares.wider
    );
}
