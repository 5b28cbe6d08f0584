//! `starlings guard`: ends the solvers that a dying worker leaves behind. Started by workers, not by people.

/// Watches over the process groups named on standard input.
pub(crate) fn run() {
    starlings_solver::guard(std::io::stdin().lock());
}
