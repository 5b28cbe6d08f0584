//! Writes batches of spans: a line of JSON in a file, or a request to a collector.
//!
//! Both are `ExportTraceServiceRequest` of OTLP 1, as JSON and as protobuf. Next file to read: [`super::target`].

use std::fs::File;
use std::io::Write;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use opentelemetry_proto::tonic::collector::trace::v1::ExportTraceServiceRequest;
use opentelemetry_proto::transform::common::tonic::ResourceAttributesWithSchema;
use opentelemetry_proto::transform::trace::tonic::group_spans_by_resource_and_scope;
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::error::{OTelSdkError, OTelSdkResult};
use opentelemetry_sdk::trace::{SpanData, SpanExporter};
use prost::Message;

use super::{Target, TracesError};

/// How long a collector may take for one batch.
const PATIENCE: Duration = Duration::from_secs(5);

/// The way out.
#[derive(Debug)]
enum Way {
    File(File),
    Collector { agent: ureq::Agent, url: String },
}

/// Writes spans.
#[derive(Debug)]
pub(crate) struct Exporter {
    way: Mutex<Way>,
    resource: ResourceAttributesWithSchema,
}

impl Exporter {
    pub(crate) fn open(target: &Target) -> Result<Self, TracesError> {
        let way = match target {
            Target::File(path) => {
                let opened = File::options().create(true).append(true).open(path);
                Way::File(opened.map_err(|source| TracesError::File { path: path.clone(), source })?)
            }
            Target::Collector(url) => {
                let agent = ureq::Agent::config_builder().timeout_global(Some(PATIENCE)).build().into();
                Way::Collector { agent, url: url.clone() }
            }
        };
        Ok(Self { way: Mutex::new(way), resource: ResourceAttributesWithSchema::default() })
    }

    fn write(&self, batch: Vec<SpanData>) -> Result<(), String> {
        let resource_spans = group_spans_by_resource_and_scope(batch, &self.resource);
        let request = ExportTraceServiceRequest { resource_spans };
        match &mut *self.way.lock().unwrap_or_else(PoisonError::into_inner) {
            Way::File(file) => {
                // One write a line: those of several processes do not mix.
                let mut line = serde_json::to_vec(&request).map_err(|error| error.to_string())?;
                line.push(b'\n');
                file.write_all(&line).map_err(|error| error.to_string())
            }
            Way::Collector { agent, url } => {
                let sent = agent
                    .post(url.as_str())
                    .header("content-type", "application/x-protobuf")
                    .send(&request.encode_to_vec()[..]);
                sent.map(drop).map_err(|error| format!("{url}: {error}"))
            }
        }
    }
}

impl SpanExporter for Exporter {
    async fn export(&self, batch: Vec<SpanData>) -> OTelSdkResult {
        self.write(batch).map_err(|reason| {
            tracing::warn!(reason, "spans are lost");
            OTelSdkError::InternalFailure(reason)
        })
    }

    fn set_resource(&mut self, resource: &Resource) {
        self.resource = resource.into();
    }
}
