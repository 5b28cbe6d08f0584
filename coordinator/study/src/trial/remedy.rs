//! What to do about a trial run that fails: how many steps it takes, and whether a fixed step is too long.

use starlings_models::{ModelFailure, ParticleError, Window};

use crate::Study;

/// What to do about a failure; where steps were too many, with how many there would be.
pub(super) fn failure(study: &Study, error: &ParticleError, window: &Window) -> String {
    match error {
        ParticleError::Model(ModelFailure::TooManySteps { time, limit }) => {
            steps(study, [window.start, *time, last(window)], *limit)
        }
        ParticleError::Model(ModelFailure::NotFinite { .. }) => match too_long(study) {
            Some(shorter) => format!("check constants, priors and inputs; {shorter}"),
            None => "check constants, priors and inputs".to_owned(),
        },
        _ => "check constants, priors and inputs".to_owned(),
    }
}

/// What to do about a prediction that is far beyond all data.
pub(super) fn misfit(study: &Study) -> String {
    let units = "check units, and values that are codes for missing ones";
    too_long(study).map_or_else(|| units.to_owned(), |shorter| format!("{shorter}; else {units}"))
}

/// What a fixed step may have done.
fn too_long(study: &Study) -> Option<String> {
    let step = fixed_step(study)?;
    Some(format!(
        "a fixed step that is too long for the fastest part of the model makes a run grow without bounds: shorten `solver.step` in `[model]`, \
         {step}, or take `method = \"auto\"`, which chooses its steps"
    ))
}

/// The step of a method that does not choose its own.
fn fixed_step(study: &Study) -> Option<f64> {
    let solver = &study.setup.model.equations.as_ref()?.solver;
    solver.step.filter(|_| solver.method.has_fixed_step())
}

/// The step that a layout gives.
fn layout_step(study: &Study) -> Option<f64> {
    study.setup.model.layout.as_ref()?.get("step")?.as_f64()
}

/// How many steps there would be to the end, where so many were made until a time.
fn steps(study: &Study, [start, time, end]: [f64; 3], limit: u64) -> String {
    let done = (time - start) / (end - start);
    let known = fixed_step(study).or_else(|| layout_step(study)).map(|step| (end - start) / step);
    let all = if done > 0.0 { Some(limit as f64 / done) } else { known };
    let all = match all {
        Some(all) => format!("to t = {end} there would be about {}", rounded(all)),
        None => format!("to t = {end} there would be many times as many"),
    };
    format!(
        "{all}: a `step` of the model, a time constant or a tolerance is too short for the record; change it, or allow more \
         with `max_steps` in `[model]`"
    )
}

/// A number with two digits that count.
fn rounded(number: f64) -> String {
    let place = 10_f64.powf(number.log10().floor() - 1.0);
    if number < 1e6 { format!("{:.0}", (number / place).round() * place) } else { format!("{number:.1e}") }
}

fn last(window: &Window) -> f64 {
    window.times.last().copied().unwrap_or(window.start)
}

#[cfg(test)]
mod tests {
    use super::rounded;

    #[test]
    fn a_count_has_two_digits_that_count() {
        assert_eq!([2117.0, 45.3, 1_234_567.0].map(rounded), ["2100", "45", "1.2e6"]);
    }
}
