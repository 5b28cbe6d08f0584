//! What a run that was made again says, beside the one in the store.
//!
//! Next file to read: [`super::target`].

use serde::Serialize;

use crate::store::{Answer, JobRow, KeptRun};

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
    /// With an answer.
    Answer(Answer),
    /// The model failed, or a limit of time was hit.
    Failed(String),
    /// The program that stored it kept nothing of its answer.
    NotKept,
}

impl Ended {
    fn of(error: Option<&String>, answer: Option<Answer>) -> Self {
        match (error, answer) {
            (Some(error), _) => Self::Failed(error.clone()),
            (None, Some(answer)) => Self::Answer(answer),
            (None, None) => Self::NotKept,
        }
    }
}

/// What two runs with the same inputs have to do with each other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Agreement {
    /// Outputs and end state have the same bits.
    SameBits,
    /// They do not: how far the sums of the outputs are apart, as a share of the larger one; zero where only the end state, or the
    /// distribution over the outputs, is another.
    OtherBits {
        /// Relative difference of the sums of the outputs.
        relative: f64,
    },
    /// Both failed.
    BothFailed,
    /// One of them failed.
    OneFailed,
    /// The store does not have the answer of the first.
    Unknown,
}

impl Agreement {
    fn of(before: &Ended, now: &Ended) -> Self {
        match (before, now) {
            (Ended::NotKept, _) | (_, Ended::NotKept) => Self::Unknown,
            (Ended::Failed(_), Ended::Failed(_)) => Self::BothFailed,
            (Ended::Answer(before), Ended::Answer(now)) if before.is_same(now) => Self::SameBits,
            (Ended::Answer(before), Ended::Answer(now)) => {
                let largest = before.sum.abs().max(now.sum.abs());
                let apart = (before.sum - now.sum).abs();
                Self::OtherBits { relative: if largest > 0.0 { apart / largest } else { 0.0 } }
            }
            _ => Self::OneFailed,
        }
    }

    /// Whether nothing speaks against the two being the same.
    pub fn is_same(self) -> bool {
        matches!(self, Self::SameBits | Self::BothFailed)
    }
}

/// A run that was made again.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RemadeRun {
    /// Analysis within the pass, from 0.
    pub analysis: usize,
    /// Number of the particle.
    pub particle: u32,
    /// Record name.
    pub record: String,
    /// Parameters that the model was given, physical units; of a run that was made on the way to another none are told.
    pub values: Vec<(String, f64)>,
    /// How it ended in the store.
    pub before: Ended,
    /// How it ended now.
    pub now: Ended,
    /// Both beside each other.
    pub agreement: Agreement,
}

impl RemadeRun {
    pub(super) fn new(before: &KeptRun, now: &JobRow, values: Vec<(String, f64)>) -> Self {
        let ended = Ended::of(before.error.as_ref(), before.answer);
        let again = Ended::of(now.error.as_ref(), now.answer);
        let agreement = Agreement::of(&ended, &again);
        let record = before.record.clone();
        Self {
            analysis: before.step,
            particle: before.particle,
            record,
            values,
            before: ended,
            now: again,
            agreement,
        }
    }

    /// What it says, in a sentence.
    pub fn says(&self) -> String {
        let of = format!("over record `{}`", self.record);
        match (self.agreement, &self.before, &self.now) {
            (Agreement::SameBits, ..) => format!("{of}: the same bits, of every output and of the end state"),
            (Agreement::OtherBits { relative: 0.0 }, ..) => {
                format!("{of}: other bits, though the sum of the outputs is the same")
            }
            (Agreement::OtherBits { relative }, Ended::Answer(before), Ended::Answer(now)) => format!(
                "{of}: other bits; the sum of the outputs was {:?} and is {:?}, apart by {relative:.1e} of itself",
                before.sum, now.sum
            ),
            (Agreement::BothFailed, _, Ended::Failed(why)) => format!("{of}: it fails here too: {why}"),
            (_, Ended::Failed(why), _) => format!("{of}: it failed and does not fail here; it was: {why}"),
            (_, _, Ended::Failed(why)) => format!("{of}: it had an answer and fails here: {why}"),
            _ => format!("{of}: what it answered was not kept"),
        }
    }
}

/// What came of making a run again.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Replay {
    /// Number of the particle.
    pub particle: u32,
    /// Pass, from 1.
    pub pass: usize,
    /// Analysis within the pass, from 0.
    pub analysis: usize,
    /// The analysis from whose stored inputs those of the run were rebuilt; the same one where they are stored themselves.
    pub from: usize,
    /// Runs that were made, those that rebuilt the inputs included.
    pub n_run: u64,
    /// The run, over every record of the analysis; empty where its inputs could not be rebuilt.
    pub runs: Vec<RemadeRun>,
    /// The first run before it with other bits, after which nothing has the same inputs.
    pub earlier: Option<RemadeRun>,
    /// What differs from what made the first run and may change numbers.
    pub changed: Vec<String>,
}

impl Replay {
    /// Whether every run that was made agrees with the store.
    pub fn is_same(&self) -> bool {
        self.earlier.is_none() && self.runs.iter().all(|run| run.agreement.is_same())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)] // a failed unwrap is a failed test
    use starlings_fleet::Held;
    use starlings_models::Prediction;

    use super::*;

    fn run(outputs: &[f64], state: f64) -> Answer {
        Answer::of(&Prediction { outputs: outputs.to_vec(), state: Held::Values(vec![state]), cost: 0.0 })
    }

    fn remade(before: Result<Answer, &str>, now: Result<Answer, &str>) -> RemadeRun {
        let kept = KeptRun {
            step: 4,
            record: "rest".to_owned(),
            particle: 2,
            error: before.as_ref().err().map(|e| (*e).to_owned()),
            answer: before.ok(),
        };
        let job = JobRow {
            pass: 1,
            step: 4,
            record: "rest".to_owned(),
            particle: 2,
            attempts: 1,
            worker: String::new(),
            error: now.as_ref().err().map(|e| (*e).to_owned()),
            cost_s: 0.0,
            answer: now.ok(),
        };
        RemadeRun::new(&kept, &job, Vec::new())
    }

    #[test]
    fn how_far_two_answers_are_apart_is_told_and_failures_are_compared_too() {
        let one = run(&[1.0, 3.0], 0.5);
        let same = remade(Ok(one), Ok(one));
        assert!(same.agreement.is_same() && same.says().contains("the same bits"), "{}", same.says());
        let apart = remade(Ok(one), Ok(run(&[1.0, 4.0], 0.5)));
        // |4 − 5|/5, exactly.
        assert_eq!(apart.agreement, Agreement::OtherBits { relative: 0.2 });
        assert!(apart.says().contains("was 4.0 and is 5.0, apart by 2.0e-1"), "{}", apart.says());
        let of_state = remade(Ok(one), Ok(run(&[1.0, 3.0], 0.25)));
        assert!(
            !of_state.agreement.is_same() && of_state.says().contains("the sum of the outputs is the same")
        );
        let both = remade(Err("it broke"), Err("it broke"));
        assert!(
            both.agreement.is_same() && both.says().contains("fails here too: it broke"),
            "{}",
            both.says()
        );
        for one_of_them in [remade(Err("it broke"), Ok(one)), remade(Ok(one), Err("it broke"))] {
            assert_eq!(one_of_them.agreement, Agreement::OneFailed);
            assert!(one_of_them.says().contains("it broke"));
        }
    }
}
