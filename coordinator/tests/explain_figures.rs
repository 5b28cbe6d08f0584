//! The figures that every verdict is told with.
#![allow(clippy::unwrap_used, clippy::float_cmp)]

mod budget_kit;
mod study_kit;

use budget_kit::{brink, go, stage};
use starlings_coordinator::fleet::InProcess;

#[test]
fn every_verdict_has_its_figures_with_units_and_every_tied_set_its_own() {
    let case = brink();
    let full = go(&case, &case.fresh(), &mut InProcess::new(2), None).unwrap();
    assert!(full.gap.iter().all(|row| row.unit == "V" && row.after < row.before), "{:?}", full.gap);
    // Names of effects that were screened, whether the study's own or other forms of them.
    let is_screened = |name: &String| full.screened.iter().any(|screened| screened.name == *name);
    assert!(full.tied_with.iter().flatten().all(is_screened), "{:?}", full.tied_with);
    assert_eq!(full.tied_gap.len(), full.tied_with.len());
    let of_set = |set: &[&str]| full.tied_with.iter().position(|tied| tied == set).map(|i| &full.tied_gap[i]);
    assert_eq!(of_set(&["seep"]).unwrap().len(), full.gap.len(), "it was refitted");
    for (set, gap) in full.tied_with.iter().zip(&full.tied_gap) {
        // One that does the same as what is shown is tied without a refit.
        assert!([0, full.gap.len()].contains(&gap.len()), "{set:?}: {gap:?}");
        assert!(gap.iter().all(|row| row.after < row.before), "{gap:?}");
    }
    let unseen = full.screened.iter().find(|s| s.name == "unseen").unwrap();
    // Steps of another length are all that it changes: rounding, which would promise any amplitude.
    assert_eq!(unseen.amplitude, None, "{unseen:?}");
    // A budget that ends before anything is refitted leaves a gap with its figures.
    let cut = go(&case, &case.fresh(), &mut InProcess::new(2), Some(stage(&full, "fit") + 1)).unwrap();
    assert!(cut.effects.is_empty() && !cut.gap.is_empty());
    assert!(cut.gap.iter().all(|row| row.after == row.before), "{:?}", cut.gap);
}
