//! Rows that a state has taken already, which a recording that is given again has before what is new.
//!
//! Next file to read: [`super`].

use std::cmp::Ordering;

/// The row that a state ends with, and how many rows up to it were met.
#[derive(Default)]
pub(super) struct Known {
    /// Time, and values of states and then inputs.
    last: Option<(f64, Vec<f64>)>,
    has_met_last: bool,
    pub(super) n_row: u64,
}

impl Known {
    pub(super) fn up_to(last: Option<(f64, Vec<f64>)>) -> Self {
        Self { last, ..Self::default() }
    }

    /// Whether the state has taken a row; what is wrong where it has taken another in its place.
    pub(super) fn has(&mut self, time: f64, values: &[f64]) -> Result<bool, String> {
        let Some((last, held)) = &self.last else { return Ok(false) };
        match time.partial_cmp(last) {
            Some(Ordering::Less) => {}
            Some(Ordering::Equal) if held == values => self.has_met_last = true,
            Some(Ordering::Equal) => {
                return Err(format!("the row at {time} is not {held:?}, with which the state ends"));
            }
            Some(Ordering::Greater) | None => {
                self.ended()?;
                // What comes after it and is earlier is at fault.
                self.last = None;
                return Ok(false);
            }
        }
        self.n_row += 1;
        Ok(true)
    }

    /// What is wrong with a recording that has no more rows which the state has taken.
    pub(super) fn ended(&self) -> Result<(), String> {
        match &self.last {
            Some((last, _)) if self.n_row > 0 && !self.has_met_last => Err(format!(
                "there is no row at {last}, with which the state ends, and there are rows before it"
            )),
            _ => Ok(()),
        }
    }
}
