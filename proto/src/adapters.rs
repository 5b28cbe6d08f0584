//! What a way to reach an external solver says of itself: studies are read by it, and workers open solvers by it.
//!
//! Nothing is opened or listed here: `worker/solver/src/adapter.rs` has the list. Next file to read: `words.rs`.

/// One way to reach a solver.
#[derive(Clone, Copy, Debug)]
pub struct AdapterDef {
    /// The name in a study.
    pub name: &'static str,
    /// One plain sentence.
    pub says: &'static str,
    /// Whether the solver itself says what it is, and which times it answers for; else the study does.
    pub describes_itself: bool,
    /// Whether the program is started for every run, takes its values from files and leaves its outputs to be read by rules.
    pub per_run: bool,
    /// How the study names the solver.
    pub named_by: NamedBy,
    /// Keys of `[model]` that not all adapters have.
    pub keys: &'static [&'static str],
}

/// How a study names a solver; the text says what is expected there.
#[derive(Clone, Copy, Debug)]
pub enum NamedBy {
    /// By the command that starts it.
    Command(&'static str),
    /// By its address, whether a command starts it or somebody else does.
    Address(&'static str),
    /// By either, and not by both.
    CommandOrAddress(&'static str),
}
