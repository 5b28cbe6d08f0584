//! Why nothing was deployed, or nothing is known of what was.

use std::io;
use std::path::PathBuf;

/// Why a deployment could not be made, asked or cancelled.
#[derive(Debug, thiserror::Error)]
pub enum DeployError {
    /// A program of the engine is not on this machine.
    #[error("there is no program `{program}` on this machine, which {engine} has: {remedy}")]
    Missing {
        /// The program.
        program: String,
        /// Whose it is.
        engine: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// This machine gives no means to start a program.
    #[error("cannot start {program}: {source}")]
    Unstarted {
        /// The program.
        program: String,
        /// What the system said.
        source: io::Error,
    },
    /// The engine did not take what was submitted.
    #[error("{program} refused the submission: {said}\n  it was asked with: {command}")]
    Refused {
        /// The program.
        program: String,
        /// Its words.
        said: String,
        /// The whole command.
        command: String,
    },
    /// A submission did not come to its end.
    #[error("{cause}\n  {left}")]
    Submission {
        /// Why.
        cause: Box<DeployError>,
        /// What is left of it.
        left: String,
    },
    /// A program of the engine failed.
    #[error("{program} failed: {said}\n  it was called with: {command}")]
    Failed {
        /// The program.
        program: String,
        /// Its words.
        said: String,
        /// The whole command.
        command: String,
    },
    /// A program of the engine did not end.
    #[error("{program} gave no answer within {seconds} s: is the engine up? It was called with: {command}")]
    NoAnswer {
        /// The program.
        program: String,
        /// How long it was waited for.
        seconds: u64,
        /// The whole command.
        command: String,
    },
    /// The folder holds no deployment.
    #[error("{} is no folder of a deployment ({reason}): name one that `starlings deploy` wrote", path.display())]
    NoDeployment {
        /// The folder.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The folder for a deployment has something in it.
    #[error("{} is not empty: give a folder that is free with --out", .0.display())]
    Occupied(PathBuf),
    /// An option for the engine that a deployment sets itself.
    #[error("{option} cannot be given to {engine}: {reason}")]
    Option {
        /// The option.
        option: String,
        /// The engine.
        engine: &'static str,
        /// Who sets it.
        reason: &'static str,
    },
    /// An engine whose workers are as many as were asked for.
    #[error(
        "the number of workers under the engine `{0}` does not follow the work: use Slurm, or submit another deployment"
    )]
    NotElastic(&'static str),
    /// A path that no script can name safely.
    #[error("{:?} has a backslash, a control character or a letter that is no UTF-8 in it: choose another folder or name", .0)]
    Path(PathBuf),
    /// The study does not fit into a ConfigMap.
    #[error(
        "the study and its files have {bytes} bytes, and a ConfigMap holds {most}: put its folder on a volume and name its claim with \
         --study-claim"
    )]
    TooLarge {
        /// Bytes of all files.
        bytes: usize,
        /// Bytes that fit.
        most: usize,
    },
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A script could not be made.
    #[error("the script {name} could not be made: {source}")]
    Script {
        /// Its name.
        name: &'static str,
        /// What the templates say.
        source: minijinja::Error,
    },
}

impl DeployError {
    /// Whether what the user gave is at fault, and not the machine.
    pub fn is_input(&self) -> bool {
        match self {
            Self::Missing { .. }
            | Self::Refused { .. }
            | Self::NoDeployment { .. }
            | Self::Occupied(_)
            | Self::Path(_)
            | Self::NotElastic(_)
            | Self::Unreadable { .. }
            | Self::TooLarge { .. }
            | Self::Option { .. } => true,
            Self::Submission { cause, .. } => cause.is_input(),
            Self::Unwritable { source, .. } => source.kind() != io::ErrorKind::StorageFull,
            Self::Unstarted { .. } | Self::Failed { .. } | Self::NoAnswer { .. } | Self::Script { .. } => {
                false
            }
        }
    }
}
