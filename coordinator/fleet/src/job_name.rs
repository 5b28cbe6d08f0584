//! What a job is called: which sigma point, which record, which window. Its numbers are not here.

use starlings_models::Job;

/// What a job is called in events, and over which window it runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct JobName {
    /// Index of the sigma point.
    pub particle: u32,
    /// Index of the record.
    pub record: u32,
    /// Start and end of its window, the bits of the study times.
    pub span: [u64; 2],
}

impl JobName {
    /// The name of a job.
    pub(crate) fn of<S>(job: &Job<S>) -> Self {
        let window = &job.window;
        let end = window.times.last().copied().unwrap_or(window.start);
        Self { particle: job.particle, record: job.record, span: [window.start, end].map(f64::to_bits) }
    }
}
