//! `[predict]`: names that the model has, enough members for a band, room for what they predict.
//!
//! Next file to read: [`crate::predicted`].

use starlings_models::Spec;

use crate::checked::{PredictChoice, Record};
use crate::field::{component_of, components};
use crate::file::predict::PredictSection;
use crate::predicted::times::times_of;
use crate::problem::Source;

/// Members of an ensemble that bounds 95 % by its smallest and largest value.
const FEWEST: u64 = 39;
/// Numbers that all members predict, at most.
const MOST_NUMBERS: f64 = 2e8;

/// `[predict]`.
pub(super) fn predict(
    source: &Source,
    section: &PredictSection,
    spec: &Spec,
    records: &[Record],
) -> PredictChoice {
    let mut choice = PredictChoice { outputs: outputs(source, section, spec), ..PredictChoice::default() };
    if let Some(members) = &section.members {
        if *members.get_ref() < FEWEST {
            let message = format!("{} members make no band of 95 %", members.get_ref());
            source.report_with(members.span(), message, format!("at least {FEWEST} do; 200 are usual"));
        }
        choice.members = usize::try_from(*members.get_ref()).unwrap_or(usize::MAX);
    }
    if let Some(step) = &section.step {
        let length = *step.get_ref();
        if !(length > 0.0 && length.is_finite()) {
            let help = "without one the times of each record are taken";
            source.report_with(step.span(), format!("`step` is {length}: give a number above zero"), help);
            return choice;
        }
        choice.step = Some(length);
    }
    room(source, section, &choice, records);
    choice
}

/// What is named, a field component by component.
fn outputs(source: &Source, section: &PredictSection, spec: &Spec) -> Vec<String> {
    let scalars = || spec.states.iter().filter(|q| q.size == 1);
    let mut found: Vec<String> = Vec::new();
    for name in &section.outputs {
        let text = name.get_ref();
        let named = match Spec::range_of(&spec.outputs, text) {
            Some(range) => components(&spec.outputs)[range].to_vec(),
            None if scalars().any(|state| state.name == *text) => vec![text.clone()],
            None if components_of(spec, text).is_some() => {
                let message = format!("`{text}` is beyond its field");
                source.report_with(name.span(), message, components_of(spec, text).unwrap_or_default());
                continue;
            }
            None => {
                let valid: Vec<String> =
                    spec.outputs.iter().chain(scalars()).map(|q| q.name.clone()).collect();
                let message = format!(
                    "no worker can give `{text}`: it is no output and no scalar state of the model `{}`",
                    spec.kind
                );
                source.report_unknown(name.span(), message, &valid);
                continue;
            }
        };
        if let Some(twice) = named.iter().find(|one| found.contains(one)) {
            source.report(name.span(), format!("`{twice}` is predicted twice"));
        }
        found.extend(named);
    }
    found
}

/// Which components the field has that a name speaks of.
fn components_of(spec: &Spec, name: &str) -> Option<String> {
    let (field, _) = component_of(name)?;
    let size = spec.outputs.iter().find(|q| q.name == field && q.size > 1)?.size;
    Some(format!("`{field}` has the components 0 to {}", size - 1))
}

/// Refuses more numbers than there is room for, before times are made.
fn room(source: &Source, section: &PredictSection, choice: &PredictChoice, records: &[Record]) {
    let n_time = |record: &Record| {
        let span = record.times.last().map_or(0.0, |end| end - record.start);
        record.times.len() as f64 + choice.step.map_or(0.0, |step| span / step)
    };
    let n_time: f64 = records.iter().map(n_time).sum();
    let numbers = choice.members as f64 * choice.outputs.len() as f64 * n_time;
    if numbers > MOST_NUMBERS {
        let message = format!(
            "{} members of {} outputs at {n_time:.0} times are {numbers:.1e} numbers; {MOST_NUMBERS:.0e} are allowed",
            choice.members,
            choice.outputs.len()
        );
        let help = "name fewer outputs (`field[i]` is one component), fewer `members` or a longer `step`";
        source.report_with(section.span.clone(), message, help);
    } else if let Some(record) = records.iter().find(|record| times_of(record, choice.step).is_empty()) {
        source.report(section.span.clone(), format!("record `{}` has no time to predict at", record.name));
    }
}

#[cfg(test)]
mod tests {
    use starlings_models::{Quantity, Spec};

    use super::components_of;

    #[test]
    fn a_component_beyond_its_field_is_told_how_many_there_are() {
        let stress = Quantity { size: 15, ..Quantity::new("stress", "Pa") };
        let spec = Spec { outputs: vec![Quantity::new("flow", ""), stress], ..Spec::default() };
        let told = ["stress[15]", "stress", "flow[2]", "strain[1]"].map(|name| components_of(&spec, name));
        assert_eq!(told, [Some("`stress` has the components 0 to 14".to_owned()), None, None, None]);
    }
}
