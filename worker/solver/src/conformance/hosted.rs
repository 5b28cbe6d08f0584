//! Observers and terms that a solver hosts.

use starlings_models::{Addition, ObserverDef, Run};

use super::subject::{Subject, Verdict, distance, failed, got, same, same_bits};
use super::trial::all_outputs;

pub(super) fn gain_zero(subject: &Subject<'_>) -> Verdict {
    if subject.description.observers.is_empty() {
        return Verdict::NoOccasion("it hosts no observer".to_owned());
    }
    let plain = got!(subject.plain());
    let outputs = all_outputs(subject.spec());
    let window = subject.observed(&plain.outputs);
    for kind in &subject.description.observers {
        let observer = ObserverDef { kind: kind.clone(), gain: 0.0, ..ObserverDef::default() };
        let run = Run { window: &window, ..subject.trial.run(&outputs, &observer) };
        let with = got!(subject.run(&run).map_err(failed("an observer of gain zero")));
        if !same_bits(&with.outputs, &plain.outputs) {
            return same(&with, &plain, &format!("the observer `{kind}` of gain zero changes the run"));
        }
    }
    Verdict::Holds
}

pub(super) fn predict_then_correct(subject: &Subject<'_>) -> Verdict {
    let plain = got!(subject.plain());
    let outputs = all_outputs(subject.spec());
    let window = subject.observed(&plain.outputs);
    let n = subject.spec().n_output();
    let mut moved = subject.description.observers.is_empty();
    for kind in &subject.description.observers {
        let observer = ObserverDef { kind: kind.clone(), gain: 1.0, ..ObserverDef::default() };
        let run = Run { window: &window, ..subject.trial.run(&outputs, &observer) };
        let with = got!(subject.run(&run).map_err(failed("an observer of gain one")));
        if !same_bits(&with.outputs[..n], &plain.outputs[..n]) {
            return Verdict::Fails(format!(
                "with the observer `{kind}` the first output moves towards its own datum: record it before it is corrected"
            ));
        }
        moved |= !same_bits(&with.outputs, &plain.outputs);
    }
    if subject.description.observers.is_empty() {
        return Verdict::NoOccasion("it hosts no observer".to_owned());
    }
    if moved { Verdict::Holds } else { Verdict::Fails("no observer of gain one moves anything".to_owned()) }
}

pub(super) fn zero_term(subject: &Subject<'_>) -> Verdict {
    let Some(state) = subject.description.hosts.first() else {
        return Verdict::NoOccasion("it hosts no terms".to_owned());
    };
    let plain = got!(subject.plain());
    let outputs = all_outputs(subject.spec());
    let terms = [Addition { to: state.clone(), term: "nothing*1.0".to_owned() }];
    let constants = [("nothing".to_owned(), 0.0)];
    let none = ObserverDef::default();
    let run = Run { terms: &terms, constants: &constants, ..subject.trial.run(&outputs, &none) };
    let with = got!(subject.run(&run).map_err(failed("a term that is zero")));
    let largest = plain.outputs.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
    // A model that has a closed step for itself integrates when something is added.
    let apart = distance(&with.outputs, &plain.outputs) / largest;
    if apart > 1e-5 {
        return Verdict::Fails(format!(
            "a term that is zero on `{state}` changes the outputs by {apart:.1e} of the largest"
        ));
    }
    Verdict::Holds
}
