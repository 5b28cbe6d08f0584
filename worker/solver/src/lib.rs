//! External solvers: programs of their own that run jobs for this worker.
//!
//! [`Solvers`] makes of a setup something that runs jobs, whether the model is built in or runs outside. A solver is started
//! when first needed, one program per slot, supervised, and ended with the worker. No retries on other machines are decided
//! here. Next files to read: [`mod@adapter`] for the ways to reach a solver, [`mod@instance`] for one program, [`mod@site`] for
//! where programs run, [`mod@serve`] for the other end of the connection.

mod adapter;
mod backoff;
mod clear;
pub mod conformance;
mod core_slots;
mod error;
#[cfg(fuzzing)]
pub mod fuzzing;
mod guard;
pub mod instance;
mod losses;
mod machine;
mod orphans;
mod permit;
mod process;
mod scratch;
pub mod serve;
mod site;
mod stopped;
mod stopwatch;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use starlings_models::periodic::beginning;
use starlings_models::{
    BuildSetup, Description, External, Factory, Forward, ParticleError, Run, SOLVER, Setup, SetupError,
    Solve, Solved, SolverDef, SolverFault,
};
use starlings_proto::adapters::AdapterDef;

use adapter::Adapter;
pub use error::SolverError;
pub use guard::guard;
pub use orphans::adopt_orphans;
pub use permit::Permit;
use site::Site;
pub use site::SiteOptions;

/// The ways to reach a solver.
pub fn adapters() -> Vec<AdapterDef> {
    adapter::defs().into()
}

/// What is wrong with the files and the command of a program that is started for every run; nothing is started.
pub fn faults(def: &SolverDef) -> Vec<SolverFault> {
    let per_run = adapter::def(&def.adapter).is_some_and(|adapter| adapter.per_run);
    if per_run { adapter::command::faults(def) } else { Vec::new() }
}

/// The solvers of one process.
#[derive(Clone)]
pub struct Solvers(Arc<Shared>);

struct Shared {
    options: SiteOptions,
    site: Arc<Site>,
    settings: Settings,
    open: Mutex<BTreeMap<String, Arc<Reached>>>,
}

/// What holds for the solvers of every study here.
#[derive(Clone)]
struct Settings {
    /// Which programs are started.
    permit: Permit,
    /// Programs of other processes that come first where cores are shared out.
    first: usize,
}

/// A solver with what it says of itself, once it has been asked.
struct Reached {
    adapter: Box<dyn Adapter>,
    description: Mutex<Option<Description>>,
}

impl Solvers {
    /// No solver is started yet. Any program of a study may be, as for a study of this user's own.
    pub fn new(options: SiteOptions) -> Self {
        Self::with(options, Settings { permit: Permit::Study, first: 0 })
    }

    /// The same, where setups may have no other program started.
    #[must_use]
    pub fn permitting(self, permit: Permit) -> Self {
        let settings = Settings { permit, ..self.0.settings.clone() };
        Self::with(self.0.options.clone(), settings)
    }

    /// The same beside `first` programs of other processes on this machine, which are bound to cores before its own.
    #[must_use]
    pub fn with_cores_after(self, first: usize) -> Self {
        let settings = Settings { first, ..self.0.settings.clone() };
        Self::with(self.0.options.clone(), settings)
    }

    /// The same solvers with programs and folders of their own.
    pub(crate) fn apart(&self) -> Self {
        Self::with(self.0.options.clone(), self.0.settings.clone())
    }

    fn with(options: SiteOptions, settings: Settings) -> Self {
        let site = Arc::new(Site::new(options.clone(), settings.first));
        Self(Arc::new(Shared { options, site, settings, open: Mutex::default() }))
    }

    /// What a solver says of itself; starts it.
    ///
    /// # Errors
    /// When it cannot be reached or makes no sense.
    pub fn describe(&self, def: &SolverDef) -> Result<Description, SolverError> {
        self.reach(def)?.describe()
    }

    /// Makes what runs the jobs of a setup, in this process or outside.
    ///
    /// # Errors
    /// When the setup does not fit together, or the solver cannot be reached or is another one than the study was made for.
    pub fn build(&self, setup: &Setup) -> Result<Box<dyn Forward>, SetupError> {
        if setup.model.kind != SOLVER {
            return setup.build();
        }
        let def = setup.model.solver.as_deref();
        let def = def.ok_or_else(|| SetupError::Invalid("the setup names no solver".to_owned()))?;
        let invalid = |error: SolverError| SetupError::Invalid(error.to_string());
        let permitted = self.0.settings.permit.of(def).map_err(SetupError::Invalid)?;
        let reached = self.reach(&permitted).map_err(invalid)?;
        let description = reached.describe().map_err(invalid)?;
        if let Some(known) = def.described.as_ref().filter(|known| **known != description) {
            return Err(SetupError::Invalid(differs(known, &description)));
        }
        beginning(Box::new(External::new(setup, description, Outside(reached))?), setup)
    }

    /// What a worker makes its setups with.
    pub fn factory(&self) -> Factory {
        let own = self.clone();
        Arc::new(move |setup| own.build(setup))
    }

    fn reach(&self, def: &SolverDef) -> Result<Arc<Reached>, SolverError> {
        // Studies of one solver share its programs, whatever else they say.
        let def = def.clone();
        let describes_itself = adapter::def(&def.adapter).is_some_and(|adapter| adapter.describes_itself);
        let described = def.described.clone().filter(|_| !describes_itself);
        let key = format!("{:?}", SolverDef { described, ..def.clone() });
        let mut open = self.0.open.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(reached) = open.get(&key) {
            return Ok(Arc::clone(reached));
        }
        let adapter = adapter::open(&def, &self.0.site)?;
        let reached = Arc::new(Reached { adapter, description: Mutex::default() });
        open.insert(key, Arc::clone(&reached));
        Ok(reached)
    }
}

impl Reached {
    fn describe(&self) -> Result<Description, SolverError> {
        let mut known = self.description.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(description) = &*known {
            return Ok(description.clone());
        }
        let description = self.adapter.describe()?;
        *known = Some(description.clone());
        Ok(description)
    }
}

/// Runs of one setup on a solver.
struct Outside(Arc<Reached>);

impl Solve for Outside {
    fn solve(&self, run: &Run<'_>) -> Result<Solved, ParticleError> {
        self.0.adapter.run(run)
    }
}

/// How a solver here differs from the one that the study was made for.
fn differs(known: &Description, here: &Description) -> String {
    let names = |d: &Description| {
        let lists = [&d.spec.states, &d.spec.parameters, &d.spec.outputs, &d.spec.inputs];
        lists.map(|list| list.iter().map(|q| q.name.clone()).collect::<Vec<_>>())
    };
    let what = ["states", "parameters", "outputs", "inputs"];
    let pairs = what.iter().zip(names(known).into_iter().zip(names(here)));
    let part = pairs.filter(|(_, (a, b))| a != b).map(|(what, (a, b))| {
        format!("its {what} are {} where the study knows {}", b.join(", "), a.join(", "))
    });
    let parts: Vec<String> = part.collect();
    let how = if parts.is_empty() { "in units, ranges or abilities".to_owned() } else { parts.join("; ") };
    format!("the solver `{}` on this machine is another one than the study was made for: {how}", here.name)
}
