//! Who may look into a folder of pieces.

use std::fs::Permissions;
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::Path;

/// Whose the pieces are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    /// The user's alone.
    Own,
    /// Those of a group.
    Group,
}

/// That a group may write into a folder, and that what is made there is the group's (`chmod g+ws`).
const OF_GROUP: u32 = 0o2020;

impl Access {
    /// That of a folder which somebody else made: what is made in it is the group's only where the folder says so. One into which
    /// a group may write and whose files are not the group's, as `/tmp` is, says nothing.
    pub(crate) fn of(place: &Path) -> Self {
        let is_group = std::fs::metadata(place).is_ok_and(|found| found.mode() & OF_GROUP == OF_GROUP);
        if is_group { Self::Group } else { Self::Own }
    }

    pub(crate) fn of_folder(self) -> Permissions {
        Permissions::from_mode(match self {
            Self::Own => 0o700,
            Self::Group => 0o2770,
        })
    }

    pub(crate) fn of_file(self) -> Permissions {
        Permissions::from_mode(match self {
            Self::Own => 0o600,
            Self::Group => 0o660,
        })
    }

    /// Makes a folder with those above it.
    pub(crate) fn make(self, path: &Path) -> io::Result<()> {
        let mode = self.of_folder();
        std::fs::DirBuilder::new().recursive(true).mode(mode.mode()).create(path)?;
        self.open_up(path, &mode)
    }

    /// Lets the group in where this process would keep it out (`umask`).
    pub(crate) fn open_up(self, path: &Path, mode: &Permissions) -> io::Result<()> {
        if self == Self::Own { Ok(()) } else { std::fs::set_permissions(path, mode.clone()) }
    }
}

#[cfg(test)]
mod tests {
    use crate::{PieceName, PlaceName};

    use super::*;

    fn modes(place: u32) -> (u32, u32) {
        let scratch = tempfile::tempdir().expect("a folder");
        std::fs::set_permissions(scratch.path(), Permissions::from_mode(place)).expect("it is ours");
        let place: PlaceName = scratch.path().to_str().expect("a name").parse().expect("a folder");
        let folder = place.of_run(&[1; 16]);
        let name: PieceName = *blake3::hash(b"one").as_bytes();
        folder.put(&name, b"one").expect("room");
        let mode = |path: &Path| std::fs::metadata(path).expect("it is there").mode() & 0o7777;
        (mode(folder.path()), mode(&folder.path().join(crate::hex(&name))))
    }

    #[test]
    fn pieces_are_the_users_own_unless_the_shared_folder_is_a_groups() {
        for place in [0o700, 0o755, 0o775, 0o1777] {
            assert_eq!(modes(place), (0o700, 0o600), "in a folder with {place:o}");
        }
        for place in [0o2770, 0o2775] {
            assert_eq!(modes(place), (0o2770, 0o660), "in a folder with {place:o}");
        }
    }
}
