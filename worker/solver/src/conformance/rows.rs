//! The shape of what a solver answers: a row of outputs per time, each a 64-bit float, however many times there are.
//!
//! Where times and outputs are as many, nobody can tell a table from its transpose; so runs over several numbers of times are
//! compared. Next file to read: [`super::checks`].

use starlings_models::external::table::{foreign_bytes, is_transposed};
use starlings_models::{ParticleError, Run, Solved, Window};

use super::subject::{SAME, Subject, Verdict, failed, got};
use super::trial::all_outputs;

/// Runs over the first times of the trial, as many as there are outputs among them.
pub(super) fn rows(subject: &Subject<'_>) -> Verdict {
    let n = subject.spec().n_output();
    let n_times = subject.trial.window.times.len();
    let whole = match over(subject, n_times) {
        Ok(solved) => solved,
        // That the trial fails is told by the check before, unless it fails by the number of its times.
        Err(error) => {
            return match over(subject, n_times - 1) {
                Err(_) => Verdict::Fails(format!("the trial itself fails: {error}")),
                Ok(_) => Verdict::Fails(format!(
                    "a run over {n_times} times fails, one over {} does not: {error}",
                    n_times - 1
                )),
            };
        }
    };
    if whole.outputs.len() != n * n_times {
        return Verdict::Fails(format!(
            "{} values came for {n_times} times of {n} outputs, which make {}",
            whole.outputs.len(),
            n * n_times
        ));
    }
    if let Some(value) = foreign_bytes(&whole.outputs) {
        return Verdict::Fails(format!(
            "values such as {value:e} are the bytes of integers, or in another byte order: 64-bit floats belong, little-endian, such \
             as `numpy.asarray(values, dtype=\"<f8\").tobytes()`"
        ));
    }
    for k in [1, 2, n, n + 1, n_times / 2].into_iter().filter(|k| *k < n_times) {
        let what = format!("a run over {k} time{}", if k == 1 { "" } else { "s" });
        let part = got!(over(subject, k).map_err(failed(&what)));
        if part.outputs.len() != n * k {
            return Verdict::Fails(format!("{what} of {n} outputs gives {} values", part.outputs.len()));
        }
        if is_transposed((&whole.outputs, n_times), (&part.outputs, k), n) {
            return Verdict::Fails(format!(
                "the outputs are transposed: all times of the first output come first, where all {n} outputs of the first time \
                 belong; return the table's transpose (of SciPy's solve_ivp `sol.y.T`)"
            ));
        }
    }
    Verdict::Holds
}

/// A first time that is the start itself, as every study has it.
pub(super) fn at_start(subject: &Subject<'_>) -> Verdict {
    let window = &subject.trial.window;
    let n = subject.spec().n_output();
    let outputs = all_outputs(subject.spec());
    let times = [&[window.start], window.times.as_slice()].concat();
    for times in [&times[..1], &times[..]] {
        let observed = vec![f64::NAN; n * times.len()];
        let window = Window { times: times.to_vec(), observed, ..window.clone() };
        let run = Run { window: &window, ..subject.trial.run(&outputs, &subject.none) };
        let solved = got!(subject.run(&run).map_err(failed("a run whose first time is its start")));
        if solved.outputs.len() != n * times.len() {
            return Verdict::Fails(format!(
                "a run whose first time is its start gives {} values where {} belong",
                solved.outputs.len(),
                n * times.len()
            ));
        }
    }
    Verdict::Holds
}

/// A state that a study estimates is the one with which the run begins.
pub(super) fn begins(subject: &Subject<'_>) -> Verdict {
    let spec = subject.spec();
    let Some(place) = spec.states.iter().position(|q| q.size == 1).filter(|_| spec.restart) else {
        return Verdict::NoOccasion("it has no scalar state from which a run could begin".to_owned());
    };
    let at: usize = spec.states[..place].iter().map(|q| q.size).sum();
    let (name, start) = (&spec.states[place].name, subject.trial.window.start);
    let outputs = all_outputs(spec);
    let window = Window {
        times: vec![start],
        observed: vec![f64::NAN; spec.n_output()],
        ..subject.trial.window.clone()
    };
    let run = Run { window: &window, ..subject.trial.run(&outputs, &subject.none) };
    let plain = got!(subject.run(&run).map_err(failed("a run of no length")));
    let Some(own) = plain.state.get(at) else {
        return Verdict::Fails("a run of no length gives no state".to_owned());
    };
    let wanted = own + 0.125 * own.abs().max(1.0);
    let initial = [(name.clone(), wanted)];
    let run = Run { initial: &initial, ..run };
    match subject.run(&run) {
        // A solver may refuse one in words: the study is then refused too.
        Err(_) => Verdict::Holds,
        Ok(solved) if solved.state.get(at).is_some_and(|v| (v - wanted).abs() <= SAME * wanted.abs()) => {
            Verdict::Holds
        }
        Ok(solved) => Verdict::Fails(format!(
            "with {wanted} as the initial value of `{name}` the run begins with {:?}: a study that estimates `initial:{name}` would \
             estimate nothing",
            solved.state.get(at)
        )),
    }
}

/// The trial over its first times.
fn over(subject: &Subject<'_>, n_times: usize) -> Result<Solved, ParticleError> {
    let outputs = all_outputs(subject.spec());
    let window = Window {
        times: subject.trial.window.times[..n_times].to_vec(),
        observed: vec![f64::NAN; subject.spec().n_output() * n_times],
        ..subject.trial.window.clone()
    };
    subject.run(&Run { window: &window, ..subject.trial.run(&outputs, &subject.none) })
}
