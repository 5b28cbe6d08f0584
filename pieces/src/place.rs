//! A place that machines share, as people name it: a folder that all of them see under some path, or a bucket that all of them reach.
//!
//! Every run has a folder of its own in it, so that runs do not remove each other's pieces. Workers of other users read and write
//! there only where the place is a group's, with the set-group-ID bit and writable by the group (`chmod 2770`), and all of them belong
//! to it; whoever is of the group may then read the states of the study and spoil them, which is found when they are read.

use std::path::PathBuf;
use std::str::FromStr;

#[cfg(feature = "s3")]
use crate::bucket::{Bucket, SCHEME};
use crate::files::Files;
use crate::{Folder, hex};

/// The name of a shared place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlaceName(Place);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Place {
    Folder(PathBuf),
    #[cfg(feature = "s3")]
    Bucket(Bucket),
}

impl FromStr for PlaceName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.is_empty() {
            return Err("expected a folder that all machines see".to_owned());
        }
        if let Some((scheme, rest)) = text.split_once("://") {
            return of_scheme(scheme, rest);
        }
        let path = std::path::absolute(text).map_err(|error| error.to_string())?;
        Ok(Self(Place::Folder(path)))
    }
}

#[cfg(feature = "s3")]
fn of_scheme(scheme: &str, rest: &str) -> Result<PlaceName, String> {
    if scheme == SCHEME {
        return Ok(PlaceName(Place::Bucket(Bucket::named(rest)?)));
    }
    Err(format!(
        "states are shared through a folder that all machines see or an s3://BUCKET/PREFIX; {scheme} is none"
    ))
}

#[cfg(not(feature = "s3"))]
fn of_scheme(scheme: &str, _: &str) -> Result<PlaceName, String> {
    let remedy = if scheme == "s3" {
        ": this program was built without it; build it with `cargo build --release --features s3`, or name a folder"
    } else {
        ""
    };
    Err(format!("states are shared through a folder that all machines see; {scheme} is none{remedy}"))
}

impl std::fmt::Display for PlaceName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.0 {
            Place::Folder(path) => path.display().fmt(f),
            #[cfg(feature = "s3")]
            Place::Bucket(bucket) => bucket.url().display().fmt(f),
        }
    }
}

impl PlaceName {
    /// The folder of one run, by the number that the run drew for itself. It is made when the first piece is written.
    pub fn of_run(&self, run: &[u8; 16]) -> Folder {
        let name = format!("starlings-{}", hex(run));
        match &self.0 {
            Place::Folder(path) => Folder::of(Files::inside(path, &name)),
            #[cfg(feature = "s3")]
            Place::Bucket(bucket) => Folder::of(bucket.below(&name)),
        }
    }
}
