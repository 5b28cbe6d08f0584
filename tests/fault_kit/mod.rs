//! Faults of the place while a study runs, injected at runs that are drawn from a seed, and what may come of them: the result
//! of an undisturbed run to the last byte, or an error that names the cause and a resume to that result.
//!
//! No sleeps: the solver itself meets the fault in its n-th run. Next files to read: [`plan`] for the faults, [`study_folder`] for a
//! study in a folder of its own, [`judge`] for what is asked of every case, [`table`] for the page of results.

#![allow(clippy::unwrap_used, dead_code)] // a failed unwrap is a failed test; each test uses its part

pub(crate) mod disk;
pub(crate) mod judge;
pub(crate) mod plan;
pub(crate) mod processes;
pub(crate) mod study_folder;
pub(crate) mod table;
