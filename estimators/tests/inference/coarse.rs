//! Fine steps are not told to be coarse; coarse ones are told in `tests/infer_steps.rs`, with what extrapolation makes of them.

use starlings_estimators::inference::{
    Decimation, Diffusion, Fit, Posterior, StepError, Structure, Sums, step_errors, step_in_rates,
};

use crate::kit::{lorenz, sums};

const PIECES: usize = 16;

/// What is found of a recording of the Lorenz system, with the posterior of all of it.
fn looked(rows: &[[f64; 3]], h: f64) -> (Option<Vec<StepError>>, Posterior, Sums) {
    let basis = lorenz::basis();
    let structure = Structure::same(&basis, &lorenz::NAMES).unwrap();
    let n = rows.len() / PIECES;
    let piece = |rows: &[[f64; 3]]| -> [Sums; 3] {
        let mut levels = Decimation::new(&basis, h, 3).unwrap();
        for (k, row) in rows.iter().enumerate() {
            levels.push(k as f64 * h, row).unwrap();
        }
        levels.sums().unwrap().try_into().unwrap()
    };
    let pieces: Vec<[Sums; 3]> = rows.chunks_exact(n).take(PIECES).map(piece).collect();
    let fit = Fit::new(Diffusion::Full, 27);
    let whole = sums(&basis, rows, h);
    let posterior = fit.posterior(&whole, &structure).unwrap();
    (step_errors(&pieces, &fit, &structure, &posterior, 0.9).ok(), posterior, whole)
}

#[test]
fn a_fine_recording_is_not_called_coarse() {
    let mut named = 0;
    for seed in 0..20 {
        let (found, posterior, whole) = looked(&lorenz::weak(seed, 4000, 0.002, &lorenz::diffusion()), 0.002);
        named += usize::from(found.is_none_or(|found| !found.is_empty()));
        assert!(step_in_rates(&whole, &posterior) < 0.1);
    }
    println!("{named} of 20 fine recordings are called coarse");
    // One in a hundred at most by the stated rate; two of twenty have a probability of 2 %.
    assert!(named <= 1, "{named}");
}
