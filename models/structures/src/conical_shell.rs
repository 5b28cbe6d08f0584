//! A thin conical shell, clamped at its small end and free at the other, as the nozzle of an engine: bending vibration under a point load.
//!
//! Donnell's equations: good for four waves around or more; for two the neglected in-plane inertia alone is a tenth of the frequency. No
//! pressure, no flow inside. Next file to read: `conical_shell/ritz.rs`, then `conical_shell/model.rs`.

mod layout;
mod legendre;
mod model;
mod ritz;

pub use layout::Layout;
pub use model::ConicalShell;
pub use ritz::{Cone, Ritz, ShellMode, Wall};
