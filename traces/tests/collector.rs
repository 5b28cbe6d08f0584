//! Spans of two processes at one collector, which takes OTLP over HTTP.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

use std::net::TcpListener;
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

use axum::Router;
use axum::body::Bytes;
use axum::extract::State;
use axum::routing::post;
use opentelemetry_proto::tonic::collector::trace::v1::ExportTraceServiceRequest;
use opentelemetry_proto::tonic::trace::v1::Span;
use prost::Message;
use starlings_traces::{TraceParent, Traces};

async fn take(State(sender): State<Sender<Bytes>>, body: Bytes) {
    sender.send(body).unwrap();
}

#[test]
fn a_collector_gets_one_trace_of_what_began_in_two_processes() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.set_nonblocking(true).unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let (sender, taken) = channel();
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(listener).unwrap();
            let router = Router::new().route("/v1/traces", post(take)).with_state(sender);
            axum::serve(listener, router).await.unwrap();
        });
    });
    let open = |role| Traces::open(&url.parse().unwrap(), role, "0").unwrap();
    let (coordinator, worker) = (open("coordinator"), open("worker"));
    let run = coordinator.begin("run", None, [("starlings.particle", 3.into())]);
    // As it crosses: in words.
    let crossing: TraceParent = run.parent().to_string().parse().unwrap();
    worker.begin("compute", Some(&crossing), []).end_with(Some(&"too hot"));
    worker.close();
    run.end();
    coordinator.close();

    let spans = taken.try_iter().flat_map(|body| {
        let request = ExportTraceServiceRequest::decode(body).unwrap();
        let scopes = request.resource_spans.into_iter().flat_map(|resource| resource.scope_spans);
        scopes.flat_map(|scope| scope.spans).collect::<Vec<Span>>()
    });
    let spans = spans.collect::<Vec<_>>();
    let [compute, run] = &spans[..] else { panic!("{spans:?}") };
    assert_eq!((compute.name.as_str(), run.name.as_str()), ("compute", "run"));
    assert_eq!(compute.trace_id, run.trace_id);
    assert_eq!((&compute.parent_span_id, run.parent_span_id.len()), (&run.span_id, 0));
    assert_eq!(compute.status.as_ref().unwrap().message, "too hot");
    assert_eq!(run.attributes[0].key, "starlings.particle");
}

#[test]
fn a_collector_that_is_not_there_holds_nobody_up() {
    // A port that was free a moment ago.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let target = format!("http://{address}").parse().unwrap();
    let started = Instant::now();
    let traces = Traces::open(&target, "coordinator", "0").unwrap();
    for _ in 0..10_000 {
        traces.begin("run", None, []).end();
    }
    traces.close();
    assert!(started.elapsed() < Duration::from_secs(60), "{:?}", started.elapsed());
}
