//! A whole inference on a page: recordings, blocks, sums, posterior, tables.
//!
//! Next file to read: `gather.rs`.

use starlings_estimators::inference::{Fit, Sums};
use starlings_fleet::Fleet;
use starlings_models::Setup;
use starlings_study::Study;
use starlings_study::infer_choice::{InferChoice, InferRecord, MeasuredChoice};
use starlings_sums::Question;

use crate::answer::{Answer, fit};
use crate::blocks::{Cut, Start, start};
use crate::convergence::Convergence;
use crate::doubts::Doubts;
use crate::error::InferError;
use crate::file_blocks::files;
use crate::gather::{Gathered, Source, Work};
use crate::missing::Wider;
use crate::progress::{Progress, Teller};
use crate::reduced::{check_reduced, fit_reduced};
use crate::result::{Converging, Inference, MissingFound, RecordUsed};
use crate::strays::{beside, strays};
use crate::words;

/// Blocks that a recording is cut into where the study does not say, as far as their sizes allow.
const BLOCKS: f64 = 64.0;
/// Steps of such a block, at least and at most.
const LEAST: usize = 256;
const MOST: usize = 65_536;
/// Blocks from which on they are longer instead of more, up to twice as long: each is a job that is sent and answered.
const MANY: f64 = 512.0;

/// What is asked, once the first recording has said its step.
pub(crate) struct Asked<'a> {
    pub(crate) choice: &'a InferChoice,
    pub(crate) setup: Setup,
    pub(crate) question: Question,
    pub(crate) fit: Fit,
}

/// Who reads the recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reader {
    /// This process, for workers that do not see its files.
    Coordinator,
    /// The workers, every block for itself, where the files are plain rows.
    Workers,
}

/// Infers drift and noise of a study that was read for it ([`Study::load_for_inference`]).
///
/// # Errors
/// When a recording is not what it should be, an estimate cannot be made, or the fleet fails.
pub fn infer(
    study: &Study,
    fleet: &mut dyn Fleet,
    reader: Reader,
    watch: &mut dyn FnMut(&Progress),
) -> Result<Inference, InferError> {
    check(study)?;
    let choice = choice(study)?;
    let Some(first) = choice.records.first() else {
        return Err(InferError::Setting("the study has no record to infer from".to_owned()));
    };
    let at = start(first)?;
    let mut asked = asked(study, choice, at.step)?;
    let cut = cut(choice, &asked, at);
    asked.share_pairs(&choice.records, cut);
    let mut teller = Teller::new(choice, cut, at, watch);
    // The recordings are looked through while the fleet sums them.
    let (summed, strays) = std::thread::scope(|scope| {
        let looking = scope.spawn(|| strays(&asked, at, &study.time_unit));
        let summed = gathered(&asked, &choice.records, cut, fleet, (reader, &mut teller));
        (summed, looking.join().ok().flatten())
    });
    let (gathered, convergence) = summed?;
    let structure = &asked.question.structure;
    let answer = match choice.measured {
        MeasuredChoice::Known(sd) => Answer::smoothed(&asked, cut, sd, &gathered.levels, &mut teller),
        _ => Answer::of(choice, &asked.fit, structure, (&asked.question.basis, &gathered)),
    };
    let mut answer = answer.map_err(|error| beside(error, strays.as_ref()))?;
    let missing = missing(&asked, &answer.fit, &gathered, cut, fleet, (reader, &mut teller))?;
    teller.posterior();
    let convergence = convergence.finish(&answer.fit, structure, &gathered);
    let doubts = Doubts::of(&asked, &mut answer, &gathered, (cut, at));
    let beside = Beside { strays, convergence, missing, doubts };
    told_of(study, &asked, &gathered, &answer, cut, beside)
}

/// Terms that the drift lacks, where they are looked for: compared on the held-out records too, where there are any.
fn missing(
    asked: &Asked<'_>,
    fit: &Fit,
    of_all: &Gathered,
    cut: Cut,
    fleet: &mut dyn Fleet,
    ways: Ways<'_, '_>,
) -> Result<Option<MissingFound>, InferError> {
    let Asked { choice, question, .. } = asked;
    let (Some(settings), Some(structure)) = (choice.missing, &question.wider) else { return Ok(None) };
    let Some(sums) = of_all.levels.first() else { return Ok(None) };
    let held_out = match choice.held_out.as_slice() {
        [] => None,
        records => Some(gathered(asked, records, cut, fleet, ways)?.0),
    };
    let names = || choice.held_out.iter().map(|record| record.name.clone()).collect();
    let held_out = held_out.as_ref().and_then(|held_out| Some((held_out.levels.first()?, names())));
    Wider::new(structure, fit)?.look(choice, settings, sums, held_out).map(Some)
}

/// Who reads the recordings, and who is told.
type Ways<'a, 'w> = (Reader, &'a mut Teller<'w>);

/// Whether what a study asks fits together, before anything is read: functions, priors, the reduced model, what excludes one another.
///
/// # Errors
/// When it does not.
pub fn check(study: &Study) -> Result<(), InferError> {
    let choice = choice(study)?;
    // The step of the recording is not known yet, and nothing here depends on it.
    let asked = asked(study, choice, 1.0)?;
    if let Some(reduced) = &choice.reduced {
        check_reduced(reduced, &asked.question.structure)?;
    }
    if let Some(structure) = &asked.question.wider
        && structure.n_coefficient() == asked.question.structure.n_coefficient()
    {
        let message = "[infer.candidates] names no term that the model has not already: give others, or a larger `degree`";
        return Err(InferError::Setting(message.to_owned()));
    }
    if choice.resample && choice.sums.levels > 1 {
        let message = "`richardson` compares steps of a recording as it is: remove it, or `resample`";
        return Err(InferError::Setting(message.to_owned()));
    }
    let MeasuredChoice::Known(_) = choice.measured else { return Ok(()) };
    if choice.resample {
        let message = "a given `measurement_noise` is that of the rows, which `resample` mixes: remove one";
        return Err(InferError::Setting(message.to_owned()));
    }
    let refused =
        |what: &str| Err(InferError::Setting(format!("a given `measurement_noise` {what}, or use \"auto\"")));
    if choice.records.len() > 1 {
        return refused("smooths one recording: keep one record");
    }
    if choice.missing.is_some() {
        return refused(
            "smooths a path, and [infer.candidates] are scored by the recording as it was measured: remove one",
        );
    }
    if choice.breaks {
        return refused("smooths a recording without gaps: remove gaps = \"break\"");
    }
    if choice.sums.levels > 1 {
        return refused(
            "smooths at the sampling step, which `richardson` does not extrapolate: remove `richardson`",
        );
    }
    Ok(())
}

/// The sums of all blocks, and those on the way.
fn gathered(
    asked: &Asked<'_>,
    records: &[InferRecord],
    cut: Cut,
    fleet: &mut dyn Fleet,
    (reader, teller): Ways<'_, '_>,
) -> Result<(Gathered, Convergence), InferError> {
    let Asked { choice, setup, question, .. } = asked;
    let work = Work { setup, question, records, cut, levels: choice.sums.levels };
    let files = match reader {
        Reader::Workers => files(records, cut),
        Reader::Coordinator => None,
    };
    let sources = files.as_deref().map(Source::Files).into_iter().chain([Source::Rows]);
    for source in sources {
        let mut convergence = Convergence::default();
        let mut told = |gathered: &Gathered, next: Option<usize>, fleet: &dyn Fleet| {
            if next.is_none() {
                convergence.look(gathered);
            }
            let n_step = gathered.levels.first().map_or(0, Sums::n_step);
            teller.sums(gathered.n_block, n_step, next.unwrap_or(0), fleet);
        };
        if let Some(gathered) = work.gather(source, fleet, &mut told)? {
            teller.summed(gathered.levels.first().map_or(0, Sums::n_step));
            return Ok((gathered, convergence));
        }
    }
    Err(InferError::Unread)
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
    let long = ((at.n_row / MANY) as usize).min(2 * MOST).min(choice.most_steps);
    let usual = ((at.n_row / BLOCKS) as usize).clamp(LEAST, MOST).max(long);
    // Where the study does not say how many steps: by bytes, which nobody has to read the file for.
    let by_bytes =
        choice.block.is_none() && !choice.resample && usual <= choice.most_steps && at.n_row >= 1.0;
    Cut {
        bytes: by_bytes.then_some((usual as f64 * at.per_row) as u64),
        step: sums.map_or(at.step, |sums| sums.step),
        block: choice.block.unwrap_or(usual).min(choice.most_steps),
        ahead: choice.sums.n_ahead(),
        breaks: choice.breaks,
        resample: choice.resample,
    }
}

/// What is told beside the answer.
struct Beside {
    strays: Option<String>,
    convergence: Vec<Converging>,
    missing: Option<MissingFound>,
    doubts: Doubts,
}

/// The tables.
fn told_of(
    study: &Study,
    asked: &Asked<'_>,
    gathered: &Gathered,
    answer: &Answer,
    cut: Cut,
    beside: Beside,
) -> Result<Inference, InferError> {
    let choice = asked.choice;
    let Beside { strays, convergence, missing, doubts } = beside;
    let structure = &asked.question.structure;
    let means = answer.means();
    let reduced =
        choice.reduced.as_ref().map(|reduced| fit_reduced(reduced, structure, &answer.posterior, &means));
    let reduced = reduced.transpose()?;
    let coefficients = answer.coefficients(choice);
    let n_step = gathered.levels.first().map_or(0, Sums::n_step);
    let records = choice.records.iter().enumerate();
    let mut warnings: Vec<String> = strays.into_iter().collect();
    warnings.extend(words::warnings(choice, answer, reduced.as_ref(), missing.as_ref()));
    warnings.extend(doubts.said(choice, answer, cut, &study.time_unit));
    Ok(Inference {
        study: study.name.clone(),
        verdict: words::verdict(n_step, &coefficients, reduced.as_ref(), missing.as_ref()),
        file: std::path::absolute(&study.file).unwrap_or_else(|_| study.file.clone()).display().to_string(),
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
        covariance: answer.covariance(),
        diffusion: answer.diffusion(choice),
        noise_checks: answer.checks.clone(),
        noise_varies: doubts.varies,
        robust: answer.widened().is_some(),
        richardson: answer.richardson(),
        reduced,
        missing,
        convergence,
        convergence_of: words::convergence_of(choice, answer),
        conditional_on: words::conditional_on(choice, answer),
        warnings: [study.warnings.clone(), warnings].concat(),
    })
}
