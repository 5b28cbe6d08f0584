//! How often one run has lost its program, by cause, and whether it is made once more.
//!
//! A run changes nothing outside its folder, so it can be made again. Next file to read: [`super::backoff`].

/// Times that a run is made when its program is killed from outside, and when it falls by itself, which is likely to happen
/// again.
const KILLED: u32 = 12;
const FELL: u32 = 2;

/// Losses of one run.
#[derive(Debug, Default)]
pub(crate) struct Losses {
    kills: u32,
    falls: u32,
}

impl Losses {
    /// Counts a program that somebody killed; whether the run is made again.
    pub(crate) fn killed(&mut self) -> bool {
        self.kills += 1;
        self.kills < KILLED
    }

    /// Counts a program that ended by itself; whether the run is made again.
    pub(crate) fn fell(&mut self) -> bool {
        self.falls += 1;
        self.falls < FELL
    }

    /// All of them.
    pub(crate) fn total(&self) -> u32 {
        self.kills + self.falls
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_was_killed_may_still_fall_once_and_one_that_fell_may_still_be_killed() {
        let mut losses = Losses::default();
        assert!((1..KILLED).all(|_| losses.killed()));
        assert!(losses.fell());
        assert_eq!(losses.total(), KILLED);
        assert!(!losses.fell() && !losses.killed());
    }
}
