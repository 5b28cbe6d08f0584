//! The plots of the report, one file per kind of figure.
//!
//! A figure is described as a [`scene::Scene`] (two axes and a list of marks) and drawn once, in `scene.rs`; nothing else
//! touches the drawing library. Text and colours are fixed in `palette.rs`. Next file to read: `scene.rs`.

pub(super) mod alarm;
pub(super) mod along;
pub(super) mod autocorrelation;
pub(super) mod axis;
pub(super) mod course;
pub(super) mod field_map;
pub(super) mod figure;
pub(super) mod fit;
pub(super) mod force;
pub(super) mod interval;
pub(super) mod mark;
pub(super) mod meter;
pub(super) mod nis;
pub(super) mod observer;
pub(super) mod palette;
pub(super) mod region;
pub(super) mod residual;
pub(super) mod run_times;
pub(super) mod scene;
pub(super) mod spectrum;
pub(super) mod thin;
mod ticked;
pub(super) mod track;
