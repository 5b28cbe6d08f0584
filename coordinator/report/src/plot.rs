//! What the figures of every page are drawn with.
//!
//! A figure is described as a [`scene::Scene`] (two axes and a list of marks) and drawn once, in `drawing.rs`. Colours are fixed in
//! `palette.rs`. The figures themselves stand with their page, in `page/figures.rs`, `explain/figures.rs` and
//! `identify/figures.rs`. Next file to read: `scene.rs`.

pub(super) mod axis;
pub(super) mod drawing;
pub(super) mod figure;
pub(super) mod interval;
pub(super) mod mark;
pub(super) mod measured;
pub(super) mod meter;
pub(super) mod palette;
pub(super) mod scene;
pub(super) mod series;
pub(super) mod svg;
pub(super) mod thin;
