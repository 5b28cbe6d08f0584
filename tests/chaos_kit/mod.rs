//! Many faults in one study, at moments drawn from a seed, and what must come of it: the posterior of an undisturbed run to the last
//! byte, every acknowledged run used, no hang, nothing left behind.
//!
//! A campaign is one study with a coordinator that listens and three workers that dial it: two through proxies that damage and hold
//! up what they carry, one over a link of its own that can go down. Next files to read: [`plan`] for the faults, [`studies`] for what is
//! run, [`campaign`] for how both meet, [`ending`] for what is asked, [`table`] for the page.

#![allow(clippy::unwrap_used, dead_code)] // a failed unwrap is a failed test; each test uses its part

pub(crate) mod campaign;
pub(crate) mod draw;
pub(crate) mod ending;
pub(crate) mod inject;
pub(crate) mod judge;
pub(crate) mod namespaces;
pub(crate) mod plan;
pub(crate) mod proxy;
pub(crate) mod solvers;
pub(crate) mod studies;
pub(crate) mod table;
pub(crate) mod workers;
