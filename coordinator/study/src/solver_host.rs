//! How a study whose model runs in a program of its own reaches that program: functions of the caller that start it.
//!
//! The study itself starts no process. It is loaded with two functions, one that asks a solver for its description and one that
//! makes what runs jobs, and keeps them for its trial runs. Next file to read: [`super::check`].

use std::fmt;
use std::sync::Arc;

use starlings_models::{BuildSetup, Description, Forward, Setup, SetupError, SolverDef, SolverFault};
use starlings_proto::adapters::AdapterDef;

use starlings_fleet::Factory;

/// Why there is no description of a solver.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Undescribed {
    /// One sentence, with the end of the program's output where there is one.
    pub reason: String,
    /// The last text that the program itself wrote before it ended.
    pub last_words: Option<String>,
    /// Whether the program is not on this machine, so that its description has to be written on another one.
    pub is_absent: bool,
}

impl From<String> for Undescribed {
    fn from(reason: String) -> Self {
        Self { reason, last_words: None, is_absent: true }
    }
}

/// Asks a solver for its description.
type Describe = Arc<dyn Fn(&SolverDef) -> Result<Description, Undescribed> + Send + Sync>;

/// Checks the files of a solver without starting it.
type Inspect = Arc<dyn Fn(&SolverDef) -> Vec<SolverFault> + Send + Sync>;

/// Starts solvers. The default starts none: built-in models and equations need none.
#[derive(Clone)]
pub struct SolverHost {
    describe: Describe,
    inspect: Inspect,
    factory: Factory,
    adapters: Arc<[AdapterDef]>,
}

impl SolverHost {
    /// A host with which solvers can be asked for their description and setups be built.
    pub fn new(
        describe: impl Fn(&SolverDef) -> Result<Description, String> + Send + Sync + 'static,
        factory: Factory,
    ) -> Self {
        Self::asking(move |def| describe(def).map_err(Undescribed::from), factory)
    }

    /// The same, with a reason where there is no description.
    pub fn asking(
        describe: impl Fn(&SolverDef) -> Result<Description, Undescribed> + Send + Sync + 'static,
        factory: Factory,
    ) -> Self {
        Self {
            describe: Arc::new(describe),
            inspect: Arc::new(|_| Vec::new()),
            factory,
            adapters: Arc::default(),
        }
    }

    /// The same host, with the adapters by which it reaches solvers; a study may name no other.
    #[must_use]
    pub fn by(self, adapters: Vec<AdapterDef>) -> Self {
        Self { adapters: adapters.into(), ..self }
    }

    /// The adapters by which solvers are reached.
    pub fn adapters(&self) -> &[AdapterDef] {
        &self.adapters
    }

    /// The adapter of this name.
    pub fn adapter(&self, name: &str) -> Option<&AdapterDef> {
        self.adapters.iter().find(|adapter| adapter.name == name)
    }

    /// The same host, with a function that checks the files of a solver while the study is read.
    #[must_use]
    pub fn inspecting(
        self,
        inspect: impl Fn(&SolverDef) -> Vec<SolverFault> + Send + Sync + 'static,
    ) -> Self {
        Self { inspect: Arc::new(inspect), ..self }
    }

    /// The same host, which gives this description for every solver.
    #[must_use]
    pub fn knowing(&self, description: &Description) -> Self {
        let known = description.clone();
        Self { describe: Arc::new(move |_| Ok(known.clone())), ..self.clone() }
    }

    /// The description of a solver.
    ///
    /// # Errors
    /// Why there is none.
    pub fn describe(&self, solver: &SolverDef) -> Result<Description, Undescribed> {
        (self.describe)(solver)
    }

    /// What is wrong with the files of a solver; nothing is started.
    pub fn inspect(&self, solver: &SolverDef) -> Vec<SolverFault> {
        (self.inspect)(solver)
    }

    /// What runs the jobs of a setup.
    ///
    /// # Errors
    /// When the setup does not build.
    pub fn build(&self, setup: &Setup) -> Result<Box<dyn Forward>, SetupError> {
        (self.factory)(setup)
    }
}

impl Default for SolverHost {
    fn default() -> Self {
        Self::new(|_| Err("no solver can be started here".to_owned()), Arc::new(Setup::build))
    }
}

impl fmt::Debug for SolverHost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SolverHost").finish_non_exhaustive()
    }
}
