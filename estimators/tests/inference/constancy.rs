//! Whether coefficients are the same throughout a recording.

use std::sync::Arc;

use starlings_estimators::inference::{
    Basis, Diffusion, Fit, Function, Rule, Seam, Structure, Sums, most_changed,
};

use crate::kit::sde::{gauss, rng};
use crate::kit::sums;

const H: f64 = 0.02;
const PIECE: usize = 500;

fn basis() -> Arc<Basis> {
    let x = Function::new("x", |_, x| x[0], |_, _, slopes| slopes[0] = 1.0);
    Arc::new(Basis::new(1, 0).with(Rule::LeftPoint, x).unwrap())
}

/// Where the coefficient changes most.
fn asked(pieces: &[&Sums]) -> Option<Seam> {
    let structure = Structure::same(&basis(), &["x"]).unwrap();
    most_changed(pieces, &Fit::new(Diffusion::Full, 1), &structure)
}

/// Sixteen pieces of a decay of rate 1 under noise of D = 1, whose rate is another from a piece on.
fn pieces(seed: u64, change: usize, rate: f64) -> Vec<Sums> {
    let (mut draw, basis, mut x) = (rng(seed), basis(), 0.0);
    let mut step = |rate: f64| {
        let now = [x];
        x += -H * rate * x + H.sqrt() * gauss(&mut draw);
        now
    };
    let mut piece = |k: usize| {
        let rows: Vec<[f64; 1]> = (0..=PIECE).map(|_| step(if k < change { 1.0 } else { rate })).collect();
        sums(&basis, &rows, H).detach()
    };
    (0..16).map(&mut piece).collect()
}

/// Where and how surely a coefficient changes between pieces.
fn told(pieces: &[Sums]) -> (usize, f64) {
    let seam = asked(&pieces.iter().collect::<Vec<_>>()).expect("every seam has rows before it");
    (seam.piece, seam.by_chance)
}

/// One recording in twenty may be told to change that does not.
#[test]
fn recordings_without_a_change_are_told_to_have_one_as_rarely_as_stated() {
    let surely: Vec<f64> = (0..1000).map(|seed| told(&pieces(seed, 16, 1.0)).1).collect();
    let share = surely.iter().filter(|by_chance| **by_chance < 0.05).count() as f64 / 1000.0;
    println!("{share} at one in twenty");
    // Seams of one recording share their rows, so there are fewer; sd of 0.007.
    assert!((0.01..0.06).contains(&share), "{share}");
    assert!(surely.iter().filter(|by_chance| **by_chance < 1e-3).count() <= 4);
}

#[test]
fn a_change_is_told_with_the_piece_that_it_begins_with() {
    for seed in 0..20 {
        let (piece, by_chance) = told(&pieces(2000 + seed, 6, 4.0));
        assert!(piece.abs_diff(6) <= 1 && by_chance < 1e-6, "{seed}: {piece}, {by_chance}");
    }
    let one = pieces(1, 16, 1.0);
    assert_eq!(asked(&[&one[0]]), None, "one piece has no seam");
    assert_eq!(asked(&[]), None);
}
