//! The checks of single runs, one function each, and the list of all.
//!
//! Next files to read: [`super::refusals`], [`super::hosted`].

use starlings_models::{ObserverDef, Run, Window};

use super::hosted::{gain_zero, predict_then_correct, zero_term};
use super::refusals::{cancelled, not_a_number, refuses};
use super::rows::{at_start, begins, rows};
use super::subject::{SAME, Subject, Verdict, distance, failed, got, same, same_bits};
use super::trial::all_outputs;

type Check = fn(&Subject<'_>) -> Verdict;

/// Every check, in the order in which they are made.
pub(super) const CHECKS: [(&str, Check); 14] = [
    ("a run gives the outputs and the state that the description promises", shape),
    ("outputs are a row of 64-bit floats per time, however many times there are", rows),
    ("a first time that is the start itself is served", at_start),
    ("equal requests give equal bits, in another process too", deterministic),
    ("a run in two pieces is the run in one piece", restart),
    ("a run begins with the initial value that it is given", begins),
    ("outputs come in the order in which they are asked for", order),
    ("a later time changes nothing at an earlier one", causal),
    ("a request that does not fit is refused in words, and the next one is served", refuses),
    ("a parameter that is no number gives no numbers", not_a_number),
    ("a run that was given up does not spoil the next", cancelled),
    ("an observer of gain zero is none", gain_zero),
    ("an observer sees a datum only after its output is recorded", predict_then_correct),
    ("a hosted term of zero is none", zero_term),
];

fn shape(subject: &Subject<'_>) -> Verdict {
    let solved = got!(subject.plain());
    let spec = subject.spec();
    let (wanted, got) = (spec.n_output() * subject.trial.window.times.len(), solved.outputs.len());
    if got != wanted {
        return Verdict::Fails(format!("{got} output values came where outputs times times make {wanted}"));
    }
    let (wanted, got) = (if spec.restart { spec.n_state() } else { 0 }, solved.state.len());
    if spec.restart && got != wanted {
        return Verdict::Fails(format!("{got} state values came where the description has {wanted}"));
    }
    match solved.outputs.iter().chain(&solved.state).find(|v| !v.is_finite()) {
        Some(value) => Verdict::Fails(format!("a value of the trial is {value}")),
        None => Verdict::Holds,
    }
}

fn deterministic(subject: &Subject<'_>) -> Verdict {
    if !subject.description.deterministic {
        return Verdict::NoOccasion("the description says that it is not deterministic".to_owned());
    }
    let (first, second) = (got!(subject.plain()), got!(subject.plain()));
    if !same_bits(&first.outputs, &second.outputs) {
        return same(&first, &second, "the same request, twice to one process, gives two answers");
    }
    // A site of its own starts a process of its own.
    let other = subject.solvers.apart();
    let third = other.reach(subject.def).map_err(|e| Verdict::Fails(e.to_string()));
    let outputs = all_outputs(subject.spec());
    let run = subject.trial.run(&outputs, &subject.none);
    let third = got!(got!(third).adapter.run(&run).map_err(failed("a second process")));
    same(&first, &third, "the same request to a second process gives another answer")
}

fn restart(subject: &Subject<'_>) -> Verdict {
    if !subject.spec().restart {
        return Verdict::NoOccasion("it cannot restart from a state".to_owned());
    }
    let whole = got!(subject.plain());
    let outputs = all_outputs(subject.spec());
    let window = &subject.trial.window;
    let (n, cut) = (subject.spec().n_output(), window.times.len() / 2);
    let part = |from: usize, to: usize, start: f64| {
        Window::free(start, window.times[from..to].to_vec(), n, window.inputs.clone())
    };
    let (first, second) = (part(0, cut, window.start), part(cut, window.times.len(), window.times[cut - 1]));
    let none = ObserverDef::default();
    let run = Run { window: &first, ..subject.trial.run(&outputs, &none) };
    let before = got!(subject.run(&run).map_err(failed("the first half")));
    let run = Run { window: &second, state: Some(&before.state), ..run };
    let after = got!(subject.run(&run).map_err(failed("the second half, from the state of the first,")));
    let pieces = [before.outputs, after.outputs].concat();
    let largest = whole.outputs.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
    let apart = distance(&pieces, &whole.outputs) / largest;
    if apart > SAME {
        return Verdict::Fails(format!(
            "a run in two pieces differs from the run in one by {apart:.1e} of the largest output: the state does not hold \
             everything that the solver needs to go on"
        ));
    }
    Verdict::Holds
}

fn order(subject: &Subject<'_>) -> Verdict {
    let spec = subject.spec();
    if spec.outputs.len() < 2 {
        return Verdict::NoOccasion("it has one output".to_owned());
    }
    let whole = got!(subject.plain());
    let last = spec.outputs[spec.outputs.len() - 1].clone();
    let (n, size) = (spec.n_output(), last.size);
    let names = vec![last.name.clone()];
    let window = Window {
        observed: vec![f64::NAN; size * subject.trial.window.times.len()],
        ..subject.trial.window.clone()
    };
    let run = Run { window: &window, ..subject.trial.run(&names, &subject.none) };
    let alone = got!(subject.run(&run).map_err(failed("a request for one output of several")));
    let wanted: Vec<f64> =
        whole.outputs.chunks_exact(n).flat_map(|column| column[n - size..].to_vec()).collect();
    if same_bits(&alone.outputs, &wanted) {
        return Verdict::Holds;
    }
    Verdict::Fails(format!("asked for `{}` alone, it gives other values than among all", last.name))
}

fn causal(subject: &Subject<'_>) -> Verdict {
    let whole = got!(subject.plain());
    let outputs = all_outputs(subject.spec());
    let (n, half) = (subject.spec().n_output(), subject.trial.window.times.len() / 2);
    let window = Window {
        times: subject.trial.window.times[..half].to_vec(),
        observed: vec![f64::NAN; n * half],
        ..subject.trial.window.clone()
    };
    let run = Run { window: &window, ..subject.trial.run(&outputs, &subject.none) };
    let short = got!(subject.run(&run).map_err(failed("a shorter run")));
    let largest = whole.outputs.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
    let apart = distance(&short.outputs, &whole.outputs[..n * half]) / largest;
    if apart > SAME {
        return Verdict::Fails(format!(
            "the outputs of the first half change by {apart:.1e} of the largest when the second half is not asked for"
        ));
    }
    Verdict::Holds
}
