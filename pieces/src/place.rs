//! A place that machines share, as people name it: a folder that all of them see under some path.
//!
//! Every run has a folder of its own in it, so that runs do not remove each other's pieces. Workers of other users read and write
//! there only where the place is a group's, with the set-group-ID bit and writable by the group (`chmod 2770`), and all of them belong
//! to it; whoever is of the group may then read the states of the study and spoil them, which is found when they are read.

use std::path::PathBuf;
use std::str::FromStr;

use crate::{Folder, hex};

/// The name of a shared place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlaceName(PathBuf);

impl FromStr for PlaceName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.is_empty() {
            return Err("expected a folder that all machines see".to_owned());
        }
        if let Some((scheme, _)) = text.split_once("://") {
            return Err(format!(
                "states are shared through a folder that all machines see; {scheme} is none"
            ));
        }
        let path = std::path::absolute(text).map_err(|error| error.to_string())?;
        Ok(Self(path))
    }
}

impl std::fmt::Display for PlaceName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.display().fmt(f)
    }
}

impl PlaceName {
    /// The folder of one run, by the number that the run drew for itself. It is made when the first piece is written.
    pub fn of_run(&self, run: &[u8; 16]) -> Folder {
        Folder::inside(&self.0, &format!("starlings-{}", hex(run)))
    }
}
