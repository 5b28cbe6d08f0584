//! The values of a state, wherever they are: a clone costs a count.
//!
//! A model reads them as a slice, and hands on what it does not change without copying it. Whose memory it is, only who brings the
//! state knows: a vector, or memory that a process of the same machine made.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

/// A state at the start or the end of a run, as a model sees it.
#[derive(Clone)]
pub struct StateValues(Memory);

#[derive(Clone)]
enum Memory {
    Own(Arc<Vec<f64>>),
    Of(Arc<dyn AsRef<[f64]> + Send + Sync>),
}

impl StateValues {
    /// The values that something else holds, for as long as anybody has them.
    pub fn of(values: impl AsRef<[f64]> + Send + Sync + 'static) -> Self {
        Self(Memory::Of(Arc::new(values)))
    }

    /// Its vector where it is one that nobody else has, else a copy.
    pub fn into_vec(self) -> Vec<f64> {
        match self.0 {
            Memory::Own(values) => Arc::unwrap_or_clone(values),
            Memory::Of(values) => (*values).as_ref().to_vec(),
        }
    }

    /// Its vector where it is one that nobody else has.
    pub fn into_own(self) -> Option<Vec<f64>> {
        match self.0 {
            Memory::Own(values) => Arc::into_inner(values),
            Memory::Of(_) => None,
        }
    }
}

impl Deref for StateValues {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        match &self.0 {
            Memory::Own(values) => values,
            Memory::Of(values) => (**values).as_ref(),
        }
    }
}

impl From<Vec<f64>> for StateValues {
    fn from(values: Vec<f64>) -> Self {
        Self(Memory::Own(Arc::new(values)))
    }
}

impl FromIterator<f64> for StateValues {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        values.into_iter().collect::<Vec<_>>().into()
    }
}

impl<'a> IntoIterator for &'a StateValues {
    type Item = &'a f64;
    type IntoIter = std::slice::Iter<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl Default for StateValues {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl PartialEq for StateValues {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl PartialEq<StateValues> for Vec<f64> {
    fn eq(&self, other: &StateValues) -> bool {
        **self == **other
    }
}

impl<const N: usize> PartialEq<[f64; N]> for StateValues {
    fn eq(&self, other: &[f64; N]) -> bool {
        **self == *other
    }
}

impl fmt::Debug for StateValues {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vector_that_nobody_else_has_is_moved_and_any_other_state_copied() {
        let values = vec![1.0, 2.0];
        let place = values.as_ptr();
        let state = StateValues::from(values);
        let twin = state.clone();
        assert_eq!(twin.as_ptr(), place, "a clone copies nothing");
        let copied = twin.into_vec();
        assert!(copied.as_ptr() != place && copied == [1.0, 2.0]);
        let moved = state.into_vec();
        assert_eq!(moved.as_ptr(), place);

        let lent = StateValues::of([3.0, 4.0]);
        assert_eq!(lent, StateValues::from(vec![3.0, 4.0]));
        assert_eq!(format!("{lent:?}"), "[3.0, 4.0]");
        assert!(lent.clone().into_own().is_none() && lent.into_vec() == [3.0, 4.0]);
        assert!(StateValues::default().is_empty());
    }
}
