//! Neighbouring steps of a recording, picked evenly over its length: a sample of constant size for what sums cannot say.
//!
//! A pair is three rows that follow one another. Every block gives a few of its own, and merging them in the order of the blocks thins
//! them where they are too many, so that the sample depends on the blocks alone and not on who picked it. Within a block they lie at random
//! about equal distances, by the time of its first row, or what repeats in a recording could keep step with them. Long blocks give no
//! more pairs than short ones: each pair has the number of steps that it stands for. Read next: `varying.rs` and `robust.rs`, which ask it.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Basis, InferenceError};

/// Pairs of a block at most.
const OF_BLOCK: usize = 512;
/// Numbers of a block's pairs at most: a hundred and thirty kilobytes.
const OF_BLOCK_NUMBERS: usize = 1 << 14;
/// Pairs of a recording at most; between half as many and so many are left of more.
const OF_ALL: usize = 1 << 16;
/// Numbers of a recording's pairs at most: eight megabytes.
const OF_ALL_NUMBERS: usize = 1 << 20;
/// Rows of a pair.
const ROWS: usize = 3;
/// Pairs of neighbouring steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Pairs {
    n_channel: usize,
    /// One in so many of those that were offered is kept.
    stride: u64,
    offered: u64,
    /// The time of the first row and the values of all three, pair after pair.
    values: Vec<f64>,
    /// Steps that each pair stands for in its block.
    weights: Vec<f64>,
}

/// Two steps that follow one another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair<'a> {
    /// When the first one starts.
    pub(crate) time: f64,
    /// Steps that it stands for, up to a factor that all pairs share.
    pub(crate) weight: f64,
    /// Values of the rows at which the first starts, both meet and the second ends, one after the other.
    rows: &'a [f64],
    n_channel: usize,
}

impl<'a> Pair<'a> {
    /// Values of a row, 0 to 2.
    pub(crate) fn row(&self, row: usize) -> &'a [f64] {
        &self.rows[row * self.n_channel..][..self.n_channel]
    }
}

impl Pairs {
    /// No pairs, of rows of so many values.
    pub fn new(n_channel: usize) -> Self {
        Self { n_channel, stride: 1, offered: 0, values: Vec::new(), weights: Vec::new() }
    }

    /// How many each of so many blocks has to give, so that together they are as many as are kept of a recording.
    pub fn share(n_channel: usize, n_block: u64) -> usize {
        let most = Self::new(n_channel).most() as u64;
        (most / n_block.max(1)).clamp(1, OF_BLOCK as u64) as usize
    }

    /// Those of a block in which `n_step` steps start, from its times and its rows one after the other, `most` at most.
    pub fn of_block(times: &[f64], rows: &[f64], n_channel: usize, n_step: usize, most: usize) -> Self {
        let mut pairs = Self::new(n_channel);
        let n_row = times.len().min(rows.len() / n_channel.max(1));
        let n_step = n_step.min(n_row.saturating_sub(1));
        let (there, kept) = (n_step / 2, Self::n_of_block(n_step, n_channel, most));
        let apart = there as f64 / kept as f64;
        let mut random = ChaCha8Rng::seed_from_u64(times.first().map_or(0, |time| time.to_bits()));
        for k in 0..kept {
            // A step short of the next pair at most, so that no two are the same.
            let beside = random.random::<f64>() * (apart - 1.0);
            let row = 2 * ((k as f64).mul_add(apart, beside) as usize).min(there - 1);
            pairs.values.push(times[row]);
            pairs.values.extend_from_slice(&rows[row * n_channel..][..ROWS * n_channel]);
        }
        pairs.of_steps(n_step as u64)
    }

    /// Number of pairs of a block of so many steps that gives `most` at most.
    fn n_of_block(n_step: usize, n_channel: usize, most: usize) -> usize {
        (n_step / 2).min(most).min(OF_BLOCK).min(OF_BLOCK_NUMBERS / (1 + ROWS * n_channel))
    }

    /// As those of a block of so many steps.
    fn of_steps(mut self, n_step: u64) -> Self {
        let n = self.n_pair();
        self.offered = n as u64;
        self.weights = vec![n_step as f64 / n as f64; n];
        self
    }

    /// Adds those of the next block.
    ///
    /// # Errors
    /// `Incompatible` with rows of another length.
    pub fn merge(&mut self, block: &Self) -> Result<(), InferenceError> {
        if self.n_channel != block.n_channel {
            return Err(InferenceError::Incompatible { what: "their channels" });
        }
        for (pair, weight) in block.values.chunks_exact(self.size()).zip(&block.weights) {
            if self.offered.is_multiple_of(self.stride) {
                if self.n_pair() >= self.most() {
                    self.halve();
                }
                // There is an even number of them, so that this one is in its turn after halving too.
                self.values.extend_from_slice(pair);
                self.weights.push(*weight);
            }
            self.offered += 1;
        }
        Ok(())
    }

    /// Pairs at most, an even number.
    fn most(&self) -> usize {
        OF_ALL.min(OF_ALL_NUMBERS / self.size() / 2 * 2).max(2)
    }

    fn halve(&mut self) {
        let size = self.size();
        let kept = self.values.chunks_exact(size).step_by(2).flatten().copied();
        self.values = kept.collect();
        self.weights = self.weights.iter().step_by(2).copied().collect();
        self.stride *= 2;
    }

    fn size(&self) -> usize {
        1 + ROWS * self.n_channel
    }

    /// Number of pairs.
    pub fn n_pair(&self) -> usize {
        self.values.len() / self.size()
    }

    /// Number of values of a row, states and inputs.
    pub fn n_channel(&self) -> usize {
        self.n_channel
    }

    /// The pairs, in the order of the blocks.
    pub(crate) fn iter(&self) -> impl Iterator<Item = Pair<'_>> {
        let n_channel = self.n_channel;
        self.values.chunks_exact(self.size()).zip(&self.weights).map(move |(pair, weight)| Pair {
            time: pair[0],
            weight: *weight,
            rows: &pair[1..],
            n_channel,
        })
    }

    /// The pairs of a block as numbers: the time and three rows of each.
    pub fn to_values(&self) -> &[f64] {
        &self.values
    }

    /// The pairs of a block of so many steps that gives `most` at most, from numbers that came from elsewhere.
    ///
    /// # Errors
    /// `Damaged` where they are not as many as such a block has, or not finite.
    pub fn from_values(
        basis: &Basis,
        n_step: u64,
        most: usize,
        values: &[f64],
    ) -> Result<Self, InferenceError> {
        let pairs = Self { values: values.to_vec(), ..Self::new(basis.n_channel()) };
        let n_step_here = usize::try_from(n_step).unwrap_or(usize::MAX);
        let n = Self::n_of_block(n_step_here, basis.n_channel(), most);
        if n * pairs.size() != values.len() || values.iter().any(|v| !v.is_finite()) {
            return Err(InferenceError::Damaged { what: "the pairs of steps of a block" });
        }
        Ok(pairs.of_steps(n_step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs of a block of one channel that counts its rows from `first` on.
    fn block(first: usize, n_step: usize) -> Pairs {
        let rows: Vec<f64> = (first..=first + n_step).map(|k| k as f64).collect();
        Pairs::of_block(&rows, &rows, 1, n_step, usize::MAX)
    }

    fn starts(pairs: &Pairs) -> Vec<f64> {
        pairs.iter().map(|pair| pair.time).collect()
    }

    #[test]
    fn short_blocks_give_all_their_steps_and_long_ones_some_that_are_apart() {
        assert_eq!(starts(&block(10, 7)), [10.0, 12.0, 14.0]);
        assert_eq!(block(0, 1).n_pair() + block(0, 0).n_pair(), 0);
        let long = block(0, 100_001);
        assert_eq!(long.n_pair(), OF_BLOCK);
        let apart: Vec<f64> = starts(&long).windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(apart.iter().all(|apart| (2.0..400.0).contains(apart)), "{apart:?}");
        for pair in long.iter() {
            let after: Vec<f64> = (0..ROWS).map(|k| pair.row(k)[0] - pair.time).collect();
            assert_eq!(after, [0.0, 1.0, 2.0]);
        }
    }

    #[test]
    fn no_pair_is_taken_twice() {
        for there in 510..1600 {
            let starts = starts(&block(there, 2 * there));
            assert!(starts.windows(2).all(|pair| pair[1] >= pair[0] + 2.0), "{there} pairs");
            assert!(starts.iter().all(|time| *time <= (3 * there - 2) as f64), "{there} pairs");
        }
    }

    #[test]
    fn many_blocks_share_what_is_kept_of_all() {
        assert_eq!(Pairs::share(1, 1), OF_BLOCK);
        assert_eq!(Pairs::share(1, 1 << 30), 1);
        for (n_channel, n_block) in [(1, 200), (3, 963), (30, 400)] {
            let share = Pairs::share(n_channel, n_block);
            let most = Pairs::new(n_channel).most();
            let all = share as u64 * n_block;
            assert!((most as u64 / 2..=most as u64).contains(&all), "{n_channel} channels, {n_block} blocks");
        }
        let rows: Vec<f64> = (0..1001).map(f64::from).collect();
        let few = Pairs::of_block(&rows, &rows, 1, 1000, 10);
        assert_eq!(few.n_pair(), 10);
        assert!(few.iter().all(|pair| (pair.weight - 100.0).abs() < 1e-12));
    }

    #[test]
    fn what_is_left_of_many_blocks_keeps_no_step_with_them() {
        let firsts: Vec<f64> = (0..1000).map(|k| starts(&block(k * 20_480, 20_480))[0]).collect();
        let early = firsts.iter().filter(|time| *time % 20_480.0 < 20.0).count();
        assert!((440..560).contains(&early), "{early}");
    }

    #[test]
    fn a_pair_stands_for_the_steps_of_its_block() {
        let mut all = block(0, 100);
        all.merge(&block(1000, 102_400)).unwrap_or_else(|error| panic!("{error}"));
        let weights: Vec<f64> = all.iter().map(|pair| pair.weight).collect();
        assert_eq!((weights[0], weights[weights.len() - 1]), (2.0, 200.0));
        assert!((weights.iter().sum::<f64>() - 102_500.0).abs() < 1e-6);
    }

    #[test]
    fn merged_blocks_are_thinned_evenly_and_never_more_than_a_sample() {
        let mut all = Pairs::new(1);
        for k in 0..400 {
            all.merge(&block(k * 2000, 2000)).unwrap_or_else(|error| panic!("{error}"));
            assert!(all.n_pair() <= OF_ALL);
        }
        assert!(all.n_pair() > OF_ALL / 2 - OF_BLOCK, "{}", all.n_pair());
        let starts = starts(&all);
        let halves = starts.iter().filter(|time| **time < 400_000.0).count() as f64 / starts.len() as f64;
        assert!((halves - 0.5).abs() < 0.001, "{halves}");
        assert!(all.merge(&Pairs::new(2)).is_err(), "rows of another length");
    }

    #[test]
    fn numbers_that_are_no_pairs_are_refused() {
        let basis = Basis::new(1, 0);
        let pairs = block(0, 50);
        assert_eq!(Pairs::from_values(&basis, 50, OF_BLOCK, pairs.to_values()), Ok(pairs.clone()));
        let values = pairs.to_values();
        for damaged in [values[1..].to_vec(), values[4..].to_vec(), vec![f64::NAN; 100], vec![0.0; 104]] {
            assert!(Pairs::from_values(&basis, 50, OF_BLOCK, &damaged).is_err());
        }
        assert!(Pairs::from_values(&basis, u64::MAX, OF_BLOCK, values).is_err());
        assert!(Pairs::from_values(&basis, 50, 24, values).is_err(), "more than were asked for");
    }
}
