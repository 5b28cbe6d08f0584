//! What a study needs from the outside where its model runs in a program of its own: somebody who starts it.
//!
//! The study itself starts no process. It is loaded with two functions, one that asks a solver what it is and one that makes
//! what runs jobs, and keeps them for its trial runs. Next file to read: [`super::check`].

use std::fmt;
use std::sync::Arc;

use starlings_models::{Description, Forward, Setup, SetupError, SolverDef};

use crate::fleet::Factory;

/// Asks a solver what it is.
type Describe = Arc<dyn Fn(&SolverDef) -> Result<Description, String> + Send + Sync>;

/// Who starts solvers. The default starts none: built-in models and equations need nobody.
#[derive(Clone)]
pub struct Surroundings {
    describe: Describe,
    factory: Factory,
}

impl Surroundings {
    /// Surroundings in which solvers can be asked for their description and setups be built.
    pub fn new(
        describe: impl Fn(&SolverDef) -> Result<Description, String> + Send + Sync + 'static,
        factory: Factory,
    ) -> Self {
        Self { describe: Arc::new(describe), factory }
    }

    /// The same surroundings, in which every solver is known to be this one.
    #[must_use]
    pub fn knowing(&self, description: &Description) -> Self {
        let known = description.clone();
        Self { describe: Arc::new(move |_| Ok(known.clone())), factory: Arc::clone(&self.factory) }
    }

    /// What a solver says of itself.
    ///
    /// # Errors
    /// Why it does not, in one sentence.
    pub fn describe(&self, solver: &SolverDef) -> Result<Description, String> {
        (self.describe)(solver)
    }

    /// What runs the jobs of a setup.
    ///
    /// # Errors
    /// When the setup does not build.
    pub fn build(&self, setup: &Setup) -> Result<Box<dyn Forward>, SetupError> {
        (self.factory)(setup)
    }
}

impl Default for Surroundings {
    fn default() -> Self {
        Self::new(|_| Err("no solver can be started here".to_owned()), Arc::new(Setup::build))
    }
}

impl fmt::Debug for Surroundings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Surroundings").finish_non_exhaustive()
    }
}
