//! What a worker sends is checked on arrival: lengths and values of every prediction.
//!
//! A prediction of another shape, or with a value that is not finite, is no answer and no failure of the model: the worker that
//! sent it is at fault. Next file to read: [`super::state`].

use starlings_models::ParticleError;
use starlings_proto::{Lease, LeaseOutcome, SetupId, State as Travelling};

use super::state::State;
use crate::dispatcher::Asked;
use crate::wire::{Job, Prediction, named};

impl State {
    /// An answer, or what is wrong with it as a failure of its worker. One that nobody waits for is left as it is. A state that was
    /// put under its lease is held from here on where the answer names it, and gone where not.
    pub(super) fn checked(&mut self, lease: &Lease, answer: LeaseOutcome) -> LeaseOutcome {
        let put = self.states.take(lease);
        let is_named =
            |answer: &LeaseOutcome| put.as_ref().is_some_and(|put| named(answer) == Some(&put.id()));
        let was_put = is_named(&answer);
        let answer = self.checked_for(self.asked(lease), answer, was_put);
        if is_named(&answer) {
            self.states.hold(put);
        } else {
            self.states.let_go_of(put);
        }
        answer
    }

    /// The same for a job of the running batch whose result was brought along: nothing was put for it.
    pub(super) fn checked_at(&self, index: usize, answer: LeaseOutcome) -> LeaseOutcome {
        self.checked_for(self.running.as_ref().and_then(|running| running.jobs.get(index)), answer, false)
    }

    fn checked_for(
        &self,
        asked: Option<&(SetupId, Job)>,
        answer: LeaseOutcome,
        was_put: bool,
    ) -> LeaseOutcome {
        let LeaseOutcome::Ran(Ok(prediction)) = &answer else { return answer };
        let Some((setup, job)) = asked else { return answer };
        let shape = self.shapes.get(setup);
        let n_output = if shape.is_some_and(|shape| shape.sums) { 0 } else { job.window.observed.len() };
        match fault(prediction, n_output, shape.and_then(|shape| shape.n_state), was_put) {
            Some(fault) => LeaseOutcome::Ran(Err(ParticleError::Infrastructure(fault))),
            None => answer,
        }
    }

    /// The job that a lease asks for, with its setup.
    pub(super) fn asked(&self, lease: &Lease) -> Option<&(SetupId, Job)> {
        match self.dispatcher.asked(lease)? {
            Asked::Job(index) => self.running.as_ref()?.jobs.get(index),
            Asked::Control(control) => self.kept.get(&control),
        }
    }
}

/// What is wrong with a prediction; nothing where it is sound.
fn fault(prediction: &Prediction, wanted: usize, n_state: Option<usize>, was_put: bool) -> Option<String> {
    let Prediction { outputs, state, .. } = prediction;
    if outputs.len() != wanted {
        return Some(format!("it sent {} predicted values where {wanted} belong", outputs.len()));
    }
    let inside = match state {
        Travelling::Values(values) => values,
        // It was checked when it was put.
        Travelling::Named(_) if was_put => return spoiled(outputs),
        Travelling::Named(_) => return Some("it names a state that it did not send".to_owned()),
    };
    if let Some(wanted) = n_state.filter(|n| *n != inside.len()) {
        return Some(format!("it sent a state of {} values where {wanted} belong", inside.len()));
    }
    spoiled(outputs).or_else(|| spoiled(inside))
}

fn spoiled(values: &[f64]) -> Option<String> {
    let spoiled = values.iter().find(|value| !value.is_finite())?;
    Some(format!("it sent {spoiled} as a value of a run that it calls a success"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prediction_of_another_length_or_with_a_value_that_is_not_finite_is_the_workers_fault() {
        let of = |outputs: &[f64], state: &[f64], n_state| {
            fault(
                &Prediction { outputs: outputs.to_vec(), state: state.to_vec().into(), cost: 0.0 },
                2,
                n_state,
                false,
            )
        };
        assert_eq!(of(&[1.0, 2.0], &[3.0], Some(1)), None);
        assert_eq!(of(&[1.0, 2.0], &[3.0], None), None, "nobody knows the model's states");
        let says = |fault: Option<String>| fault.expect("it is wrong");
        let named = Prediction { outputs: vec![1.0, 2.0], state: Travelling::Named([7; 32]), cost: 0.0 };
        assert_eq!(fault(&named, 2, Some(100_000), true), None);
        assert_eq!(says(fault(&named, 2, None, false)), "it names a state that it did not send");
        assert_eq!(says(of(&[1.0], &[], None)), "it sent 1 predicted values where 2 belong");
        assert_eq!(says(of(&[1.0, 2.0], &[3.0, 4.0], Some(1))), "it sent a state of 2 values where 1 belong");
        assert_eq!(
            says(of(&[1.0, f64::NAN], &[], None)),
            "it sent NaN as a value of a run that it calls a success"
        );
        assert_eq!(
            says(of(&[1.0, 2.0], &[f64::INFINITY], Some(1))),
            "it sent inf as a value of a run that it calls a success"
        );
    }
}
