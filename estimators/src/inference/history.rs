//! The blocks of a recording so far, in pieces that are the longer the older they are: stretches of any length up to now, and what
//! came before them.
//!
//! Of every length 1, 2, 4, ... blocks four pieces are kept at most; where there would be more, the two oldest of it are made one. So
//! n blocks are about 4 log₂(n / 4) pieces, every time is a seam between two of them to within about a quarter of its distance from
//! now, and nothing is ever subtracted. (The exponential histogram of Datar, Gionis, Indyk & Motwani 2002.) Read next: `detector.rs`.

use std::collections::VecDeque;

use super::sums::MOST;
use super::{Basis, InferenceError, Memory, Sums};

/// Pieces of one length at most.
const EACH: usize = 4;

/// Neighbouring blocks.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
struct Piece {
    sums: Sums,
    n_block: u64,
}

/// The blocks so far, the oldest first.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub(crate) struct History {
    /// Blocks of a reference, and of what is compared with it, at most.
    reach: u64,
    /// Blocks taken since the start, also those that are forgotten.
    taken: u64,
    pieces: VecDeque<Piece>,
}

impl History {
    /// A history without blocks, of references with this memory.
    pub(crate) fn new(reference: Memory) -> Self {
        let reach = match reference {
            Memory::Growing => MOST,
            Memory::Sliding(most) => (most.max(1) as u64).min(MOST),
        };
        Self { reach, taken: 0, pieces: VecDeque::new() }
    }

    /// Takes the next block.
    ///
    /// # Errors
    /// As for [`Sums::merge`].
    pub(crate) fn push(&mut self, block: Sums) -> Result<(), InferenceError> {
        self.pieces.push_back(Piece { sums: block, n_block: 1 });
        self.taken += 1;
        let (mut end, mut length) = (self.pieces.len(), 1);
        loop {
            let of_length = |piece: &&Piece| piece.n_block <= length;
            let first = end - self.pieces.range(..end).rev().take_while(of_length).count();
            if end - first <= EACH {
                break;
            }
            let Some(second) = self.pieces.remove(first + 1) else { break };
            self.pieces[first].sums.merge(&second.sums)?;
            self.pieces[first].n_block += second.n_block;
            (end, length) = (first + 1, 2 * length);
        }
        let mut held = self.held();
        while let Some(oldest) = self.pieces.front().map(|piece| piece.n_block)
            && held - oldest >= 2 * self.reach
        {
            self.pieces.pop_front();
            held -= oldest;
        }
        Ok(())
    }

    /// Seams before which stretches of two, four, eight ... times `recent` blocks begin, of those that are tested at this block: of 2m
    /// blocks at every m-th one, so that no block has more than 2 / `recent` of them on average. What is tested is no longer than
    /// what lies before it.
    pub(crate) fn due(&self, recent: usize) -> Vec<usize> {
        let half = (self.held() / 2).min(self.reach);
        let mut every = recent.max(1) as u64;
        let mut seams = Vec::new();
        while every <= half / 2 && self.taken.is_multiple_of(every) {
            seams.push(self.seam(2 * every));
            every *= 2;
        }
        seams
    }

    /// Every seam.
    pub(crate) fn seams(&self) -> std::ops::Range<usize> {
        1..self.pieces.len().max(1)
    }

    /// The sums of what came before a seam, as far as a reference reaches, and of what came after it.
    pub(crate) fn parts(&self, seam: usize) -> Option<(Sums, Sums)> {
        let mut first = seam;
        let mut reached = 0;
        while first > 0 && reached < self.reach {
            first -= 1;
            reached += self.pieces[first].n_block;
        }
        Some((self.merged(first..seam)?, self.merged(seam..self.pieces.len())?))
    }

    /// Forgets what began before a time, and gives what is left.
    pub(crate) fn forget_before(&mut self, since: f64) -> impl Iterator<Item = Sums> + '_ {
        self.pieces.retain(|piece| piece.sums.span().is_some_and(|[from, _]| from >= since));
        self.pieces.iter().map(|piece| piece.sums.clone())
    }

    /// Whether these blocks, which came from elsewhere, are whole and of this basis.
    ///
    /// # Errors
    /// As for [`Sums::check`] and [`Sums::merge`]; `Damaged` counts.
    pub(crate) fn check(&self, basis: &Basis) -> Result<(), InferenceError> {
        let counted = self.pieces.iter().try_fold(0_u64, |sum, piece| sum.checked_add(piece.n_block));
        let is_empty = self.reach == 0 || self.pieces.iter().any(|piece| piece.n_block == 0);
        if is_empty || counted.is_none_or(|held| held > self.taken) || self.taken.max(self.reach) > MOST {
            return Err(InferenceError::Damaged { what: "the number of blocks" });
        }
        let Some(first) = self.pieces.front() else { return Ok(()) };
        let whole = |piece: &Piece| piece.sums.check(basis).and_then(|()| first.sums.fits(&piece.sums));
        self.pieces.iter().try_for_each(whole)
    }

    /// Number of blocks that are held.
    fn held(&self) -> u64 {
        self.pieces.iter().map(|piece| piece.n_block).sum()
    }

    /// The last seam with at least `n_block` blocks behind it.
    fn seam(&self, n_block: u64) -> usize {
        let mut behind = 0;
        let reaches = |piece: &Piece| {
            behind += piece.n_block;
            behind >= n_block
        };
        self.pieces.iter().rposition(reaches).unwrap_or(0)
    }

    fn merged(&self, pieces: std::ops::Range<usize>) -> Option<Sums> {
        // Blocks of one kind always merge.
        Sums::of(self.pieces.range(pieces).map(|piece| &piece.sums)).ok()?
    }
}
