//! What the fleet did, from the jobs and events of a run.
//!
//! A finished run is counted by its summary. Before that the counts are those of the stored jobs, which is what had been
//! done at the last whole analysis. Next file to read: [`super::super::data`].

use std::collections::BTreeMap;

use starlings_study::store::snapshot::{Counts, Snapshot};
use starlings_study::store::{Store, StoreError};
use starlings_study::summary::Summary;

use crate::data::{FleetEvent, FleetTable, RunTimeBin, RunTimes, WorkerRow};

/// Bins of the histogram of run times.
const BINS: usize = 24;

/// (worker, done, cost in s, attempts, pass) of one job.
type Job = (String, bool, f64, u64, u64);

/// Workers, counts, run times and events.
///
/// # Errors
/// When the database refuses or its content is damaged.
pub(super) fn table(store: &Store, summary: Option<&Summary>) -> Result<FleetTable, StoreError> {
    let jobs: Vec<Job> = store.rows(
        "SELECT worker, status = 'done', coalesce(cost_s, 0), attempts, pass FROM jobs ORDER BY id",
        |r| Ok((r.get(0)?, r.get(1)?, r.get(2)?, r.get(3)?, r.get(4)?)),
    )?;
    let events = store.rows("SELECT at_s, text FROM events ORDER BY id", |r| {
        Ok(FleetEvent { time_s: r.get(0)?, text: r.get(1)? })
    })?;
    let mut workers: BTreeMap<String, WorkerRow> = BTreeMap::new();
    for (name, done, cost, ..) in &jobs {
        let row = workers.entry(name.clone()).or_insert_with(|| WorkerRow {
            name: name.clone(),
            host: host_of(name).to_owned(),
            ..WorkerRow::default()
        });
        row.jobs += 1;
        row.failed += u64::from(!done);
        row.mean_s += cost;
    }
    let slots = slots(&events);
    for row in workers.values_mut() {
        let slots = slots.get(row.name.as_str());
        row.busy_share = summary.zip(slots).map(|(s, slots)| row.mean_s / s.wall_s / f64::from(*slots));
        row.mean_s /= row.jobs as f64;
    }
    let counts = match summary {
        Some(s) => Counts {
            total: s.runs.total,
            failed: s.runs.failed,
            retried: s.runs.retried,
            rescued: s.runs.rescued,
        },
        None => Counts { rescued: Snapshot::rescued(store)?, ..counted(&jobs) },
    };
    let costs = jobs.iter().filter(|(_, done, ..)| *done).map(|(_, _, cost, ..)| *cost).collect();
    Ok(FleetTable {
        workers: workers.into_values().collect(),
        runs_total: counts.total,
        runs_after: (jobs.len() as u64).saturating_sub(counts.total),
        failed: counts.failed,
        retried: counts.retried,
        rescued: counts.rescued,
        time_per_run: run_times(costs),
        events,
    })
}

/// The counts of the jobs of all analyses; the final forward run, pass 0, is none of them.
fn counted(jobs: &[Job]) -> Counts {
    let mut counts = Counts::default();
    for (_, done, _, attempts, _) in jobs.iter().filter(|(.., pass)| *pass > 0) {
        counts.total += 1;
        counts.failed += u64::from(!done);
        counts.retried += attempts.saturating_sub(1);
    }
    counts
}

/// Slots by worker, as the events tell: `worker NAME joined from HOST (process P, S slots, C cores)`.
fn slots(events: &[FleetEvent]) -> BTreeMap<&str, u32> {
    let joined = events.iter().filter_map(|event| {
        let (name, rest) = event.text.strip_prefix("worker ")?.split_once(" joined from ")?;
        let slots = rest.rsplit_once('(')?.1.split(", ").find_map(|part| part.strip_suffix(" slots"))?;
        Some((name, slots.parse().ok().filter(|n| *n > 0)?))
    });
    joined.collect()
}

/// The host in a worker's name, `number@host/process`.
fn host_of(worker: &str) -> &str {
    let after = worker.split_once('@').map_or(worker, |(_, rest)| rest);
    after.rsplit_once('/').map_or(after, |(host, _)| host)
}

/// Quantiles and histogram of the run times; `None` when nothing was timed.
fn run_times(mut costs: Vec<f64>) -> Option<RunTimes> {
    costs.retain(|c| *c > 0.0 && c.is_finite());
    costs.sort_by(f64::total_cmp);
    let last = costs.len().checked_sub(1)?;
    let quantile = |q: f64| costs[(q * last as f64).round() as usize];
    // The longest runs are few and far out: the bins end at the 99th percentile and the last one holds the rest.
    let (from, to) = (costs[0], quantile(0.99));
    let width = ((to - from) / BINS as f64).max(f64::MIN_POSITIVE);
    let mut bins: Vec<RunTimeBin> = (0..BINS)
        .map(|i| RunTimeBin { from: from + i as f64 * width, to: from + (i + 1) as f64 * width, count: 0 })
        .collect();
    for cost in &costs {
        bins[(((cost - from) / width) as usize).min(BINS - 1)].count += 1;
    }
    Some(RunTimes { min: costs[0], median: quantile(0.5), p95: quantile(0.95), max: costs[last], bins })
}
