//! The memory of an inference that follows a recording: all blocks, or the last ones.
//!
//! A sliding window adds its blocks anew each time, so nothing is ever subtracted and rounding does not pile up. Read next: `change.rs`.

use std::collections::VecDeque;

use super::{Basis, InferenceError, Sums};

/// How far back the memory goes.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Memory {
    /// To the start.
    Growing,
    /// So many blocks, at least one.
    Sliding(usize),
}

/// Sums of the blocks that are remembered.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Window {
    memory: Memory,
    blocks: VecDeque<Sums>,
}

impl Window {
    /// A window without blocks.
    pub fn new(memory: Memory) -> Self {
        Self { memory, blocks: VecDeque::new() }
    }

    /// Takes the next block and gives back the one that is forgotten for it.
    ///
    /// # Errors
    /// As for [`Sums::merge`]; the window is then as it was.
    pub fn push(&mut self, block: Sums) -> Result<Option<Sums>, InferenceError> {
        match (self.memory, self.blocks.back_mut()) {
            (Memory::Growing, Some(all)) => {
                all.merge(&block)?;
                Ok(None)
            }
            (_, Some(last)) => {
                last.fits(&block)?;
                self.blocks.push_back(block);
                let full = matches!(self.memory, Memory::Sliding(most) if self.blocks.len() > most.max(1));
                Ok(if full { self.blocks.pop_front() } else { None })
            }
            (_, None) => {
                self.blocks.push_back(block);
                Ok(None)
            }
        }
    }

    /// The sums of all that is remembered, `None` before the first block.
    pub fn sums(&self) -> Option<Sums> {
        // Blocks of one kind always merge.
        Sums::of(&self.blocks).ok()?
    }

    /// Whether the blocks, which came from elsewhere, are whole and of this basis.
    ///
    /// # Errors
    /// As for [`Sums::check`] and [`Sums::merge`].
    pub fn check(&self, basis: &Basis) -> Result<(), InferenceError> {
        let Some(first) = self.blocks.front() else { return Ok(()) };
        self.blocks.iter().try_for_each(|block| block.check(basis).and_then(|()| first.fits(block)))
    }

    /// Number of blocks that are held.
    pub fn n_block(&self) -> usize {
        self.blocks.len()
    }

    /// Whether a sliding window has all of its blocks.
    pub fn is_full(&self) -> bool {
        matches!(self.memory, Memory::Sliding(most) if self.blocks.len() >= most.max(1))
    }

    /// Forgets everything and returns the blocks in their order.
    pub fn drain(&mut self) -> impl Iterator<Item = Sums> + '_ {
        self.blocks.drain(..)
    }
}
