//! Why a piece cannot be kept or read.

use std::path::PathBuf;
use std::sync::Arc;

/// What is wrong with a piece or with the place where it stands.
#[derive(Clone, Debug, thiserror::Error)]
pub enum PieceError {
    /// The folder refuses.
    #[error("cannot {what} {} for the states of particles: {source}{}", path.display(), remedy(source))]
    Folder {
        /// What was tried.
        what: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: Arc<std::io::Error>,
    },
    /// The bucket refuses or does not answer.
    #[cfg(feature = "s3")]
    #[error(
        "cannot {what} {} for the states of particles: {says}; the bucket has to be there, and AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_REGION \
         and, for a service that is not Amazon's, AWS_ENDPOINT say how to reach it", url.display()
    )]
    Bucket {
        /// What was tried.
        what: &'static str,
        /// The bucket with the prefix.
        url: PathBuf,
        /// What was answered.
        says: String,
    },
    /// A piece that is not there.
    #[error("the piece {piece} of a particle's state is missing: expected the file {}", path.display())]
    Missing {
        /// Name of the piece, hexadecimal.
        piece: String,
        /// Where it was expected.
        path: PathBuf,
    },
    /// A piece that is not what its name says.
    #[error("the piece {piece} of a particle's state is damaged: the file {} holds something else", path.display())]
    Damaged {
        /// Name of the piece, hexadecimal.
        piece: String,
        /// Where it stands.
        path: PathBuf,
    },
}

fn remedy(source: &std::io::Error) -> &'static str {
    match source.kind() {
        std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded => {
            "; its disk is full: free some space, or name a folder on another disk"
        }
        std::io::ErrorKind::PermissionDenied | std::io::ErrorKind::ReadOnlyFilesystem => {
            "; name a folder that this user may write"
        }
        _ => "",
    }
}
