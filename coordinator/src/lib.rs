//! The coordinator: sends particles to the fleet, runs the study, explains its misfit, stores and reports both.
//!
//! Floors, imports go down only: [`fleet`] dispatches jobs and knows no study; [`study`] runs the loop and writes the store;
//! [`explain`] says what a study's model lacks, by running versions of it; [`report`] reads only what the store holds. Next file
//! to read: [`study`].

pub mod explain;
pub mod fleet;
pub mod report;
pub mod study;
