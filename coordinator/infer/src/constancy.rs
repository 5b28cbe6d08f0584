//! The sums of a recording by stretches, and where its coefficients change from one to the other.
//!
//! Stretches of neighbouring blocks have sums of their own, sixteen at most whatever the length; the test of their seams is
//! `estimators/src/inference/constancy.rs`. Next file to read: `words.rs`, which says what it finds.

use starlings_estimators::inference::{Fit, InferenceError, Seam, Structure, Sums, most_changed};

use crate::answer::Answer;

/// Stretches at most: two of them are made one where there would be more.
const MOST: usize = 16;
/// Probability of telling a change of recordings that have none.
const FALSE_ALARM: f64 = 1e-3;
/// Standard deviations by which the coefficient that changed most has to differ, so that what is told shows in its figures.
const SHOWS: f64 = 3.0;

/// Neighbouring blocks.
#[derive(Debug, Clone, PartialEq)]
struct Stretch {
    sums: Sums,
    record: usize,
    from: f64,
    n_block: u64,
}

/// Sums of neighbouring blocks, in the order of the recordings.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Stretches {
    kept: Vec<Stretch>,
    /// Blocks of a whole stretch.
    blocks: u64,
}

/// Where coefficients change most.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Changed {
    /// Number of the record, and the time in it from which they are others.
    pub(crate) record: usize,
    pub(crate) from: f64,
    /// Probability of that in a recording without a change, for all times together.
    pub(crate) by_chance: f64,
    /// The coefficient that differs most beside its uncertainty: mean and sd before and from there on.
    pub(crate) name: String,
    pub(crate) before: [f64; 2],
    pub(crate) after: [f64; 2],
}

impl Changed {
    /// Whether the change shows beside intervals that hold for noise of any size, too, where the answer has these.
    pub(crate) fn shows(&self, answer: &Answer) -> bool {
        let Self { name, before: [before, sd_before], after: [after, sd_after], .. } = self;
        (before - after).abs() > SHOWS * sd_before.hypot(*sd_after) * answer.widening(name).max(1.0)
    }
}

impl Stretches {
    /// Takes the sums of the next block, which begins at a time of a record.
    ///
    /// # Errors
    /// `Incompatible` sums.
    pub(crate) fn add(&mut self, sums: &Sums, record: usize, from: f64) -> Result<(), InferenceError> {
        self.blocks = self.blocks.max(1);
        match self.kept.last_mut() {
            Some(last) if last.n_block < self.blocks => return last.take(sums, 1),
            _ => {}
        }
        if self.kept.len() == MOST {
            let mut halved: Vec<Stretch> = Vec::with_capacity(MOST);
            for (k, stretch) in self.kept.drain(..).enumerate() {
                match halved.last_mut() {
                    Some(before) if k % 2 == 1 => before.take(&stretch.sums, stretch.n_block)?,
                    _ => halved.push(stretch),
                }
            }
            self.kept = halved;
            self.blocks *= 2;
        }
        self.kept.push(Stretch { sums: sums.clone().detach(), record, from, n_block: 1 });
        Ok(())
    }

    /// Where the coefficients change most, if they surely do.
    pub(crate) fn changed(&self, fit: &Fit, structure: &Structure) -> Option<Changed> {
        let pieces: Vec<&Sums> = self.kept.iter().map(|stretch| &stretch.sums).collect();
        let Seam { piece, by_chance } = most_changed(&pieces, fit, structure)?;
        if by_chance >= FALSE_ALARM {
            return None;
        }
        let side = |of: &[&Sums]| fit.posterior(&Sums::of(of.iter().copied()).ok()??, structure).ok();
        let (before, after) = (side(&pieces[..piece])?, side(&pieces[piece..])?);
        let values = before.estimates.iter().zip(&after.estimates);
        let both = values.filter_map(|(a, b)| Some((&a.name, a.value?, b.value?)));
        let scored = both.map(|(name, a, b)| ((a.mean - b.mean).abs() / a.sd.hypot(b.sd), name, a, b));
        let (score, name, a, b) =
            scored.filter(|(score, ..)| score.is_finite()).max_by(|a, b| a.0.total_cmp(&b.0))?;
        let Stretch { record, from, .. } = self.kept[piece];
        let (before, after) = ([a.mean, a.sd], [b.mean, b.sd]);
        (score > SHOWS).then(|| Changed { record, from, by_chance, name: name.clone(), before, after })
    }
}

impl Stretch {
    /// Takes what follows. Residuals of neighbouring steps across the seam, one of hundreds, are left out.
    fn take(&mut self, later: &Sums, n_block: u64) -> Result<(), InferenceError> {
        self.sums.merge(later)?;
        self.sums = self.sums.clone().detach();
        self.n_block += n_block;
        Ok(())
    }
}
