//! A whole inference on a page: recordings, blocks, sums, posterior, tables.
//!
//! Next file to read: `gather.rs`.

use starlings_estimators::inference::{Fit, Sums};
use starlings_fleet::Fleet;
use starlings_models::Setup;
use starlings_study::Study;
use starlings_study::infer_choice::{InferChoice, MeasuredChoice};
use starlings_sums::Question;

use crate::answer::{Answer, fit};
use crate::blocks::{Cut, Start, start};
use crate::convergence::Convergence;
use crate::error::InferError;
use crate::gather::{Gathered, Work};
use crate::reduced::fit_reduced;
use crate::result::{Converging, Inference, RecordUsed};
use crate::smoothed::{not_converged, smoothed};
use crate::words;

/// Blocks that a recording is cut into where the study does not say, as far as their sizes allow.
const BLOCKS: f64 = 64.0;
/// Steps of such a block, at least and at most.
const LEAST: usize = 256;
const MOST: usize = 65_536;

/// Where an inference stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Blocks whose sums are there.
    pub n_block: u64,
    /// Steps in them.
    pub n_step: u64,
    /// Workers now.
    pub workers: usize,
}

/// What is asked, once the first recording has said its step.
pub(crate) struct Asked<'a> {
    pub(crate) choice: &'a InferChoice,
    pub(crate) setup: Setup,
    pub(crate) question: Question,
    pub(crate) fit: Fit,
}

/// Infers drift and noise of a study that was read for it ([`Study::load_for_inference`]).
///
/// # Errors
/// When a recording is not what it should be, an estimate cannot be made, or the fleet fails.
pub fn infer(
    study: &Study,
    fleet: &mut dyn Fleet,
    watch: &mut dyn FnMut(&Progress),
) -> Result<Inference, InferError> {
    let choice = choice(study)?;
    let Some(first) = choice.records.first() else {
        return Err(InferError::Setting("the study has no record to infer from".to_owned()));
    };
    let at = start(first)?;
    let asked = asked(study, choice, at.step)?;
    let cut = cut(choice, &asked, at);
    let levels = choice.sums.levels;
    let work = Work { setup: &asked.setup, question: &asked.question, records: &choice.records, cut, levels };
    let mut convergence = Convergence::new(&asked.fit, &asked.question.structure);
    let mut told = |gathered: &Gathered, fleet: &dyn Fleet| {
        convergence.look(gathered);
        let n_step = gathered.levels.first().map_or(0, Sums::n_step);
        watch(&Progress { n_block: gathered.n_block, n_step, workers: fleet.n_workers() });
        Ok(())
    };
    let gathered = work.gather(fleet, &mut told)?;
    let mut answer = Answer::of(choice, &asked.fit, &asked.question.structure, &gathered.levels)?;
    if let MeasuredChoice::Known(sd) = choice.measured {
        let found = smoothed(&asked.question, &asked.fit, &choice.records, cut, sd)?;
        answer.doubts = not_converged(found.converged, found.log_likelihood.len()).into_iter().collect();
        (answer.posterior, answer.extrapolated) = (found.posterior, None);
    }
    let convergence = match gathered.levels.first() {
        Some(sums) => convergence.finish(gathered.n_block, sums, &answer.posterior),
        None => Vec::new(),
    };
    told_of(study, &asked, &gathered, &answer, cut, convergence)
}

/// What the study asks.
pub(crate) fn choice(study: &Study) -> Result<&InferChoice, InferError> {
    let missing = || InferError::Setting("the study was not read for an inference".to_owned());
    study.infer.as_deref().ok_or_else(missing)
}

/// The question at a sampling step.
pub(crate) fn asked<'a>(study: &Study, choice: &'a InferChoice, step: f64) -> Result<Asked<'a>, InferError> {
    let mut sums = choice.sums.clone();
    if sums.step <= 0.0 {
        sums.step = step;
    }
    let setup = Setup { sums: Some(Box::new(sums)), ..study.setup.clone() };
    let question = Question::of(&setup)?;
    let fit = fit(choice, &question.structure)?;
    Ok(Asked { choice, setup, question, fit })
}

fn cut(choice: &InferChoice, asked: &Asked<'_>, at: Start) -> Cut {
    let sums = asked.setup.sums.as_deref();
    let usual = ((at.n_row / BLOCKS) as usize).clamp(LEAST, MOST);
    Cut {
        step: sums.map_or(at.step, |sums| sums.step),
        block: choice.block.unwrap_or(usual).min(choice.most_steps),
        ahead: choice.sums.n_ahead(),
        breaks: choice.breaks,
    }
}

/// The tables.
fn told_of(
    study: &Study,
    asked: &Asked<'_>,
    gathered: &Gathered,
    answer: &Answer,
    cut: Cut,
    convergence: Vec<Converging>,
) -> Result<Inference, InferError> {
    let choice = asked.choice;
    let structure = &asked.question.structure;
    let means = answer.means();
    let reduced =
        choice.reduced.as_ref().map(|reduced| fit_reduced(reduced, structure, &answer.posterior, &means));
    let reduced = reduced.transpose()?;
    let coefficients = answer.coefficients(choice);
    let n_step = gathered.levels.first().map_or(0, Sums::n_step);
    let records = choice.records.iter().enumerate();
    let warnings = words::warnings(choice, answer, reduced.as_ref());
    Ok(Inference {
        study: study.name.clone(),
        verdict: words::verdict(n_step, &coefficients, reduced.as_ref()),
        time_unit: study.time_unit.clone(),
        records: records
            .map(|(k, r)| RecordUsed {
                name: r.name.clone(),
                n_step: gathered.steps[k],
                span: gathered.spans[k],
            })
            .collect(),
        step: cut.step,
        n_step,
        block: cut.block,
        equations: structure.equations().to_vec(),
        coefficients,
        diffusion: answer.diffusion(choice),
        noise_checks: answer.checks.clone(),
        richardson: answer.richardson(),
        reduced,
        convergence,
        conditional_on: words::conditional_on(choice, answer),
        warnings: [study.warnings.clone(), warnings].concat(),
    })
}
