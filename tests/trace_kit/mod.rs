//! Spans as tests see them, and a collector that takes OTLP over HTTP.

#![allow(clippy::unwrap_used, dead_code)] // each test uses its part

use std::collections::{BTreeMap, BTreeSet};
use std::net::TcpListener;
use std::sync::{Arc, Mutex};

use axum::Router;
use axum::body::Bytes;
use axum::extract::State;
use axum::routing::post;
use opentelemetry_proto::tonic::collector::trace::v1::ExportTraceServiceRequest;
use opentelemetry_proto::tonic::common::v1::any_value::Value::StringValue;
use opentelemetry_proto::tonic::trace::v1::ResourceSpans;
use prost::Message;

/// A span with the role of its process; identifiers are hexadecimal, an empty parent is none.
#[derive(Debug)]
pub(crate) struct Span {
    pub(crate) role: String,
    pub(crate) name: String,
    pub(crate) trace: String,
    pub(crate) id: String,
    pub(crate) parent: String,
}

/// Expects the spans of one study: a trace whose root is the coordinator's study, below it its runs, and below each run at most its
/// computation by a worker. What a solver of such a computation is handed, for all of them.
///
/// # Panics
/// When they are anything else.
pub(crate) fn handed_by_one_trace(spans: &[Span]) -> BTreeSet<String> {
    let by_id: BTreeMap<&str, &Span> = spans.iter().map(|span| (span.id.as_str(), span)).collect();
    let roots = spans.iter().filter(|span| span.parent.is_empty()).collect::<Vec<_>>();
    let [root] = roots[..] else { panic!("{roots:?}") };
    assert_eq!((root.role.as_str(), root.name.as_str()), ("coordinator", "study"));
    assert!(spans.iter().all(|span| span.trace == root.trace), "{spans:?}");
    let above =
        |span: &Span| by_id.get(span.parent.as_str()).map(|span| (span.role.as_str(), span.name.as_str()));
    for span in spans {
        match span.name.as_str() {
            "run" => assert_eq!(above(span), Some(("coordinator", "study")), "{span:?}"),
            "compute" => {
                assert_eq!((span.role.as_str(), above(span)), ("worker", Some(("coordinator", "run"))));
            }
            other => assert_eq!(other, "study"),
        }
    }
    let computed: Vec<&Span> = spans.iter().filter(|span| span.name == "compute").collect();
    let parents: BTreeSet<&str> = computed.iter().map(|span| span.parent.as_str()).collect();
    assert!(!computed.is_empty() && parents.len() == computed.len(), "a run is computed once: {spans:?}");
    computed.iter().map(|span| format!("00-{}-{}-01", span.trace, span.id)).collect()
}

/// A collector of spans on a free port of loopback.
pub(crate) struct Collector {
    pub(crate) url: String,
    taken: Arc<Mutex<Vec<Span>>>,
}

impl Collector {
    pub(crate) fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let taken = Arc::<Mutex<Vec<Span>>>::default();
        let router = Router::new().route("/v1/traces", post(take)).with_state(Arc::clone(&taken));
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
            runtime.block_on(async {
                let listener = tokio::net::TcpListener::from_std(listener).unwrap();
                axum::serve(listener, router).await.unwrap();
            });
        });
        Self { url, taken }
    }

    /// What has come since the last time.
    pub(crate) fn taken(&self) -> Vec<Span> {
        std::mem::take(&mut *self.taken.lock().unwrap())
    }
}

async fn take(State(taken): State<Arc<Mutex<Vec<Span>>>>, body: Bytes) {
    let request = ExportTraceServiceRequest::decode(body).unwrap();
    taken.lock().unwrap().extend(request.resource_spans.into_iter().flat_map(of));
}

fn of(group: ResourceSpans) -> Vec<Span> {
    let hexadecimal =
        |bytes: &[u8]| bytes.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"));
    let role = group.resource.unwrap().attributes.into_iter().find(|one| one.key == "starlings.role");
    let Some(StringValue(role)) = role.and_then(|one| one.value?.value) else {
        panic!("a process has a role")
    };
    let spans = group.scope_spans.into_iter().flat_map(|scope| scope.spans);
    let span = spans.map(|span| Span {
        role: role.clone(),
        name: span.name,
        trace: hexadecimal(&span.trace_id),
        id: hexadecimal(&span.span_id),
        parent: hexadecimal(&span.parent_span_id),
    });
    span.collect()
}
