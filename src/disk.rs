//! Room on the disk of a run folder, before anything is written there.
//!
//! A run that fills the disk stops with its remedy and can be continued; this says so before hours are spent. What matters is what the
//! run will write: a share of a large disk is more than any run needs. Next file to read: [`crate::run_folder`].

use std::path::Path;

use starlings_coordinator::study::Study;

use crate::console::note;
use crate::failure::Failure;

/// Bytes that stay free for everybody else.
const MARGIN: u64 = 64 << 20;

/// A disk with less than this share free is called nearly full, where less than [`AMPLE`] is free.
const SHARE: f64 = 0.1;

/// Bytes that are enough for anybody.
const AMPLE: u64 = 10 << 30;

/// Refuses a disk that cannot hold what the run will write, and warns of one that is nearly full. A run that goes on writes what
/// its folder does not hold yet, and nobody else needs to be spared for its sake.
pub(crate) fn check(study: &Study, folder: &Path, shares: bool, goes_on: bool) -> Result<(), Failure> {
    // Twice while they are replaced, where they do not stand in a folder that machines share.
    let elsewhere = if shares && study.has_large_states() { 2 * study.bytes_of_states() } else { 0 };
    let needed = study.bytes_of_a_run().saturating_sub(elsewhere);
    let margin = if goes_on { 0 } else { MARGIN };
    let written = if goes_on { size_of_files(folder) } else { 0 };
    judged(
        folder,
        needed.saturating_sub(written),
        margin,
        "free some space, or choose a folder on another disk with --out",
    )
}

/// The same of the folder for states that machines share, of which a step needs three per particle.
pub(crate) fn check_states(study: &Study, place: Option<&str>, goes_on: bool) -> Result<(), Failure> {
    // What is there of a run that goes on is known to nobody yet, and a bucket is never full.
    let place = place.filter(|place| !place.contains("://"));
    let Some(folder) = place.filter(|_| !goes_on).map(Path::new) else { return Ok(()) };
    // Smaller ones never stand there.
    if !study.has_large_states() {
        return Ok(());
    }
    judged(folder, 3 * study.bytes_of_states(), 0, "free some space, or name another folder with --states")
}

/// Bytes of the files of a folder and of the folders in it.
fn size_of_files(folder: &Path) -> u64 {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let of = |entry: std::fs::DirEntry| match entry.metadata() {
        Ok(found) if found.is_dir() => size_of_files(&entry.path()),
        found => found.map_or(0, |found| found.len()),
    };
    entries.map(of).sum()
}

fn judged(folder: &Path, needed: u64, margin: u64, remedy: &str) -> Result<(), Failure> {
    // The folder itself may not be there yet.
    let Some(there) = folder.ancestors().find(|path| path.is_dir()) else { return Ok(()) };
    let there = if there.as_os_str().is_empty() { Path::new(".") } else { there };
    // A file system that does not say has nothing to be checked.
    let Ok(disk) = rustix::fs::statvfs(there) else { return Ok(()) };
    let (free, all) =
        (disk.f_bavail.saturating_mul(disk.f_frsize), disk.f_blocks.saturating_mul(disk.f_frsize));
    match judge(free, all, needed, margin, remedy) {
        Room::Enough => Ok(()),
        Room::Low(text) => {
            note(format_args!("warning: {}: {text}", folder.display()));
            Ok(())
        }
        Room::TooLittle(text) => Err(Failure::input(format!("{}: {text}", folder.display()))),
    }
}

/// What a disk is for a run.
#[derive(Debug, PartialEq, Eq)]
enum Room {
    Enough,
    Low(String),
    TooLittle(String),
}

fn judge(free: u64, all: u64, needed: u64, margin: u64, remedy: &str) -> Room {
    // Some file systems, as those in memory without a limit, have no size.
    if all == 0 {
        return Room::Enough;
    }
    let sizes = format!("{} of {} are free on its disk", size(free), size(all));
    if free < needed.saturating_add(margin) {
        return Room::TooLittle(format!("{sizes}, and this run writes about {}: {remedy}", size(needed)));
    }
    let nearly_full = (free as f64) < SHARE * all as f64 && free < AMPLE;
    if nearly_full || free < needed.saturating_mul(4) {
        return Room::Low(format!(
            "{sizes}; this run writes about {}. When the disk is full it stops and can be continued with --resume; {remedy}",
            size(needed)
        ));
    }
    Room::Enough
}

/// Bytes for people.
pub(crate) fn size(bytes: u64) -> String {
    let units = ["KiB", "MiB", "GiB", "TiB"];
    let mut value = bytes as f64 / 1024.0;
    let mut unit = 0;
    while value >= 1000.0 && unit + 1 < units.len() {
        (value, unit) = (value / 1024.0, unit + 1);
    }
    format!("{value:.3} {}", units[unit]).replace(".000 ", " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const GIB: u64 = 1 << 30;

    fn of(free: u64, all: u64, needed: u64) -> Room {
        judge(free, all, needed, MARGIN, "free some space, or choose a folder on another disk")
    }

    #[test]
    fn a_disk_is_judged_by_what_the_run_writes_and_not_by_its_share_alone() {
        assert_eq!(of(50 * GIB, 10_000 * GIB, GIB), Room::Enough, "half a per cent of a large disk");
        assert!(matches!(of(GIB, 20 * GIB, 1 << 20), Room::Low(_)), "a twentieth of a small one");
        assert_eq!(of(3 * GIB, 20 * GIB, 1 << 20), Room::Enough);
        assert!(matches!(of(30 * GIB, 40 * GIB, 9 * GIB), Room::Low(_)), "most of it would be written");
        assert!(matches!(of(MARGIN, 20 * GIB, 1), Room::TooLittle(_)));
        assert_eq!(of(0, 0, GIB), Room::Enough, "no size is known");
        assert!(
            matches!(judge(MARGIN, 20 * GIB, 1, 0, ""), Room::Low(_)),
            "a run that goes on needs no margin"
        );
    }

    #[test]
    fn the_refusal_says_what_is_free_what_is_needed_and_what_to_do() {
        let Room::TooLittle(text) = of(100 << 20, 20 * GIB, 3 * GIB / 2) else { panic!("it fits nowhere") };
        let wanted = "100 MiB of 20 GiB are free on its disk, and this run writes about 1.500 GiB: free some space, or choose";
        assert!(text.starts_with(wanted), "{text}");
    }
}
