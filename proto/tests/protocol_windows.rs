//! Windows: encoded once per batch, sent once per stream where they are large.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use prost::Message;
use starlings_models::{Job, Signal, Window};
use starlings_proto::{
    JobEncoder, Lease, ProtocolError, ReceivedWindows, SentWindows, State, ToWorker, generated,
};

fn through_bytes(message: &generated::ToWorker) -> generated::ToWorker {
    generated::ToWorker::decode(message.encode_to_vec().as_slice()).unwrap()
}

/// What a worker makes of the first message of a stream.
fn decode(message: generated::ToWorker) -> Result<ToWorker, ProtocolError> {
    ToWorker::decode(message, &mut ReceivedWindows::default())
}

const LEASE: Lease = Lease { epoch: 1, job: 2, attempt: 1 };

#[test]
fn the_windows_of_a_batch_are_encoded_once_and_shared_by_its_messages() {
    let window = |start: f64| {
        let signal = Signal { times: vec![start, start + 1.0], values: vec![0.0, 1.0] };
        Arc::new(Window::free(start, vec![start + 0.5], 1, vec![signal]))
    };
    let windows = [window(0.0), window(1.0)];
    // Particle by particle, as an ensemble over two records travels.
    let job = |k: usize| {
        let (particle, record, window) = (k as u32 / 2, k as u32 % 2, Arc::clone(&windows[k % 2]));
        Job { particle, record, window, theta: vec![k as f64], state: None }
    };
    let jobs: Vec<Job<State>> = (0..6).map(job).collect();
    let mut encoder = JobEncoder::of(&jobs);
    let mut times_of = |job: &Job<State>| {
        let (_, sent) = encoder.encode(LEASE, &[7; 32], job, &mut SentWindows::default());
        let Some(generated::to_worker::Kind::Job(message)) = sent.kind else { panic!("a job") };
        let Some(generated::job::Over::Window(window)) = message.over else { panic!("a small window") };
        window.times.as_ptr()
    };
    let places: Vec<_> = jobs.iter().map(&mut times_of).collect();
    assert!(places.iter().enumerate().all(|(k, place)| *place == places[k % 2]), "{places:?}");
    assert_ne!(places[0], places[1]);
}

/// Jobs of two particles over a window of 16 000 bytes for each array.
fn jobs_over_a_large_window() -> [Job<State>; 2] {
    let times: Vec<f64> = (0..2000).map(f64::from).collect();
    let signal = Signal { times: times.clone(), values: times.clone() };
    let window =
        Arc::new(Window { start: 0.0, observed: times.clone(), times, inputs: vec![signal], since: vec![] });
    [0, 1].map(|particle| {
        let window = Arc::clone(&window);
        Job { particle, record: 0, window, theta: vec![f64::from(particle)], state: None }
    })
}

#[test]
fn a_large_window_travels_once_on_a_stream_and_its_jobs_share_it() {
    let jobs = jobs_over_a_large_window();
    // Two batches over two streams.
    for (mut sent, mut received) in [Default::default(), Default::default()] {
        let mut travelled = 0;
        for batch in 0..2 {
            let mut encoder = JobEncoder::of(&jobs);
            let arrived = jobs.each_ref().map(|job| {
                let (ahead, message) = encoder.encode(LEASE, &[7; 32], job, &mut sent);
                if let Some(ahead) = ahead {
                    travelled += 1;
                    assert_eq!(ToWorker::decode(through_bytes(&ahead), &mut received), Ok(ToWorker::Window));
                }
                assert!(message.encoded_len() < 200, "{batch}");
                match ToWorker::decode(through_bytes(&message), &mut received) {
                    Ok(ToWorker::Job { job, .. }) => job,
                    other => panic!("{other:?}"),
                }
            });
            assert_eq!(arrived, jobs);
            assert!(Arc::ptr_eq(&arrived[0].window, &arrived[1].window), "one copy of it");
        }
        assert_eq!(travelled, 1);
    }
}

#[test]
fn a_stream_that_lost_a_window_is_broken_and_not_the_job() {
    let [job, _] = jobs_over_a_large_window();
    let (ahead, message) = JobEncoder::default().encode(LEASE, &[7; 32], &job, &mut SentWindows::default());
    assert_eq!(decode(message), Err(ProtocolError::UnknownWindow));
    let Some(generated::ToWorker { kind: Some(generated::to_worker::Kind::Window(mut window)) }) = ahead
    else {
        panic!("the window is sent ahead")
    };
    window.window.as_mut().unwrap().start = Some(0.5);
    let damaged = decode(generated::ToWorker { kind: Some(generated::to_worker::Kind::Window(window)) });
    assert!(matches!(damaged, Err(ProtocolError::Shape { field: "window", .. })), "{damaged:?}");
}
