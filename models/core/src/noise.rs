//! White noise of a model: standard normal numbers that a seed, a run's record, its particle and its start determine.
//!
//! Same job, same numbers, on whatever machine. Next file to read: [`crate::segment`].

use std::cell::RefCell;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use crate::Job;

/// The noise of one run, drawn in the order of its steps.
#[derive(Debug)]
pub struct WhiteNoise {
    rng: RefCell<ChaCha8Rng>,
}

impl WhiteNoise {
    /// The noise of a job: jobs of another record, particle or start have other noise.
    pub fn of(seed: u64, job: &Job) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..12].copy_from_slice(&job.record.to_le_bytes());
        key[12..16].copy_from_slice(&job.particle.to_le_bytes());
        // −0 is the same time as 0.
        key[16..24].copy_from_slice(&(job.window.start + 0.0).to_bits().to_le_bytes());
        Self { rng: RefCell::new(ChaCha8Rng::from_seed(key)) }
    }

    /// Draws standard normal numbers.
    pub fn draw(&self, normal: &mut [f64]) {
        let mut rng = self.rng.borrow_mut();
        normal.fill_with(|| StandardNormal.sample(&mut *rng));
    }
}
