//! Which program a process runs: the BLAKE3 of its file, by which builds are told apart.
//!
//! A coordinator that starts workers of its own program tells them what it found, with the file that it found it of: a worker that runs
//! this file need not read all of it once more before it can say what it is. Next file to read: [`crate::convert`].

use std::fs::File;
use std::os::unix::fs::MetadataExt;
use std::sync::OnceLock;

/// Environment variable with which a process tells others of its program what [`own_build`] says: [`build_of_file`].
pub const BUILD: &str = "STARLINGS_BUILD";

/// BLAKE3 of the running program; `None` when it cannot be read.
pub fn own_build() -> Option<[u8; 32]> {
    Some(own()?.1)
}

/// The file of the running program, as it was when it was read, and its BLAKE3, for the environment of processes that are to run it; `None` when it
/// cannot be read.
pub fn build_of_file() -> Option<String> {
    let (file, build) = own()?;
    Some(format!("{file} {}", blake3::Hash::from_bytes(*build).to_hex()))
}

/// The file of the running program, and its BLAKE3.
fn own() -> Option<&'static (String, [u8; 32])> {
    static OWN: OnceLock<Option<(String, [u8; 32])>> = OnceLock::new();
    let found = OWN.get_or_init(|| {
        let file = running().ok()?;
        // Before it is read: what is written to it meanwhile makes another file of it.
        let is = of_file(&file)?;
        let told = std::env::var(BUILD).ok().and_then(|told| known(&told, &is));
        Some((is, told.or_else(|| hash(file))?))
    });
    found.as_ref()
}

/// The file that this process runs, also after another was put in its place.
fn running() -> std::io::Result<File> {
    File::open("/proc/self/exe").or_else(|_| File::open(std::env::current_exe()?))
}

/// Which file it is, and since when it is as it is.
fn of_file(file: &File) -> Option<String> {
    let is = file.metadata().ok()?;
    Some(format!("{}:{}:{}:{}.{:09}", is.dev(), is.ino(), is.size(), is.mtime(), is.mtime_nsec()))
}

/// The BLAKE3 that is told, where it is told of this file.
fn known(told: &str, file: &str) -> Option<[u8; 32]> {
    let (of, build) = told.split_once(' ')?;
    let build = blake3::Hash::from_hex(build).ok()?;
    (of == file).then(|| *build.as_bytes())
}

/// Piece by piece: the whole would be most of what a small run ever holds.
fn hash(file: File) -> Option<[u8; 32]> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(file).ok()?;
    Some(*hasher.finalize().as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_of_a_program_is_believed_of_its_file_only() {
        let told = build_of_file().unwrap_or_default();
        let of = |file: &File| of_file(file).unwrap_or_default();
        let file = running().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(known(&told, &of(&file)), hash(file));
        let other = tempfile::NamedTempFile::new().unwrap_or_else(|error| panic!("{error}"));
        let file = of(other.as_file());
        assert_eq!(known(&told, &file), None, "another file");
        let zeros = "0".repeat(64);
        assert_eq!(known(&format!("{file} {zeros}"), &file), Some([0; 32]));
        for damaged in
            [file.clone(), format!("{file} {}", &zeros[1..]), format!("{file}1 {zeros}"), String::new()]
        {
            assert_eq!(known(&damaged, &file), None, "{damaged}");
        }
    }
}
