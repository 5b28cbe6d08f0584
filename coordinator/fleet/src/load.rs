//! How much work a fleet has, for whoever starts and ends its workers.
//!
//! Next file to read: [`super::handle`].

/// Work and workers at one moment.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Load {
    /// Jobs of the running batch without an outcome: those that wait and those that run.
    pub unfinished: usize,
    /// The workers, in the order in which they joined.
    pub workers: Vec<WorkerLoad>,
}

/// What one worker has to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerLoad {
    /// Its name in events, `NUMBER@HOST/PROCESS`.
    pub name: String,
    /// Runs that it makes at the same time.
    pub slots: usize,
    /// Jobs that it was given and has not answered.
    pub jobs: usize,
}
