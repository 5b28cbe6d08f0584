//! What is doubtful of a recording as a whole: steps that are coarse, noise that is not constant, coefficients that change.
//!
//! Next files to read: `coarse.rs`, `varying.rs`, `constancy.rs`.

use starlings_estimators::inference::NoiseCheck;
use starlings_study::infer_choice::{InferChoice, MeasuredChoice};

use crate::answer::Answer;
use crate::blocks::{Cut, Start};
use crate::coarse::{Coarse, coarse};
use crate::constancy::Changed;
use crate::gather::Gathered;
use crate::noise_words::{self, alike};
use crate::result::NoiseVaries;
use crate::run::Asked;
use crate::varying::{said, varies};
use crate::words;

/// What was found.
pub(crate) struct Doubts {
    coarse: Option<Coarse>,
    pub(crate) varies: Vec<NoiseVaries>,
    changed: Option<Changed>,
    /// Equations in which neighbouring residuals are alike.
    alike: Vec<NoiseCheck>,
    /// What is said of errors of the measurement that are given.
    given: Option<String>,
}

impl Doubts {
    /// Looks at the recordings that an answer is of. Its intervals hold noise that varies from here on.
    pub(crate) fn of(
        asked: &Asked<'_>,
        answer: &mut Answer,
        gathered: &Gathered,
        (cut, at): (Cut, Start),
    ) -> Self {
        let (choice, structure) = (asked.choice, &asked.question.structure);
        let sums = gathered.levels.first();
        // What an interpolation leaves in neighbouring residuals is taken out.
        let alike: Vec<NoiseCheck> =
            if choice.resample { Vec::new() } else { alike(&answer.checks, structure).cloned().collect() };
        // A memory of the noise feigns all of these.
        let is_white = alike.is_empty();
        let coarse = sums.filter(|_| is_white).and_then(|sums| coarse(asked, answer, sums, cut, at));
        let varies = if is_white { varies(asked, answer, gathered, coarse.is_some()) } else { Vec::new() };
        let given = match choice.measured {
            MeasuredChoice::Known(sd) => noise_words::of_given(sd, &answer.checks, sums, structure),
            _ => None,
        };
        // Rows that were interpolated or hold large errors share them, which the test of a change takes for independent.
        let is_plain = !choice.resample
            && choice.prefactor
            && !answer.fit.lag_corrected
            && is_white
            && !matches!(choice.measured, MeasuredChoice::Known(_));
        let changed = is_plain.then(|| gathered.stretches.changed(&answer.fit, structure)).flatten();
        Self { coarse, varies, changed: changed.filter(|changed| changed.shows(answer)), alike, given }
    }

    /// What is said of it; `cut` has the step.
    pub(crate) fn said(&self, choice: &InferChoice, answer: &Answer, cut: Cut, unit: &str) -> Vec<String> {
        let coarse = self.coarse.as_ref().map(|coarse| words::of_steps(coarse, cut.step, unit));
        let name = |changed: &Changed| choice.records[changed.record].name.clone();
        let changed = self.changed.as_ref().map(|changed| words::of_change(changed, &name(changed), unit));
        let of_noise = [
            noise_words::of_memory(&self.alike, cut.step, unit),
            noise_words::of_form(&answer.diffusion(choice).form, answer),
            self.given.clone(),
            noise_words::of_extrapolation(answer),
        ];
        let of_noise = of_noise.into_iter().flatten();
        of_noise.chain(coarse).chain(said(&self.varies, choice, answer)).chain(changed).collect()
    }
}
