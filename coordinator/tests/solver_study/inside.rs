//! A solver that runs equations inside, reached without a process: what it predicts is known to the last bit.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use starlings_coordinator::fleet::{Factory, Fleet, InProcess};
use starlings_coordinator::study::store::Purpose;
use starlings_coordinator::study::store::folder::Call;
use starlings_coordinator::study::{
    FolderError, RunContext, RunError, RunFolder, SolverHost, Study, StudyError, Summary, run::run,
};
use starlings_models::{
    Addition, BuildSetup, Description, EffectDef, EffectParameter, External, Job, ModelDef, ParticleError,
    Run, SOLVER, Setup, SetupError, Solve, Solved, Spec,
};
use starlings_solver::adapters;

/// Equations that run as a solver.
#[derive(Clone)]
pub(crate) struct Inside {
    model: ModelDef,
    description: Description,
    /// Digits after the point of its outputs, where it does not give all.
    decimals: Option<i32>,
}

/// A host that starts no solver.
pub(crate) fn no_host() -> SolverHost {
    SolverHost::default().by(adapters())
}

impl Inside {
    /// The model of a study as a solver that takes terms on these states.
    pub(crate) fn of(native: &Study, hosts: &[&str]) -> Self {
        let mut model = native.setup.model.clone();
        let spec = Setup { model: model.clone(), ..Setup::default() }.spec().unwrap();
        model.constants.retain(|name, _| spec.parameters.iter().all(|q| q.name != *name));
        let description = Description {
            spec: Spec { kind: SOLVER.to_owned(), ..spec },
            name: "swing".to_owned(),
            deterministic: true,
            observers: vec!["nudging".to_owned()],
            hosts: hosts.iter().map(|name| (*name).to_owned()).collect(),
        };
        Self { model, description, decimals: None }
    }

    /// The same with another description.
    pub(crate) fn described(mut self, change: impl FnOnce(&mut Description)) -> Self {
        change(&mut self.description);
        self
    }

    /// The same with so many digits after the point of its outputs.
    pub(crate) fn rounding(mut self, decimals: i32) -> Self {
        self.decimals = Some(decimals);
        self
    }

    /// The host that describes and runs it.
    pub(crate) fn solver_host(&self) -> SolverHost {
        let known = self.description.clone();
        SolverHost::new(move |_| Ok(known.clone()), self.factory()).by(adapters())
    }

    /// What a fleet makes setups with.
    pub(crate) fn factory(&self) -> Factory {
        let own = self.clone();
        Arc::new(move |setup: &Setup| {
            if setup.model.kind != SOLVER {
                return setup.build();
            }
            Ok(Box::new(External::new(setup, own.description.clone(), own.clone())?) as Box<_>)
        })
    }

    pub(crate) fn description(&self) -> &Description {
        &self.description
    }
}

impl Solve for Inside {
    fn solve(&self, run: &Run<'_>) -> Result<Solved, ParticleError> {
        let broken = |error: SetupError| ParticleError::Undecided(error.to_string());
        let mut model = self.model.clone();
        model.constants.extend(run.constants.iter().cloned());
        let own = self.description.spec.parameters.iter().map(|q| q.name.clone());
        let initial = run.initial.iter().map(|(state, _)| format!("initial:{state}"));
        // An effect needs an amplitude; the sizes of the terms are in its constants.
        let always = EffectParameter { name: "always".to_owned(), ..EffectParameter::default() };
        let scaled = |add: &Addition| Addition { to: add.to.clone(), term: format!("always*({})", add.term) };
        let terms = EffectDef {
            name: "terms".to_owned(),
            adds: run.terms.iter().map(scaled).collect(),
            parameters: vec![always],
            ..EffectDef::default()
        };
        let with_terms = !run.terms.is_empty();
        if with_terms {
            model.constants.insert("always".to_owned(), 1.0);
        }
        let setup = Setup {
            model,
            parameters: own.chain(initial).collect(),
            outputs: run.outputs.to_vec(),
            observer: run.observer.clone(),
            effects: if with_terms { vec![terms] } else { Vec::new() },
            max_steps: None,
            timeout: None,
            noise: None,
            sums: None,
            periods: Vec::new(),
            slopes: false,
        };
        let theta =
            run.parameters.iter().copied().chain(run.initial.iter().map(|(_, value)| *value)).collect();
        let job = Job {
            particle: run.particle,
            record: run.record,
            window: Arc::new(run.window.clone()),
            theta,
            state: run.state.map(|state| state.to_vec().into()),
        };
        let prediction = setup.build().map_err(broken)?.run(&job)?;
        let state = if self.description.spec.restart { prediction.state.into_vec() } else { Vec::new() };
        let shown = |value: f64| match self.decimals {
            Some(decimals) => (value * 10.0_f64.powi(decimals)).round() / 10.0_f64.powi(decimals),
            None => value,
        };
        Ok(Solved { outputs: prediction.outputs.into_iter().map(shown).collect(), state })
    }
}

/// A study with its files in a folder of their own.
pub(crate) struct Place {
    pub(crate) folder: tempfile::TempDir,
}

impl Place {
    pub(crate) fn new(files: &[(&str, &str)]) -> Self {
        let place = Self { folder: tempfile::tempdir().unwrap() };
        for (name, text) in files {
            place.write(name, text);
        }
        place
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.folder.path().join(name), text).unwrap();
    }

    pub(crate) fn file(&self) -> PathBuf {
        self.folder.path().join("study.toml")
    }

    pub(crate) fn load(&self, solver_host: &SolverHost) -> Result<Study, StudyError> {
        Study::load_with(&self.file(), solver_host)
    }

    /// Runs a study into a new folder.
    pub(crate) fn run(&self, study: &Study, fleet: &mut dyn Fleet, out: &str) -> Result<Summary, RunError> {
        let mut folder = RunFolder::create(Purpose::Run, &self.out(out), study, "test", "today").unwrap();
        let mut context =
            RunContext { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0, threads: 2 };
        run(study, fleet, &mut folder, &mut context)
    }

    pub(crate) fn resume(&self, study: &Study, out: &str) -> Result<(), FolderError> {
        RunFolder::resume(Purpose::Run, &self.out(out), study, &Call::default()).map(|_| ())
    }

    fn out(&self, name: &str) -> PathBuf {
        Path::new(self.folder.path()).join(name)
    }
}

/// Threads that make their setups with this solver.
pub(crate) fn threads(inside: &Inside) -> InProcess {
    InProcess::new(2).with_factory(inside.factory())
}
