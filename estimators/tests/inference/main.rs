//! Dynamical inference on simulated recordings of known drift and noise.
#![allow(clippy::unwrap_used, missing_docs, unreachable_pub)]

mod errors;
mod kit;
mod lorenz;
mod merging;
mod tanks;
