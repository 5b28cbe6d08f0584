//! A deployment: its folder with the scripts, the logs and `deployment.json`, from which it is asked and removed later.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::engine::{Engine, engine};
use crate::error::DeployError;
use crate::logs;
use crate::order::Order;
use crate::program::Programs;
use crate::task::{Role, State, Task};

/// Name of the file that says what a folder deploys.
pub const FILE: &str = "deployment.json";

/// Name of the file that says that it was removed.
const REMOVED: &str = "removed";

/// Number of its format.
const FORMAT: u64 = 1;

/// What a worker writes into its log while nobody answers it.
const UNREACHED: &str = " worker: no coordinator at ";

/// What `deployment.json` says.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Record {
    starlings_deployment: u64,
    engine: String,
    #[serde(flatten)]
    order: Order,
}

/// A folder of a deployment.
pub struct Deployment {
    /// The folder, absolute.
    pub folder: PathBuf,
    /// What was asked for.
    pub order: Order,
    engine: &'static dyn Engine,
}

impl Deployment {
    /// Writes the folder of a deployment; nothing is submitted.
    ///
    /// # Errors
    /// When something stands there already, the order is none for this engine, or it cannot be written.
    pub fn write(engine: &'static dyn Engine, order: Order, folder: &Path) -> Result<Self, DeployError> {
        order.check_paths(folder)?;
        let files = engine.files(&order, folder)?;
        if fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) {
            return Err(DeployError::Occupied(folder.to_owned()));
        }
        let logs = folder.join(logs::FOLDER);
        fs::create_dir_all(&logs).map_err(|source| DeployError::Unwritable { path: logs, source })?;
        let record = Record { starlings_deployment: FORMAT, engine: engine.name().to_owned(), order };
        let text = serde_json::to_string_pretty(&record).map_err(io::Error::from);
        let put = |name: &str, text: io::Result<String>| {
            let path = folder.join(name);
            text.and_then(|text| write(&path, &text))
                .map_err(|source| DeployError::Unwritable { path, source })
        };
        files.into_iter().try_for_each(|(name, text)| put(&name, Ok(text)))?;
        // Last: what has it is whole.
        put(FILE, text.map(|text| text + "\n"))?;
        Ok(Self { folder: folder.to_owned(), order: record.order, engine })
    }

    /// Reads the deployment of a folder.
    ///
    /// # Errors
    /// When there is none, or somebody else could have written it: it names programs that are started.
    pub fn read(folder: &Path) -> Result<Self, DeployError> {
        let none = |reason: String| DeployError::NoDeployment { path: folder.to_owned(), reason };
        let text = read(&folder.join(FILE)).map_err(|error| none(format!("{FILE}: {error}")))?;
        let record: Record = serde_json::from_str(&text).map_err(|error| none(format!("{FILE}: {error}")))?;
        if record.starlings_deployment != FORMAT {
            let found = record.starlings_deployment;
            return Err(none(format!("{FILE} is of format {found}, this program reads {FORMAT}")));
        }
        if !Order::is_name(&record.order.name) {
            return Err(none(format!("{FILE}: `{}` is no name of a deployment", record.order.name)));
        }
        let engine = engine(&record.engine)
            .ok_or_else(|| none(format!("{FILE}: no engine named `{}`", record.engine)))?;
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        Ok(Self { folder, order: record.order, engine })
    }

    /// The engine that runs it.
    pub fn engine(&self) -> &'static dyn Engine {
        self.engine
    }

    /// The process of a worker on its node, `HOST/PROCESS`, where its script has said it.
    pub fn process(&self, role: Role) -> Option<String> {
        let said = fs::read_to_string(self.folder.join(logs::FOLDER).join(role.process())).ok()?;
        Some(said.trim().to_owned())
    }

    /// Every process of the deployment, the coordinator first.
    ///
    /// # Errors
    /// When the engine gives no answer.
    pub fn tasks(&self) -> Result<Vec<Task>, DeployError> {
        let mut tasks = self.engine.tasks(self)?;
        // Of those that may come and go nothing is said as long as they are not there.
        let comes_and_goes = |task: &Task| self.order.elastic.is_some() && task.role != Role::Coordinator;
        tasks.retain(|task| task.state != State::Unknown || !comes_and_goes(task));
        for task in tasks.iter_mut().filter(|task| task.state == State::Running && task.says.is_none()) {
            task.says = self.unreached(task.role);
        }
        Ok(tasks)
    }

    /// Does something that submits more, unless the deployment is removed; what removes it waits for that.
    pub fn unless_removed<T>(&self, act: impl FnOnce() -> T) -> Option<T> {
        let _lock = self.lock();
        (!self.is_removed()).then(act)
    }

    /// Whether it is removed.
    pub fn is_removed(&self) -> bool {
        self.folder.join(REMOVED).exists()
    }

    /// Notes that the deployment is removed: whoever watches it submits nothing more.
    ///
    /// # Errors
    /// When that cannot be written.
    pub fn note_removed(&self) -> Result<(), DeployError> {
        let _lock = self.lock();
        let path = self.folder.join(REMOVED);
        fs::write(&path, "").map_err(|source| DeployError::Unwritable { path, source })
    }

    /// Held by one process at a time; nothing on file systems without locks.
    fn lock(&self) -> Option<File> {
        let file = File::open(self.folder.join(FILE)).ok()?;
        file.lock().ok().map(|()| file)
    }

    /// Runs the commands that submit it, one after the other. What was taken before one that is refused is of no use alone, and one that
    /// gave no answer may have been taken: then everything is cancelled.
    pub(crate) fn submit(&self, programs: &Programs, commands: &[Vec<String>]) -> Result<(), DeployError> {
        for command in commands {
            let refused = match programs.run(command, "") {
                Ok(said) if said.is_well => continue,
                Ok(said) => said.refused(),
                // Without the program nothing was submitted.
                Err(error @ DeployError::Missing { .. }) => return Err(error),
                Err(error) => error,
            };
            return Err(self.given_up(refused));
        }
        Ok(())
    }

    /// Cancels what was submitted before an error, and says with it what is left.
    pub(crate) fn given_up(&self, cause: DeployError) -> DeployError {
        DeployError::Submission { cause: Box::new(cause), left: self.cancel_rest() }
    }

    /// Cancels everything, and says whether that was done.
    pub fn cancel_rest(&self) -> String {
        let folder = shell_words::join([self.folder.to_string_lossy()]);
        match self.engine.cancel(self) {
            Ok(()) => "what was submitted is cancelled, nothing is left".to_owned(),
            Err(error) => format!(
                "what was submitted may be left, it could not be cancelled ({error}): try starlings deploy remove {folder}"
            ),
        }
    }

    /// What a worker that runs says of a coordinator that it does not reach: what it tried, and what came of it.
    fn unreached(&self, role: Role) -> Option<String> {
        let line = self.last_lines(role, 1).pop()?;
        let (_, words) = line.split_once(UNREACHED)?;
        Some(format!("it reaches no coordinator at {words}"))
    }

    /// What should be there: the coordinator where it is a job, and the workers.
    pub fn roles(&self) -> Vec<Role> {
        let coordinator = self.order.run_folder.as_ref().map(|_| Role::Coordinator);
        coordinator.into_iter().chain((0..self.order.workers).map(Role::Worker)).collect()
    }

    /// The last lines of the log of a process; empty where it has none.
    pub fn last_lines(&self, role: Role, n: usize) -> Vec<String> {
        logs::last_lines(&self.folder.join(logs::FOLDER).join(role.log()), n)
    }
}

/// Writes a new file that its owner alone can write, whatever the umask.
fn write(path: &Path, text: &str) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).create(true).truncate(true).mode(0o644).open(path)?;
    file.write_all(text.as_bytes())
}

/// Reads a file that this user or root alone can have written.
fn read(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let found = file.metadata()?;
    let own = rustix::process::geteuid().as_raw();
    if found.uid() != own && found.uid() != 0 {
        return Err(io::Error::other(format!("it belongs to user {}, and not to this one", found.uid())));
    }
    if found.mode() & 0o022 != 0 {
        return Err(io::Error::other(
            "others can write it: look through it, then take that from them with chmod go-w",
        ));
    }
    let mut text = String::new();
    file.read_to_string(&mut text)?;
    Ok(text)
}
