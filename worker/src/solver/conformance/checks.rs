//! The checks, one function each.

use starlings_models::{
    Addition, Description, ObserverDef, ParticleError, Run, Solved, SolverDef, Spec, Window,
};

use super::trial::{Trial, all_outputs};
use crate::solver::Solvers;
use crate::solver::adapter::Adapter;

/// Difference between a run in one piece and in two, relative to the largest value: what a solver may lose by writing its
/// state down with fewer digits is already too much.
const SAME: f64 = 1e-9;

/// What is tried out.
pub(super) struct Subject<'a> {
    pub(super) solvers: &'a Solvers,
    pub(super) def: &'a SolverDef,
    pub(super) adapter: &'a dyn Adapter,
    pub(super) description: &'a Description,
    pub(super) trial: &'a Trial,
    /// No observer.
    pub(super) none: ObserverDef,
}

/// What a check found.
pub(super) enum Verdict {
    Holds,
    Fails(String),
    NoOccasion(String),
}

type Check = fn(&Subject<'_>) -> Verdict;

/// Every check, in the order in which they are made.
pub(super) const CHECKS: [(&str, Check); 11] = [
    ("a run gives the outputs and the state that the description promises", shape),
    ("equal requests give equal bits, in another process too", deterministic),
    ("a run in two pieces is the run in one piece", restart),
    ("outputs come in the order in which they are asked for", order),
    ("a later time changes nothing at an earlier one", causal),
    ("a request that does not fit is refused in words, and the next one is served", refuses),
    ("a parameter that is no number gives no numbers", not_a_number),
    ("a run that was given up does not spoil the next", cancelled),
    ("an observer of gain zero is none", gain_zero),
    ("an observer sees a datum only after its output is recorded", predict_then_correct),
    ("a hosted term of zero is none", zero_term),
];

impl Subject<'_> {
    fn spec(&self) -> &Spec {
        &self.description.spec
    }

    fn run(&self, run: &Run<'_>) -> Result<Solved, ParticleError> {
        self.adapter.run(run)
    }

    /// The trial as it is.
    fn plain(&self) -> Result<Solved, Verdict> {
        let outputs = all_outputs(self.spec());
        self.run(&self.trial.run(&outputs, &self.none))
            .map_err(|error| Verdict::Fails(format!("the trial itself fails: {error}")))
    }

    /// Observed values a little beside the outputs, for observers.
    fn observed(&self, outputs: &[f64]) -> Window {
        let beside = |v: &f64| v + 0.05 * v.abs().max(1e-3);
        Window { observed: outputs.iter().map(beside).collect(), ..self.trial.window.clone() }
    }
}

/// Ends a check early: what could not be run has its verdict.
macro_rules! got {
    ($result:expr) => {
        match $result {
            Ok(value) => value,
            Err(verdict) => return verdict,
        }
    };
}

fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Holds, or says how two answers differ.
fn same(a: &Solved, b: &Solved, otherwise: &str) -> Verdict {
    if same_bits(&a.outputs, &b.outputs) && same_bits(&a.state, &b.state) {
        return Verdict::Holds;
    }
    Verdict::Fails(format!(
        "{otherwise}: the outputs differ by up to {:.1e}",
        distance(&a.outputs, &b.outputs)
    ))
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    if a.len() != b.len() {
        return f64::INFINITY;
    }
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn failed(what: &str) -> impl Fn(ParticleError) -> Verdict + '_ {
    move |error| Verdict::Fails(format!("{what} fails: {error}"))
}

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
    let part = |from: usize, to: usize, start: f64| Window {
        start,
        times: window.times[from..to].to_vec(),
        observed: vec![f64::NAN; n * (to - from)],
        inputs: window.inputs.clone(),
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

fn refuses(subject: &Subject<'_>) -> Verdict {
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

fn not_a_number(subject: &Subject<'_>) -> Verdict {
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

fn cancelled(subject: &Subject<'_>) -> Verdict {
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

fn gain_zero(subject: &Subject<'_>) -> Verdict {
    let Some(kind) = subject.description.observers.first() else {
        return Verdict::NoOccasion("it hosts no observer".to_owned());
    };
    let plain = got!(subject.plain());
    let outputs = all_outputs(subject.spec());
    let window = subject.observed(&plain.outputs);
    for kind in subject.description.observers.iter().chain([kind]) {
        let observer = ObserverDef { kind: kind.clone(), gain: 0.0, ..ObserverDef::default() };
        let run = Run { window: &window, ..subject.trial.run(&outputs, &observer) };
        let with = got!(subject.run(&run).map_err(failed("an observer of gain zero")));
        if !same_bits(&with.outputs, &plain.outputs) {
            return same(&with, &plain, &format!("the observer `{kind}` of gain zero changes the run"));
        }
    }
    Verdict::Holds
}

fn predict_then_correct(subject: &Subject<'_>) -> Verdict {
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

fn zero_term(subject: &Subject<'_>) -> Verdict {
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
