//! The page of an explanation: what the model lacks, where that shows, and the gap before and after.
//!
//! Made from the explanation and the data of its figures alone; nothing is fitted or judged here. The verdict and the warnings come
//! before any number. Next files to read: [`figures`], [`effect`], [`gap`], [`disagreement`], [`candidates`], and the template `explain/explain.html`.

mod candidates;
mod disagreement;
mod effect;
mod figures;
mod gap;
#[cfg(test)]
mod sample;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};
use starlings_explain::result::{Experiment, Explanation};
use starlings_explain::{Figures, Probabilities, Verdict};

use super::plot::figure::Slots;
use super::{ReportError, layout, number};
use candidates::Candidates;
use disagreement::Disagreement;
use effect::EffectView;
use gap::Gap;

/// What the page says of the study besides the explanation. Empty texts are left out.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct StudyAbout {
    /// What the study is about.
    pub(crate) says: String,
    /// The command that makes this explanation again.
    pub(crate) command: String,
    /// When it was started.
    pub(crate) started: String,
    /// Version of the program.
    pub(crate) version: String,
    /// Names of the model's states: a term added to one of them is written as a rate of change.
    pub(crate) states: Vec<String>,
}

/// Makes the page of an explanation: one HTML document that refers to nothing outside itself.
///
/// # Errors
///
/// [`ReportError`] when a figure or the page cannot be made; data that are missing are shown as missing.
pub(crate) fn explain_page(
    explanation: &Explanation,
    figures: &Figures,
    about: &StudyAbout,
) -> Result<String, ReportError> {
    layout::document(include_str!("explain/explain.html"), Page::new(explanation, figures, about)?)
}

/// The page, ready to be arranged.
#[derive(Debug, Serialize)]
struct Page<'a> {
    found: &'a Explanation,
    about: &'a StudyAbout,
    verdict: &'static str,
    verdict_words: &'static str,
    /// How probable each answer is, in words.
    probable: Vec<String>,
    facts: Vec<(&'static str, String)>,
    figures: Slots,
    gap: Gap,
    /// Whether rows have to say which record they are of.
    several_records: bool,
    curves_left_out: usize,
    failing: Vec<String>,
    effect_title: &'static str,
    effects: Vec<EffectView>,
    ties: Vec<String>,
    separation: String,
    experiments: Vec<[String; 2]>,
    disagreement: Disagreement,
    candidates: Candidates,
    shifts: Vec<gap::ShiftRow>,
    remaining: Vec<(&'static str, String)>,
    stages: Vec<(String, String)>,
}

impl<'a> Page<'a> {
    fn new(found: &'a Explanation, data: &'a Figures, about: &'a StudyAbout) -> Result<Self, ReportError> {
        let (verdict, verdict_words) = match found.verdict {
            Verdict::Named => ("named", "Named"),
            Verdict::Tie => ("tie", "Tie"),
            Verdict::Unexplained => ("unexplained", "Unexplained"),
            Verdict::NoGap => ("no-gap", "No gap"),
        };
        let nearest = found.effects.is_empty() && !found.closest.is_empty();
        let shown = if nearest { &found.closest } else { &found.effects };
        let experiment = found.experiment.as_ref();
        Ok(Self {
            found,
            about,
            verdict,
            verdict_words,
            probable: found.probabilities.as_ref().map(Probabilities::lines).unwrap_or_default(),
            facts: facts(found, about),
            figures: figures::draw(found, data)?,
            gap: Gap::new(found, data),
            several_records: data.curves.iter().any(|curve| curve.record != data.curves[0].record),
            curves_left_out: figures::course::left_out(data),
            failing: failing(found),
            effect_title: match found.verdict {
                _ if nearest => "What came nearest",
                Verdict::Tie => "The best of the tied effects",
                _ => "The missing effect",
            },
            effects: shown.iter().map(|effect| EffectView::new(effect, &about.states)).collect(),
            ties: found.ties(),
            separation: experiment.map_or_else(String::new, Experiment::sentence),
            experiments: experiment.map_or(Vec::new(), effect::experiments),
            disagreement: Disagreement::new(found, data),
            candidates: Candidates::new(found, data),
            shifts: found.parameter_shifts.iter().map(gap::ShiftRow::new).collect(),
            remaining: remaining(found),
            stages: found.runs_by_stage.iter().map(|(stage, n)| (stage.clone(), n.to_string())).collect(),
        })
    }
}

/// The held-out data that fail, in words.
fn failing(found: &Explanation) -> Vec<String> {
    let several = found.held_out.iter().any(|h| h.record != found.held_out[0].record);
    found.held_out.iter().filter(|h| h.fails).map(|h| h.says(several)).collect()
}

fn facts(found: &Explanation, about: &StudyAbout) -> Vec<(&'static str, String)> {
    let mut facts = vec![
        ("Model", found.model.clone()),
        ("Model runs", found.runs.to_string()),
        ("Workers", found.workers.to_string()),
        ("Wall time", number::duration(found.wall_s)),
        ("Started", number::date(&about.started)),
    ];
    facts.retain(|(_, text)| !text.is_empty());
    facts
}

fn remaining(found: &Explanation) -> Vec<(&'static str, String)> {
    let left = &found.remaining;
    let noise = found.correlated_noise.iter().map(|noise| ("Noise that is correlated in time", noise.says()));
    let mut facts = vec![
        ("Training RMSE over noise (1 expected)", number::significant(left.rmse_over_noise, 3)),
        (
            "Probability of such autocorrelation in white residuals",
            if left.whiteness_tested {
                probability(left.whiteness_p)
            } else {
                "too few values to tell".to_owned()
            },
        ),
    ];
    facts.extend(noise);
    facts
}

/// A probability; below a thousandth only its order matters.
fn probability(p: f64) -> String {
    if p.is_finite() && p < 1e-3 { "< 0.001".to_owned() } else { number::with_sd(p, 0.01) }
}
