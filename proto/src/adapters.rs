//! The ways to reach an external solver: the one list that studies are read by and that workers open solvers by.
//!
//! Nothing is opened here: `worker/solver/src/adapter.rs` holds what opens each of them. Next file to read: `words.rs`.

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

const PROGRAM: &str = "program and arguments, such as `[\"./beam\", \"input.txt\"]`";

/// Every way.
pub const ADAPTERS: [AdapterDef; 5] = [
    AdapterDef {
        name: "grpc",
        says: "a program that serves solver.proto, or an address where one does",
        describes_itself: true,
        per_run: false,
        named_by: NamedBy::CommandOrAddress(
            "program and arguments, such as `[\"python3\", \"beam.py\"]` (or `address`)",
        ),
        keys: &["address", "described"],
    },
    AdapterDef {
        name: "command",
        says: "a program started for every run; input files from templates, outputs by rule, no code",
        describes_itself: false,
        per_run: true,
        named_by: NamedBy::Command(PROGRAM),
        keys: &["parameters", "outputs", "inputs", "templates", "copies"],
    },
    AdapterDef {
        name: "fmu",
        says: "a functional mock-up unit, through the Python package and fmpy",
        describes_itself: true,
        per_run: false,
        named_by: NamedBy::Command("the file of the FMU, such as `[\"tank.fmu\"]`"),
        keys: &["described"],
    },
    AdapterDef {
        name: "um-bridge",
        says: "a UM-Bridge server over HTTP, started by the worker or by somebody else",
        describes_itself: false,
        per_run: false,
        named_by: NamedBy::Address("where the server listens, such as \"http://127.0.0.1:4242\""),
        keys: &["address", "model", "described", "parameters", "outputs", "inputs"],
    },
    AdapterDef {
        name: "mpi",
        says: "an MPI program whose rank 0 serves solver.proto",
        describes_itself: true,
        per_run: false,
        named_by: NamedBy::Command(PROGRAM),
        keys: &["ranks", "described"],
    },
];

/// The adapter of this name.
pub fn adapter(name: &str) -> Option<&'static AdapterDef> {
    ADAPTERS.iter().find(|adapter| adapter.name == name)
}
