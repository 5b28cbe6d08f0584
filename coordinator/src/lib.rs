//! The coordinator: sends particles to the fleet, runs the study, explains its misfit, stores and reports both.
//!
//! Ten crates, which import downwards only: [`fleet`] dispatches jobs and knows no study; [`study`] runs the loop and writes the
//! store; [`explain`] says what a study's model lacks, by running variants of it; [`infer`] finds drift and noise of stochastic
//! equations; [`diagnose`] says whether a recording shows a fault and which; [`report`] reads only what the store holds; [`metrics`]
//! tells a Prometheus what the fleet does; [`live`] shows people a run while it runs; [`draft`] writes first versions of studies from
//! files that people have. Here are their names for programs that
//! want all of them, and the tests that need more than one. Next file to read: [`study`].

pub use starlings_diagnose as diagnose;
pub use starlings_draft as draft;
pub use starlings_explain as explain;
pub use starlings_fleet as fleet;
pub use starlings_infer as infer;
pub use starlings_live as live;
pub use starlings_metrics as metrics;
pub use starlings_report as report;
pub use starlings_study as study;
