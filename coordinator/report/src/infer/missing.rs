//! What the page says of terms that the drift may lack.

use serde::Serialize;
use starlings_infer::result::{CoefficientFound, MissingFound};

use super::{Row, coefficient};
use crate::number;

/// The section, ready to be arranged.
#[derive(Debug, Serialize)]
pub(super) struct MissingTerms {
    n_candidate: usize,
    /// Lines of the named terms, with χ².
    named: Vec<(Row, String)>,
    /// The coefficients fitted together with them.
    with_named: Vec<Row>,
    /// Candidates by themselves: name, χ², probability by chance.
    strongest: Vec<[String; 3]>,
    note: String,
}

impl MissingTerms {
    pub(super) fn new(found: &MissingFound) -> Self {
        let named = found.named.iter().map(|named| {
            let of = |c: &&CoefficientFound| c.name == named.name;
            let row = found.coefficients.iter().find(of).map(coefficient);
            let row = row.unwrap_or_else(|| Row { name: named.name.clone(), ..Row::default() });
            (Row { says: named.ties.join(", "), ..row }, number::significant(named.chi_squared, 3))
        });
        let with_named = if found.named.is_empty() { &[][..] } else { &found.coefficients };
        let scored = found.strongest.iter();
        Self {
            n_candidate: found.candidates,
            named: named.collect(),
            with_named: with_named.iter().map(coefficient).collect(),
            strongest: scored
                .map(|s| [s.name.clone(), number::significant(s.chi_squared, 3), chance(s.by_chance)])
                .collect(),
            note: note(found),
        }
    }
}

fn chance(p: f64) -> String {
    if p <= 0.0 {
        return "below 1e-300".to_owned();
    }
    if p < 1e-3 { format!("{p:.0e}") } else { format!("{p:.3}") }
}

/// At which rate terms are named, what is left, what held-out records say.
fn note(found: &MissingFound) -> String {
    let mut note = vec![format!(
        "A term is named by chance in {} of a hundred searches of recordings that lack none.",
        number::significant(100.0 * found.false_alarm, 2)
    )];
    if let Some(left) = &found.left {
        note.push(format!(
            "The {} candidates that are not named have χ² {:.1} together, by chance {}.",
            left.terms,
            left.chi_squared,
            chance(left.by_chance)
        ));
    }
    if let Some(held_out) = found.held_out.as_ref().filter(|_| !found.named.is_empty()) {
        note.push(format!(
            "Over {} steps of held-out records ({}) the log-likelihood is {:.1} nats larger with the named terms.",
            held_out.n_step,
            held_out.records.join(", "),
            held_out.gain
        ));
    }
    note.join(" ")
}
