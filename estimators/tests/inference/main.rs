//! Dynamical inference on simulated recordings of known drift and noise.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs, unreachable_pub)]

mod calibration;
mod changes;
mod coarse;
mod constancy;
mod damaged;
mod decimated;
mod draws;
mod errors;
mod false_alarm;
mod kit;
mod longer;
mod lorenz;
mod measured;
mod measurement;
mod merging;
mod miss;
mod missing;
mod mixing;
mod motor;
mod noise_form;
mod properties;
mod robust;
mod tanks;
mod varying;
