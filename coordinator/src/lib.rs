//! The coordinator: sends particles to the fleet, runs the study, stores and reports it.
//!
//! Floors, imports go down only: [`fleet`] dispatches jobs and knows no study; [`study`] runs the loop and writes the store;
//! [`report`] reads only what the store holds. Next file to read: [`study`].

pub mod explain;
pub mod fleet;
pub mod report;
pub mod study;
