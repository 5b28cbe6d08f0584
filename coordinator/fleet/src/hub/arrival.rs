//! What a worker sends is checked on arrival: lengths and values of every prediction.
//!
//! A prediction of another shape, or with a value that is not finite, is no answer and no failure of the model: the worker that
//! sent it is at fault. Next file to read: [`super::state`].

use starlings_models::{Job, ParticleError, Prediction};
use starlings_proto::{Lease, LeaseOutcome, SetupId};

use super::state::State;
use crate::dispatcher::Asked;

impl State {
    /// An answer, or what is wrong with it as a failure of its worker. One that nobody waits for is left as it is.
    pub(super) fn checked(&self, lease: &Lease, answer: LeaseOutcome) -> LeaseOutcome {
        self.checked_for(self.asked(lease), answer)
    }

    /// The same for a job of the running batch.
    pub(super) fn checked_at(&self, index: usize, answer: LeaseOutcome) -> LeaseOutcome {
        self.checked_for(self.running.as_ref().and_then(|running| running.jobs.get(index)), answer)
    }

    fn checked_for(&self, asked: Option<&(SetupId, Job)>, answer: LeaseOutcome) -> LeaseOutcome {
        let LeaseOutcome::Ran(Ok(prediction)) = &answer else { return answer };
        let Some((setup, job)) = asked else { return answer };
        let n_state = self.shapes.get(setup).and_then(|shape| shape.n_state);
        match fault(prediction, job, n_state) {
            Some(fault) => LeaseOutcome::Ran(Err(ParticleError::Infrastructure(fault))),
            None => answer,
        }
    }

    /// The job that a lease asks for, with its setup.
    fn asked(&self, lease: &Lease) -> Option<&(SetupId, Job)> {
        match self.dispatcher.asked(lease)? {
            Asked::Job(index) => self.running.as_ref()?.jobs.get(index),
            Asked::Control(control) => self.kept.get(&control),
        }
    }
}

/// What is wrong with a prediction; nothing where it is sound.
fn fault(prediction: &Prediction, job: &Job, n_state: Option<usize>) -> Option<String> {
    let Prediction { outputs, state, .. } = prediction;
    let wanted = job.window.observed.len();
    if outputs.len() != wanted {
        return Some(format!("it sent {} predicted values where {wanted} belong", outputs.len()));
    }
    if let Some(wanted) = n_state.filter(|n| *n != state.len()) {
        return Some(format!("it sent a state of {} values where {wanted} belong", state.len()));
    }
    let spoiled = outputs.iter().chain(state).find(|value| !value.is_finite())?;
    Some(format!("it sent {spoiled} as a value of a run that it calls a success"))
}

#[cfg(test)]
mod tests {
    use starlings_models::Window;

    use super::*;

    #[test]
    fn a_prediction_of_another_length_or_with_a_value_that_is_not_finite_is_the_workers_fault() {
        let window = Window { start: 0.0, times: vec![1.0, 2.0], observed: vec![0.0; 2], inputs: vec![] };
        let job = Job { particle: 0, record: 0, window: window.into(), theta: vec![], state: None };
        let of = |outputs: &[f64], state: &[f64], n_state| {
            fault(&Prediction { outputs: outputs.to_vec(), state: state.to_vec(), cost: 0.0 }, &job, n_state)
        };
        assert_eq!(of(&[1.0, 2.0], &[3.0], Some(1)), None);
        assert_eq!(of(&[1.0, 2.0], &[3.0], None), None, "nobody knows the model's states");
        let says = |fault: Option<String>| fault.expect("it is wrong");
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
