//! Random jobs and messages: any bits of a float, any length that is allowed.

use std::sync::Arc;

use proptest::prelude::*;
use starlings_models::{Job, ModelFailure, ParticleError, Prediction, Signal, Timeout, Window};
use starlings_proto::{FromWorker, Hello, Lease, LeaseOutcome, MAX_SLOTS, State};

pub(crate) fn any_float() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<u64>().prop_map(f64::from_bits),
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(-0.0),
        Just(f64::MIN_POSITIVE / 2.0),
    ]
}

pub(crate) fn floats(max: usize) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(any_float(), 0..max)
}

pub(crate) fn signal() -> impl Strategy<Value = Signal> {
    prop::collection::vec((any_float(), any_float()), 0..5).prop_map(|pairs| {
        let (times, values) = pairs.into_iter().unzip();
        Signal { times, values }
    })
}

pub(crate) fn window() -> impl Strategy<Value = Window> {
    (1_usize..6, 0_usize..4, prop::collection::vec(signal(), 0..3), any_float()).prop_flat_map(
        |(n_times, n_obs, inputs, start)| {
            (
                prop::collection::vec(any_float(), n_times),
                prop::collection::vec(any_float(), n_times * n_obs),
                Just(inputs),
                Just(start),
            )
                .prop_map(|(times, observed, inputs, start)| Window {
                    start,
                    times,
                    observed,
                    inputs,
                    since: Vec::new(),
                })
        },
    )
}

pub(crate) fn job() -> impl Strategy<Value = Job<State>> {
    (any::<u32>(), any::<u32>(), window(), floats(8), prop::option::of(floats(8))).prop_map(
        |(particle, record, window, theta, state)| Job {
            particle,
            record,
            window: Arc::new(window),
            theta,
            state: state.map(State::from),
        },
    )
}

pub(crate) fn lease() -> impl Strategy<Value = Lease> {
    (any::<u64>(), any::<u64>(), any::<u32>()).prop_map(|(epoch, job, attempt)| Lease { epoch, job, attempt })
}

pub(crate) fn failure() -> impl Strategy<Value = ParticleError> {
    prop_oneof![
        model_failure().prop_map(ParticleError::Model),
        ".*".prop_map(ParticleError::BadJob),
        ".*".prop_map(ParticleError::Infrastructure),
        ".*".prop_map(ParticleError::Undecided),
        (any_float(), ".*").prop_map(|(limit, says)| Timeout { limit, says }.into()),
    ]
}

pub(crate) fn model_failure() -> impl Strategy<Value = ModelFailure> {
    prop_oneof![
        (".*", any_float()).prop_map(|(what, time)| ModelFailure::NotFinite { what, time }),
        (any_float(), any_float()).prop_map(|(time, step)| ModelFailure::StepTooSmall { time, step }),
        (any_float(), any::<u64>()).prop_map(|(time, limit)| ModelFailure::TooManySteps { time, limit }),
        ".*".prop_map(ModelFailure::OutsideDomain),
        ".*".prop_map(ModelFailure::Solver),
    ]
}

pub(crate) fn answer() -> impl Strategy<Value = LeaseOutcome> {
    prop_oneof![
        (floats(8), floats(8)).prop_map(|(outputs, state)| LeaseOutcome::Ran(Ok(Prediction {
            outputs,
            state: state.into(),
            cost: 0.25
        }))),
        failure().prop_map(|error| LeaseOutcome::Ran(Err(error))),
        Just(LeaseOutcome::Withdrawn),
    ]
}

pub(crate) fn from_worker() -> impl Strategy<Value = FromWorker> {
    // Other signs in the name of a host are replaced on arrival.
    let hello = (
        any::<u32>(),
        "[A-Za-z0-9._:-]{1,64}",
        1..=MAX_SLOTS as u32,
        any::<u64>(),
        any::<Option<[u8; 32]>>(),
    );
    prop_oneof![
        hello.prop_map(|(protocol, text, slots, nonce, build)| {
            FromWorker::Hello(Hello {
                protocol,
                version: text.clone(),
                cores: slots,
                slots,
                host: text,
                pid: protocol,
                nonce,
                build,
            })
        }),
        (any::<[u8; 32]>(), prop::option::of(".*"))
            .prop_map(|(id, failure)| FromWorker::Setup { id, result: failure.map_or(Ok(()), Err) }),
        (lease(), answer()).prop_map(|(lease, answer)| FromWorker::Result { lease, answer, cost: 0.25 }),
        Just(FromWorker::SharesStates),
        (lease(), prop::collection::vec(any::<[u8; 32]>(), 0..4))
            .prop_map(|(lease, pieces)| FromWorker::Recombined { lease, made: Ok(pieces) }),
        (lease(), ".*").prop_map(|(lease, why)| FromWorker::Recombined { lease, made: Err(why) }),
        (any::<u32>(), any::<u32>()).prop_map(|(running, queued)| FromWorker::Heartbeat { running, queued }),
        ".*".prop_map(FromWorker::Goodbye),
    ]
}
