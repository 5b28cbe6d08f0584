//! The page of metrics: names, units and help of every one, in the OpenMetrics text format.
//!
//! Next file to read: [`super::server`].

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, EncodeMetric, MetricEncoder, NoLabelSet};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::registry::{Registry, Unit};
use starlings_fleet::{Census, FAILURE_TYPES, RUN_TIME_BOUNDS, Reading, Readings, Tally};

/// What the page is made of.
#[derive(Clone)]
pub struct Source {
    fleet: Readings,
    version: &'static str,
    analyses: Arc<AtomicU64>,
}

impl Source {
    /// The numbers of a fleet, by this version of the program.
    pub fn new(fleet: Readings, version: &'static str) -> Self {
        Self { fleet, version, analyses: Arc::default() }
    }

    /// An analysis more is done.
    pub fn analysed(&self) {
        self.analyses.fetch_add(1, Ordering::Relaxed);
    }

    /// A look at the fleet; `None` once it is gone.
    pub(crate) fn read(&self) -> Option<Reading> {
        self.fleet.read()
    }

    /// The page; nothing once the fleet is gone.
    ///
    /// # Errors
    /// None that a string gives.
    pub fn page(&self) -> Result<Option<String>, fmt::Error> {
        let Some(reading) = self.read() else { return Ok(None) };
        let analyses = self.analyses.load(Ordering::Relaxed);
        let mut registry = Registry::default();
        registry.register_collector(Box::new(Page { reading, version: self.version, analyses }));
        let mut text = String::new();
        prometheus_client::encoding::text::encode(&mut text, &registry)?;
        Ok(Some(text))
    }
}

/// One page.
#[derive(Debug)]
struct Page {
    reading: Reading,
    version: &'static str,
    analyses: u64,
}

/// Workers that were found to give other results than others, and what became of it, by the kinds of their events.
const DISPUTES: [(&str, &str); 3] =
    [("excluded", "worker-excluded"), ("allowed", "workers-differ"), ("solver", "not-reproducible")];

impl Collector for Page {
    fn encode(&self, encoder: DescriptorEncoder<'_>) -> fmt::Result {
        let mut lines = Lines(encoder);
        let Self { reading: Reading { census, tally, .. }, .. } = self;
        lines.build(self.version)?;
        now(&mut lines, census)?;
        runs(&mut lines, tally)?;
        workers(&mut lines, tally)?;
        lines.counters(
            (
                "starlings_state",
                "Bytes of states of particles that crossed between coordinator and workers.",
                Some(&Unit::Bytes),
            ),
            "direction",
            &[("from_workers", tally.state_bytes_in), ("to_workers", tally.state_bytes_out)],
        )?;
        lines.counter("starlings_analyses", "Analyses of the estimator that are done.", self.analyses)
    }
}

/// Where the fleet stands.
fn now(lines: &mut Lines<'_>, census: &Census) -> fmt::Result {
    lines.gauges(
        ("starlings_queue_runs", "Runs that wait: for a worker, or at a worker for one of its slots."),
        "at",
        &[("coordinator", census.queued), ("worker", census.ahead)],
    )?;
    lines.gauges(
        ("starlings_slots", "Slots of the connected workers; a busy one has a run."),
        "state",
        &[("busy", census.busy), ("idle", census.slots - census.busy)],
    )?;
    lines.gauges(
        ("starlings_workers", "Connected workers; one that is set aside is given no runs for a while."),
        "state",
        &[("in_use", census.workers - census.aside), ("set_aside", census.aside)],
    )?;
    lines.gauge("starlings_batch_open_runs", "Runs of the batch that have no outcome yet.", census.open)
}

/// What came of the runs.
fn runs(lines: &mut Lines<'_>, tally: &Tally) -> fmt::Result {
    let failed: u64 = tally.failures.values().sum();
    lines.counters(
        ("starlings_runs", "Runs that workers have finished, those that repeat others included.", None),
        "result",
        &[("prediction", tally.predictions), ("failure", failed)],
    )?;
    let by_type = FAILURE_TYPES.map(|name| (name, tally.failures.get(name).copied().unwrap_or(0)));
    lines.counters(
        ("starlings_run_failures", "Runs without a prediction, by why.", None),
        "type",
        &by_type,
    )?;
    lines.histogram(tally)?;
    let repeated = "Runs given away to be compared with another worker's.";
    lines.counter("starlings_repeated_runs", repeated, tally.repeats)?;
    let disputes = DISPUTES.map(|(name, kind)| (name, of_kind(tally, kind)));
    let about = "Findings that workers give different results: one was excluded, it was allowed, the solver contradicts itself.";
    lines.counters(("starlings_disputes", about, None), "finding", &disputes)
}

/// Who came and went.
fn workers(lines: &mut Lines<'_>, tally: &Tally) -> fmt::Result {
    let counts = [
        (
            "starlings_worker_joins",
            "Connections of workers that were taken.",
            of_kind(tally, "worker-joined"),
        ),
        (
            "starlings_worker_reconnects",
            "Those of them by a process that had been connected before.",
            tally.reconnects,
        ),
        ("starlings_worker_leaves", "Connections of workers that ended.", of_kind(tally, "worker-left")),
    ];
    for (name, help, count) in counts {
        lines.counter(name, help, count)?;
    }
    let events = tally.events.iter().map(|(kind, count)| (*kind, *count)).collect::<Vec<_>>();
    lines.counters(("starlings_events", "Events of the fleet by their kind.", None), "kind", &events)
}

fn of_kind(tally: &Tally, kind: &str) -> u64 {
    tally.events.get(kind).copied().unwrap_or(0)
}

/// Writes one metric after the other.
struct Lines<'a>(DescriptorEncoder<'a>);

impl Lines<'_> {
    fn descriptor(
        &mut self,
        (name, help, unit): (&str, &str, Option<&Unit>),
        kind: MetricType,
        write: impl FnOnce(MetricEncoder<'_>) -> fmt::Result,
    ) -> fmt::Result {
        write(self.0.encode_descriptor(name, help, unit, kind)?)
    }

    fn build(&mut self, version: &'static str) -> fmt::Result {
        let about = ("starlings_build", "The program that this is.", None);
        self.descriptor(about, MetricType::Info, |mut metric| metric.encode_info(&[("version", version)]))
    }

    fn counter(&mut self, name: &str, help: &str, count: u64) -> fmt::Result {
        self.descriptor((name, help, None), MetricType::Counter, |metric| {
            ConstCounter::new(count).encode(metric)
        })
    }

    fn counters(
        &mut self,
        about: (&str, &str, Option<&Unit>),
        label: &'static str,
        counts: &[(&'static str, u64)],
    ) -> fmt::Result {
        self.descriptor(about, MetricType::Counter, |mut metric| {
            counts.iter().try_for_each(|(value, count)| {
                ConstCounter::new(*count).encode(metric.encode_family(&[(label, *value)])?)
            })
        })
    }

    fn gauge(&mut self, name: &str, help: &str, value: usize) -> fmt::Result {
        let value = ConstGauge::new(value as u64);
        self.descriptor((name, help, None), MetricType::Gauge, |metric| value.encode(metric))
    }

    fn gauges(
        &mut self,
        (name, help): (&str, &str),
        label: &'static str,
        values: &[(&'static str, usize)],
    ) -> fmt::Result {
        self.descriptor((name, help, None), MetricType::Gauge, |mut metric| {
            values.iter().try_for_each(|(state, value)| {
                ConstGauge::new(*value as u64).encode(metric.encode_family(&[(label, *state)])?)
            })
        })
    }

    fn histogram(&mut self, tally: &Tally) -> fmt::Result {
        let help = "Wall time of finished runs, as measured in their worker.";
        let bounds = RUN_TIME_BOUNDS.into_iter().chain([f64::INFINITY]);
        let buckets = bounds.zip(tally.run_times).collect::<Vec<_>>();
        let count = tally.run_times.iter().sum();
        let about = ("starlings_run_duration", help, Some(&Unit::Seconds));
        self.descriptor(about, MetricType::Histogram, |mut metric| {
            metric.encode_histogram::<NoLabelSet>(tally.run_seconds, count, &buckets, None)
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn a_page_has_every_count_with_its_unit_and_classes_that_add_up() {
        let mut run_times = [0; RUN_TIME_BOUNDS.len() + 1];
        (run_times[4], run_times[17]) = (7, 1);
        let tally = Tally {
            predictions: 6,
            failures: BTreeMap::from([("timeout", 2)]),
            run_times,
            run_seconds: 20_000.5,
            repeats: 3,
            events: BTreeMap::from([("worker-joined", 4), ("worker-excluded", 1)]),
            reconnects: 2,
            state_bytes_in: 80,
            state_bytes_out: 160,
        };
        let census = Census { workers: 3, aside: 1, slots: 6, busy: 4, queued: 9, ahead: 5, open: 18 };
        let reading = Reading { tally, census, has_ended: false };
        let mut registry = Registry::default();
        registry.register_collector(Box::new(Page { reading, version: "1.2.3", analyses: 11 }));
        let mut text = String::new();
        prometheus_client::encoding::text::encode(&mut text, &registry).expect("a string takes it");
        for line in [
            r#"starlings_build_info{version="1.2.3"} 1"#,
            r#"starlings_queue_runs{at="coordinator"} 9"#,
            r#"starlings_queue_runs{at="worker"} 5"#,
            r#"starlings_slots{state="busy"} 4"#,
            r#"starlings_slots{state="idle"} 2"#,
            r#"starlings_workers{state="set_aside"} 1"#,
            "starlings_batch_open_runs 18",
            r#"starlings_runs_total{result="prediction"} 6"#,
            r#"starlings_runs_total{result="failure"} 2"#,
            r#"starlings_run_failures_total{type="timeout"} 2"#,
            r#"starlings_run_failures_total{type="place"} 0"#,
            "# UNIT starlings_run_duration_seconds seconds",
            r#"starlings_run_duration_seconds_bucket{le="0.003"} 0"#,
            r#"starlings_run_duration_seconds_bucket{le="0.01"} 7"#,
            r#"starlings_run_duration_seconds_bucket{le="+Inf"} 8"#,
            "starlings_run_duration_seconds_sum 20000.5",
            "starlings_run_duration_seconds_count 8",
            "starlings_repeated_runs_total 3",
            r#"starlings_disputes_total{finding="excluded"} 1"#,
            "starlings_worker_joins_total 4",
            "starlings_worker_reconnects_total 2",
            r#"starlings_state_bytes_total{direction="from_workers"} 80"#,
            r#"starlings_events_total{kind="worker-joined"} 4"#,
            "starlings_analyses_total 11",
            "# EOF",
        ] {
            assert!(text.lines().any(|have| have == line), "{line} is missing in\n{text}");
        }
    }
}
