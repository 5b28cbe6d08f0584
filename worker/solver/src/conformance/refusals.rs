//! What a solver does with requests that make no sense, and with runs that nobody waits for.

use starlings_models::{ObserverDef, Run};

use super::subject::{Subject, Verdict, got, same, same_bits};
use super::trial::all_outputs;

pub(super) fn refuses(subject: &Subject<'_>) -> Verdict {
    if subject.def.files.is_some() {
        return Verdict::NoOccasion("its files have a place for every parameter and no other".to_owned());
    }
    let before = got!(subject.plain());
    let outputs = all_outputs(subject.spec());
    let longer = [subject.trial.parameters.as_slice(), &[1.0]].concat();
    let run = Run { parameters: &longer, ..subject.trial.run(&outputs, &subject.none) };
    match subject.run(&run) {
        Ok(_) => return Verdict::Fails("it takes a parameter too many without a word".to_owned()),
        Err(error) if error.to_string().contains(" during a run") => {
            return Verdict::Fails(format!(
                "a parameter too many ends the program instead of the run: {error}"
            ));
        }
        Err(_) => {}
    }
    let after = got!(subject.plain());
    same(&before, &after, "after a refused request the same run gives another answer")
}

pub(super) fn not_a_number(subject: &Subject<'_>) -> Verdict {
    if subject.trial.parameters.is_empty() {
        return Verdict::NoOccasion("it has no parameters".to_owned());
    }
    let outputs = all_outputs(subject.spec());
    for (i, q) in subject.spec().parameters.iter().enumerate() {
        let mut parameters = subject.trial.parameters.clone();
        parameters[i] = f64::NAN;
        let run = Run { parameters: &parameters, ..subject.trial.run(&outputs, &subject.none) };
        match subject.run(&run) {
            // A parameter that this trial does not feel is no reason to complain.
            Ok(solved) if solved.outputs.iter().all(|v| v.is_finite()) => {
                let plain = got!(subject.plain());
                if !same_bits(&plain.outputs, &solved.outputs) {
                    return Verdict::Fails(format!(
                        "with `{}` not a number it still gives numbers, and others",
                        q.name
                    ));
                }
            }
            Err(error) if error.to_string().contains(" during a run") => {
                return Verdict::Fails(format!(
                    "`{}` not a number ends the program instead of the run: {error}",
                    q.name
                ));
            }
            _ => {}
        }
    }
    Verdict::Holds
}

pub(super) fn cancelled(subject: &Subject<'_>) -> Verdict {
    let before = got!(subject.plain());
    let outputs = all_outputs(subject.spec());
    let none = ObserverDef::default();
    let run = subject.trial.run(&outputs, &none);
    if !subject.adapter.run_and_leave(&run) {
        return Verdict::NoOccasion("this adapter ends a run by ending its program".to_owned());
    }
    let after = got!(subject.plain());
    same(&before, &after, "after a run that was given up the same run gives another answer")
}
