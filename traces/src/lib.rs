//! One span per run, from the coordinator through the worker to the solver, as OTLP in a file or at a collector.
//!
//! A span tells when something began and ended and what it belonged to; no result depends on it. What belongs together crosses between
//! processes as the `traceparent` of the W3C recommendation "Trace Context" (2021). A file has a span as soon as it ends; for a collector
//! spans are gathered and sent by a thread of the OpenTelemetry SDK, and nobody waits for it. Next files to read: [`parent`],
//! [`target`].

mod export;
mod parent;
mod target;

use std::sync::Arc;

use opentelemetry::trace::{
    Span as _, SpanBuilder, SpanKind, Status, TraceContextExt, Tracer, TracerProvider,
};
use opentelemetry::{Context, KeyValue, Value};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{SdkTracer, SdkTracerProvider};

use export::Exporter;
pub use parent::TraceParent;
pub use target::{Target, TracesError};

/// Where spans are begun. Clones are the same.
#[derive(Clone)]
pub struct Traces(Arc<Shared>);

struct Shared {
    provider: SdkTracerProvider,
    tracer: SdkTracer,
}

impl Traces {
    /// Opens the file or remembers the collector; `role` is `coordinator` or `worker`.
    ///
    /// # Errors
    /// [`TracesError`] when the file cannot be written.
    pub fn open(target: &Target, role: &'static str, version: &'static str) -> Result<Self, TracesError> {
        let resource = Resource::builder_empty()
            .with_service_name("starlings")
            .with_attributes([
                KeyValue::new("service.version", version),
                KeyValue::new("starlings.role", role),
                KeyValue::new("process.pid", i64::from(std::process::id())),
            ])
            .build();
        let exporter = Exporter::open(target)?;
        let provider = SdkTracerProvider::builder().with_resource(resource);
        let provider = match target {
            // Before the answer of a run leaves: a worker that is killed afterwards has written it.
            Target::File(_) => provider.with_simple_exporter(exporter),
            Target::Collector(_) => provider.with_batch_exporter(exporter),
        };
        let provider = provider.build();
        let tracer = provider.tracer("starlings");
        Ok(Self(Arc::new(Shared { provider, tracer })))
    }

    /// Begins a span, below `parent` where there is one; else it is the first of a trace.
    pub fn begin(
        &self,
        name: &'static str,
        parent: Option<&TraceParent>,
        about: impl IntoIterator<Item = (&'static str, About)>,
    ) -> Span {
        let tracer = &self.0.tracer;
        let kind = if parent.is_some() { SpanKind::Consumer } else { SpanKind::Internal };
        let about: Vec<KeyValue> = about.into_iter().map(|(key, value)| KeyValue::new(key, value)).collect();
        let builder = SpanBuilder::from_name(name).with_kind(kind).with_attributes(about);
        let above = parent.map_or_else(Context::new, |parent| {
            Context::new().with_remote_span_context(parent.context().clone())
        });
        Span(tracer.build_with_context(builder, &above))
    }

    /// Writes what is gathered. What is begun later is lost.
    pub fn close(&self) {
        if let Err(error) = self.0.provider.shutdown() {
            tracing::warn!(%error, "spans are not written");
        }
    }
}

/// A value that says something of a span.
pub type About = Value;

/// A span; it ends when it is ended or dropped.
pub struct Span(opentelemetry_sdk::trace::Span);

impl Span {
    /// What a span below it has as its parent, here or in another process.
    pub fn parent(&self) -> TraceParent {
        TraceParent::of(self.0.span_context().clone())
    }

    /// Ends it.
    pub fn end(mut self) {
        self.0.end();
    }

    /// Ends it, with why what it stands for failed where it did.
    pub fn end_with(mut self, failure: Option<&impl std::fmt::Display>) {
        if let Some(failure) = failure {
            self.0.set_status(Status::error(failure.to_string()));
        }
        self.0.end();
    }
}
