//! The toy fluid–structure systems against closed forms and tables that were computed independently, in another language.
//!
//! Units are cgs. Tables are printed with a fixed number of digits; half a unit of the last one is their tolerance.
#![allow(clippy::float_cmp, reason = "zeros and copies are exact")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
#![allow(clippy::unreadable_literal, reason = "tables as they are printed")]

mod elements;
mod kit;
mod layouts;
mod modes;
mod motion;
mod stokes;
mod windkessel;
