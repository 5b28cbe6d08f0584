//! The sections of a study file that hold settings only: `[explain]`, `[estimator]`, `[fleet]`.
//!
//! Next file to read: [`super::read`].

use super::table::Table;
use super::{EstimatorSection, ExplainSection, FleetSection};

/// Reads `[explain]`.
pub(super) fn explain(root: &Table<'_>) -> ExplainSection {
    let keys = ["hold_out_channels", "budget", "library", "without", "only", "max_effects"];
    let Some(t) = root.table("explain", "[explain]", &keys) else {
        return ExplainSection::default();
    };
    ExplainSection {
        hold_out_channels: t.texts("hold_out_channels"),
        budget: t.count("budget"),
        library: t.text("library"),
        without: t.texts("without"),
        only: t.texts("only"),
        max_effects: t.count("max_effects"),
    }
}

/// Reads `[estimator]`.
pub(super) fn estimator(root: &Table<'_>) -> EstimatorSection {
    let keys = [
        "kind",
        "points",
        "kappa",
        "root",
        "passes",
        "anneal",
        "spread",
        "resample",
        "max_iterations",
        "tolerance",
    ];
    let Some(t) = root.table("estimator", "[estimator]", &keys) else { return EstimatorSection::default() };
    EstimatorSection {
        kind: t.text("kind"),
        points: t.text("points"),
        kappa: t.number("kappa"),
        root: t.text("root"),
        passes: t.count("passes"),
        anneal: t.number("anneal"),
        spread: t.number("spread"),
        resample: t.text("resample"),
        max_iterations: t.count("max_iterations"),
        tolerance: t.number("tolerance"),
    }
}

/// Reads `[fleet]`.
pub(super) fn fleet(root: &Table<'_>) -> FleetSection {
    let keys = ["workers", "slots", "patience", "max_attempts", "timeout_factor"];
    let Some(t) = root.table("fleet", "[fleet]", &keys) else {
        return FleetSection::default();
    };
    FleetSection {
        workers: t.count("workers"),
        slots: t.count("slots"),
        patience: t.number("patience"),
        max_attempts: t.count("max_attempts"),
        timeout_factor: t.number("timeout_factor"),
    }
}
