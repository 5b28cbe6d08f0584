//! States that walk: model error of a state inside the filter.
//!
//! Where the initial value of a state has a random walk, the entries of initial values stand for the states as they are now, from the
//! first analysis of the pass with drift on: the direction of each in the reduced basis is that of the state itself. So the walk adds
//! its variance to the state, and every other state moves along as it depends on those that are in the basis. Where all states that the
//! noise reaches are in it, the filter is the Kalman filter with that noise. What the entries end with is the state after the last
//! analysis. Next file to read: [`super::filter`].

use nalgebra::DMatrix;
use starlings_estimators::Drift;
use starlings_fleet::StateError;
use starlings_models::Spec;

use crate::checked::Record;
use crate::expand::INITIAL;
use crate::states::States;
use crate::{Study, ThetaEntry};

/// An entry of the estimated vector that follows a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Follower {
    entry: usize,
    record: usize,
    component: usize,
}

/// The entries that follow their states; none where no state walks.
#[derive(Clone, Debug, Default)]
pub(super) struct Walking(Vec<Follower>);

impl Walking {
    pub(super) fn of(study: &Study) -> Self {
        if !study.walks() {
            return Self::default();
        }
        // One value for all records is that of the only one which is fitted: see `check::walks`.
        let fitted = study.records.iter().position(Record::is_trained);
        let follower = |(entry, of): (usize, &ThetaEntry)| {
            let state = study.parameters[of.parameter].name.strip_prefix(INITIAL)?;
            let component = Spec::range_of(&study.spec.states, state)?.start;
            Some(Follower { entry, record: of.record.or(fitted)?, component })
        };
        Self(study.theta.iter().enumerate().filter_map(follower).collect())
    }

    /// Puts the states of the particles into their entries. That of a record without states is left.
    ///
    /// # Errors
    /// When the store of states fails.
    pub(super) fn follow(
        &self,
        theta: &mut DMatrix<f64>,
        states: &[Option<States>],
    ) -> Result<(), StateError> {
        for (record, states) in states.iter().enumerate() {
            let followers: Vec<&Follower> =
                self.0.iter().filter(|follower| follower.record == record).collect();
            let Some(states) = states.as_ref().filter(|_| !followers.is_empty()) else { continue };
            states.for_each_block(|first, rows| {
                for follower in &followers {
                    if let Some(row) = follower.component.checked_sub(first).filter(|row| *row < rows.nrows())
                    {
                        theta.row_mut(follower.entry).copy_from(&rows.row(row));
                    }
                }
            })?;
        }
        Ok(())
    }

    /// Where runs from the start of a record begin: of a state that walks the value at which the pass began, not that at its end.
    pub(super) fn starts(&self, centre: &[f64]) -> Vec<(usize, f64)> {
        self.0.iter().map(|follower| (follower.entry, centre[follower.entry])).collect()
    }
}

impl Study {
    /// Whether a state walks: model error of a state.
    pub fn walks(&self) -> bool {
        let of_state = |entry: &ThetaEntry| self.parameters[entry.parameter].is_initial();
        self.theta.iter().any(|entry| of_state(entry) && matches!(entry.drift, Drift::Walk(_)))
    }

    /// Why `what`, which begins at the start of a record, cannot go on from the posterior of this study.
    pub(crate) fn lacks_start(&self, what: &str) -> Option<String> {
        self.walks().then(|| {
            format!(
                "the study lets a state walk, so that its posterior has the state at the end of the record, and {what} begins at its \
                 start: remove `process` of the initial values and run again"
            )
        })
    }
}
