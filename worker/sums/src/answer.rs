//! What a job answers, as numbers: its sums and a few pairs of its steps, or a fault of the recording.
//!
//! A fault of the recording is the same wherever the job runs. It is an answer and no failure, so that nobody makes the job again, and
//! it is told with its row. Next file to read: [`super::block_sums`].

use starlings_estimators::inference::{InferenceError, Pairs, Sums};

use crate::question::Question;

/// First number of a fault; sums begin with a number of steps.
const FAULT: f64 = -1.0;

/// Sums of a block.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockAnswer {
    /// Sums by level, the sampling step first.
    pub levels: Vec<Sums>,
    /// Times at which its first step starts and its last one ends.
    pub span: [f64; 2],
    /// Pairs of its steps.
    pub pairs: Pairs,
}

/// Why a block has no sums.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// A row, by its number in the record, is not what it should be.
    #[error(transparent)]
    Row(InferenceError),
    /// The bytes of a file are no plain rows, or the file is not the one that was described.
    #[error("the file cannot be read as it was described")]
    Unread,
}

/// Numbers of an answer, by what they are.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Unread,
    NonFinite,
    NotIncreasing,
    TimeJump,
    NonUniform,
}

const KINDS: [Kind; 5] =
    [Kind::Unread, Kind::NonFinite, Kind::NotIncreasing, Kind::TimeJump, Kind::NonUniform];

/// The numbers of sums, level after level, of the span and of pairs.
pub(crate) fn sums_values(levels: &[Sums], span: [f64; 2], pairs: &Pairs) -> Vec<f64> {
    let pairs = pairs.to_values().iter().copied();
    levels.iter().flat_map(Sums::to_values).chain(span).chain(pairs).collect()
}

/// The numbers of a fault; an error that speaks of no row is none.
pub(crate) fn fault_values(question: &Question, fault: &Fault) -> Option<Vec<f64>> {
    let names = question.basis.names();
    let (kind, row, a, b) = match fault {
        Fault::Unread => (Kind::Unread, 0, 0.0, 0.0),
        Fault::Row(InferenceError::NonFinite { row, what, value }) => {
            let at = names.iter().position(|name| name == what).unwrap_or(names.len());
            (Kind::NonFinite, *row, at as f64, sign(*value))
        }
        Fault::Row(InferenceError::NotIncreasing { row, before, time }) => {
            (Kind::NotIncreasing, *row, *before, *time)
        }
        Fault::Row(InferenceError::TimeJump { row, before, time, .. }) => {
            (Kind::TimeJump, *row, *before, *time)
        }
        Fault::Row(InferenceError::NonUniform { row, got, .. }) => (Kind::NonUniform, *row, *got, 0.0),
        Fault::Row(_) => return None,
    };
    let kind = KINDS.iter().position(|known| *known == kind)?;
    Some(vec![FAULT, kind as f64, row as f64, a, b])
}

/// What the numbers of a job say.
///
/// # Errors
/// As for [`Sums::from_values`] and [`Pairs::from_values`]: too few numbers, or such that are neither sums and pairs nor a fault.
pub fn answer_of(
    question: &Question,
    step: f64,
    levels: u32,
    values: &[f64],
) -> Result<Result<BlockAnswer, Fault>, InferenceError> {
    if let [FAULT, rest @ ..] = values {
        return fault_of(question, step, rest).map(Err);
    }
    let n = Sums::n_value(&question.basis);
    let (expected, got) = (n * levels as usize + 2, values.len());
    if expected > got {
        return Err(InferenceError::Shape { what: "numbers of block sums", expected, got });
    }
    let (values, pairs) = values.split_at(expected);
    let (sums, span) = values.split_at(expected - 2);
    let level = |(k, values)| Sums::from_values(&question.basis, step * f64::from(1_u32 << k), values);
    let levels = sums.chunks_exact(n).enumerate().map(level).collect::<Result<Vec<_>, _>>()?;
    let pairs =
        Pairs::from_values(&question.basis, levels.first().map_or(0, Sums::n_step), question.pairs, pairs)?;
    let span = [span[0], span[1]];
    if !(span[0] <= span[1] && span.iter().all(|end| end.is_finite())) {
        return Err(InferenceError::Damaged { what: "the times of a block" });
    }
    Ok(Ok(BlockAnswer { levels, span, pairs }))
}

fn fault_of(question: &Question, step: f64, values: &[f64]) -> Result<Fault, InferenceError> {
    let damaged = || InferenceError::Damaged { what: "the fault of a block" };
    let [kind, row, a, b] = *values else { return Err(damaged()) };
    let whole = |value: f64| {
        let is_whole = (0.0..9e15).contains(&value) && value.fract().abs() <= 0.0;
        if is_whole { Ok(value as u64) } else { Err(damaged()) }
    };
    let (kind, row) = (KINDS.get(whole(kind)? as usize).ok_or_else(damaged)?, whole(row)?);
    Ok(match kind {
        Kind::Unread => Fault::Unread,
        Kind::NonFinite => {
            let name = question.basis.names().get(whole(a)? as usize);
            let what = name.map_or_else(|| "the square or a slope of a function".to_owned(), Clone::clone);
            let value = if b.abs() > 0.0 { f64::INFINITY.copysign(b) } else { f64::NAN };
            Fault::Row(InferenceError::NonFinite { row, what, value })
        }
        Kind::NotIncreasing => Fault::Row(InferenceError::NotIncreasing { row, before: a, time: b }),
        Kind::TimeJump => Fault::Row(InferenceError::TimeJump { row, before: a, time: b, step }),
        Kind::NonUniform => Fault::Row(InferenceError::NonUniform { row, got: a, step }),
    })
}

/// Which of NaN and the two infinities a value is, as a number that travels.
fn sign(value: f64) -> f64 {
    if value.is_nan() { 0.0 } else { 1.0_f64.copysign(value) }
}
