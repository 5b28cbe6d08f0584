//! The search for damage on recordings with noise: place and severity against the truth.
#![allow(clippy::unwrap_used)]

mod plate_kit;

use nalgebra::DMatrix;
use plate_kit::{HALF_WIDTH, inspection, row_sd, with_noise};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Uniform};
use starlings_structures::StructureError;
use starlings_structures::plate::{Damage, Dictionary, Inspection, Located, Patch, locate};

/// Noise, relative to what each sensor records of the whole plate.
const NOISE: f64 = 0.01;
const GRID: [usize; 2] = [19, 19];

/// A damage drawn at random and what the search makes of its recording.
fn trial(inspection: &Inspection, dictionary: &Dictionary, seed: u64) -> (Damage, Located) {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = |lo: f64, hi: f64| Uniform::new(lo, hi).unwrap().sample(&mut generator);
    let centre = [draw(0.3, 1.7), draw(0.3, 1.7)];
    let severity = draw(0.05, 0.3);
    let damage = Damage { patch: Patch { centre, half_width: HALF_WIDTH }, severity };
    let noise: Vec<f64> = row_sd(inspection.pristine()).iter().map(|sd| NOISE * sd).collect();
    let data = with_noise(&inspection.exact(&damage), &noise, &mut generator);
    (damage, locate(inspection, dictionary, &data, &noise).unwrap())
}

/// Distance of the places in mm, error of the severity in per cent, and the largest error in posterior sd.
fn errors((truth, found): &(Damage, Located)) -> [f64; 3] {
    let off: [f64; 2] = std::array::from_fn(|i| found.damage.patch.centre[i] - truth.patch.centre[i]);
    let severity = found.damage.severity - truth.severity;
    let sd = found.covariance.diagonal().map(f64::sqrt);
    let pull = (off[0] / sd[0]).abs().max((off[1] / sd[1]).abs()).max((severity / sd[2]).abs());
    [1e3 * off[0].hypot(off[1]), 100.0 * (severity / truth.severity).abs(), pull]
}

#[test]
fn damage_is_found_to_millimetres_and_per_cents_at_one_per_cent_noise() {
    let inspection = inspection(12, 8e-6);
    let dictionary = Dictionary::new(&inspection, HALF_WIDTH, GRID);
    for seed in 1..=3 {
        let found = trial(&inspection, &dictionary, seed);
        let [place, severity, pull] = errors(&found);
        assert!(place < 6.0 && severity < 8.0, "{seed}: {place} mm, {severity} %");
        // Three errors of a unit normal.
        assert!(pull < 4.0, "{seed}: {pull} sd");
        // χ² of 2250 values less three unknowns has a standard deviation of 67.
        assert!((found.1.misfit - 2247.0).abs() < 4.0 * 67.0, "{seed}: {}", found.1.misfit);
    }
}

#[test]
#[ignore = "minutes: `just diagnostics`"]
fn damage_is_found_over_many_draws_with_all_modes() {
    let inspection = inspection(20, 4e-6);
    let dictionary = Dictionary::new(&inspection, HALF_WIDTH, GRID);
    let found: Vec<(Damage, Located)> =
        (0..40).map(|seed| trial(&inspection, &dictionary, 100 + seed)).collect();
    let sorted = |i: usize| {
        let mut all: Vec<f64> = found.iter().map(|trial| errors(trial)[i]).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    let (place, severity, pull) = (sorted(0), sorted(1), sorted(2));
    println!("40 damages, severity 0.05 to 0.3, noise 1 %, 20 x 20 modes, 4 us: median, 90 %, largest");
    for (name, all) in
        [("place, mm", &place), ("severity, %", &severity), ("largest of three errors, sd", &pull)]
    {
        println!("{name}: {:.2} {:.2} {:.2}", all[19], all[35], all[39]);
    }
    assert!(place[35] < 6.0 && severity[35] < 8.0);
    // The largest of 120 unit normals exceeds 4 once in 130 such tests.
    assert!(pull[39] < 4.0, "{}", pull[39]);
}

#[test]
fn a_recording_that_cannot_be_searched_is_refused_with_what_is_wrong() {
    let inspection = inspection(4, 8e-6);
    let dictionary = Dictionary::new(&inspection, HALF_WIDTH, [3, 3]);
    let pristine = inspection.pristine();
    let noise = vec![1e-9; 6];
    let refused =
        |data: &DMatrix<f64>, noise: &[f64]| locate(&inspection, &dictionary, data, noise).unwrap_err();
    let short = pristine.columns(0, 100).into_owned();
    let shape = StructureError::Shape { rows: 6, columns: 100, sensors: 6, samples: 375 };
    assert_eq!(refused(&short, &noise), shape);
    assert_eq!(refused(pristine, &[0.0; 6]), StructureError::Noise { sensors: 6 });
    assert_eq!(refused(pristine, &noise[..5]), StructureError::Noise { sensors: 6 });
    let mut spoiled = pristine.clone();
    spoiled[(2, 7)] = f64::INFINITY;
    let expected = StructureError::NotFinite { sensor: 2, sample: 7, value: f64::INFINITY };
    assert_eq!(refused(&spoiled, &noise), expected);
    assert_eq!(refused(pristine, &noise), StructureError::NothingFound { cells: 9 });
}
