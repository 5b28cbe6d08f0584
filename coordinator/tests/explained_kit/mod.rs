//! The explanation of a study in this process, and recordings that are simulated with what it lacks.
#![allow(dead_code, missing_docs, unreachable_pub, clippy::unwrap_used)]

use starlings_coordinator::explain::{Context, ExplainError, Explanation, Options, check, explain};
use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::store::Store;
use starlings_coordinator::study::twin::{Twin, simulate};

use crate::study_kit::{Case, normals};

/// The explanation of a study in this process, after the checks of the command.
pub fn explained(case: &Case) -> Result<Explanation, ExplainError> {
    let (study, path) = (case.study(), case.fresh());
    check(&study, &Options::default())?;
    std::fs::create_dir_all(&path).unwrap();
    let store = Store::create(&path.join("run.db"), &[]).unwrap();
    let mut context = Context { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0 };
    explain(&study, &mut InProcess::new(2), &store, &mut context, &Options::of(&study)).map(|f| f.explanation)
}

/// What an instrument shows of these values: with errors of this sd, half of each of which stays in the next (AR(1)), on a display of this step.
pub fn displayed(clean: &[f64], sd: f64, step: f64, seed: u64) -> Vec<f64> {
    let mut error = 0.0;
    let shown = clean.iter().zip(normals(clean.len(), seed)).map(|(v, e)| {
        error = 0.5 * error + sd * 0.75_f64.sqrt() * e;
        ((v + error) / step).round() * step
    });
    shown.collect()
}

/// What a column holds of a recording that is made by this study with these values and effect, and noise of this sd.
pub fn noisy(
    truth: &Case,
    values: &[(&str, f64)],
    (effect, size): (&str, f64),
    column: &str,
    sd: f64,
) -> Vec<f64> {
    let twin = Twin {
        values: values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
        effects: vec![(effect.to_owned(), size)],
        seed: 1,
        ..Twin::default()
    };
    let made = simulate(&truth.study(), &twin).unwrap();
    let clean = &made.values[made.columns.iter().position(|c| c == column).unwrap()];
    clean.iter().zip(normals(clean.len(), 5)).map(|(v, e)| v + sd * e).collect()
}
