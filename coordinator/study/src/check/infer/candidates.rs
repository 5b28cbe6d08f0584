//! Terms that a drift may lack: the functions that are tried in every equation.
//!
//! Next file to read: [`crate::infer_choice`].

use starlings_models::equations::EquationsDef;
use toml::Spanned;

use crate::check::settings::counted;
use crate::file::infer::CandidatesSection;
use crate::infer_choice::MissingChoice;
use crate::problem::Source;

/// Largest degree of a monomial.
const MOST_DEGREE: u64 = 5;
/// Candidates in all equations at most: each is fitted by itself, and the best in pairs.
const MOST: usize = 500;

/// The functions: monomials of the states, as texts, then those that are written.
pub(super) fn functions(
    source: &Source,
    section: Option<&CandidatesSection>,
    equations: &EquationsDef,
) -> Vec<String> {
    let Some(section) = section else { return Vec::new() };
    if section.degree.is_none() && section.functions.is_empty() {
        let help = "give `degree = 2` for all monomials of the states, `functions = [...]`, or both";
        source.report_with(section.span.clone(), "[infer.candidates] names no candidate", help);
        return Vec::new();
    }
    let degree = counted(source, section.degree.as_ref(), "degree", MOST_DEGREE);
    let states: Vec<&str> = equations.states.iter().map(|state| state.name.as_str()).collect();
    let mut functions = degree.map_or_else(Vec::new, |degree| monomials(&states, degree));
    for function in &section.functions {
        if functions.contains(function.get_ref()) {
            let message = format!("`{}` is given twice, or is one of the monomials", function.get_ref());
            source.report_with(function.span(), message, "remove one of the two");
        }
        functions.push(function.get_ref().clone());
    }
    let n = functions.len() * states.len();
    if n > MOST {
        let message = format!("{n} candidates in {} equations are more than {MOST}", states.len());
        source.report_with(
            section.span.clone(),
            message,
            "lower `degree`, or write the `functions` that may be missing",
        );
    }
    functions
}

/// All monomials of the states up to a degree, the constant first, as a basis of polynomials names them: `x1*x2`, `x1^2`.
fn monomials(states: &[&str], degree: usize) -> Vec<String> {
    let mut all: Vec<Vec<usize>> = vec![Vec::new()];
    let mut last = all.clone();
    for _ in 0..degree {
        let longer = |m: &Vec<usize>| {
            let from = m.last().copied().unwrap_or(0);
            (from..states.len()).map(|k| [m.as_slice(), &[k]].concat()).collect::<Vec<_>>()
        };
        last = last.iter().flat_map(longer).collect();
        all.extend(last.iter().cloned());
    }
    all.iter().map(|m| text(states, m)).collect()
}

fn text(states: &[&str], monomial: &[usize]) -> String {
    let power = |k: usize| match monomial.iter().filter(|m| **m == k).count() {
        0 => None,
        1 => Some(states[k].to_owned()),
        n => Some(format!("{}^{n}", states[k])),
    };
    let factors: Vec<String> = (0..states.len()).filter_map(power).collect();
    if factors.is_empty() { "1".to_owned() } else { factors.join("*") }
}

/// How they are looked for.
pub(super) fn missing(source: &Source, section: Option<&CandidatesSection>) -> Option<MissingChoice> {
    let section = section?;
    let (usual, most) = (0.01, counted(source, section.most.as_ref(), "most", 8).unwrap_or(4));
    if let Some(rate) = section.false_alarm.as_ref().filter(|rate| !(1e-15..0.5).contains(rate.get_ref())) {
        let message =
            format!("`false_alarm` must be a probability from 1e-15 to 0.5, found {}", rate.get_ref());
        source.report_with(rate.span(), message, "0.01 names a term by chance in one of a hundred searches");
    }
    Some(MissingChoice {
        false_alarm: section.false_alarm.as_ref().map_or(usual, |rate| *rate.get_ref()),
        most,
    })
}

/// The texts that a message may speak of.
pub(super) fn listed(section: Option<&CandidatesSection>) -> impl Iterator<Item = &Spanned<String>> + Clone {
    section.into_iter().flat_map(|section| &section.functions)
}

#[cfg(test)]
mod tests {
    use starlings_estimators::inference::{Functions, Polynomial};

    use super::monomials;

    #[test]
    fn monomials_are_named_as_those_of_a_basis() {
        let states = ["x", "y", "z"];
        for degree in 1..=4 {
            let mut of_basis = Polynomial::new(&states, 3, &[0, 1, 2], degree, true).names();
            let mut found = monomials(&states, degree as usize);
            of_basis.sort_unstable();
            found.sort_unstable();
            assert_eq!(found, of_basis, "degree {degree}");
        }
    }
}
