//! What a failed run leaves for people to look at: its last words, and its folder.

use crate::process::Process;
use crate::scratch::{Kept, Scratch};

use super::program::Output;

/// Lines of the standard output that a failure shows when the standard error is empty, and the longest of them.
const LINES: usize = 12;
const WIDTH: usize = 240;
/// What the program is told and what it wrote, in the folder of a run that failed.
const TOLD: &str = "starlings-input.json";
const WROTE: &str = "starlings-output.txt";

/// The end of what a program said: on its standard error, else on its standard output.
pub(super) fn said(process: &mut Process, output: &Output) -> String {
    let tail = process.tail();
    if !tail.is_empty() {
        return tail;
    }
    let text = String::from_utf8_lossy(&output.bytes);
    let lines = text.lines().rev().map(str::trim_end).filter(|line| !line.is_empty()).take(LINES);
    let mut last: Vec<String> = lines.map(|line| line.chars().take(WIDTH).collect()).collect();
    last.reverse();
    last.join("\n")
}

/// Whether a program says, in the words of the system, that a disk has no room: then the place is at fault, and not the parameters. A
/// control run cannot tell, since the folders of other runs come and go beside it.
pub(super) fn lacks_room(said: &str) -> bool {
    ["No space left on device", "Disk quota exceeded"].iter().any(|words| said.contains(words))
}

/// Keeps the folder of a run that failed, with what the program was told and wrote; says where it is.
pub(super) fn kept(scratch: Scratch, failure: &str, told: &str, output: &Output) -> String {
    match scratch.keep(failure) {
        Kept::This(folder) => {
            // Without these two the folder is still of use.
            let _ = std::fs::write(folder.join(TOLD), told);
            let _ = std::fs::write(folder.join(WROTE), &output.bytes);
            format!("; the folder of the run is kept: {}", folder.display())
        }
        Kept::Alike(folder) => {
            format!("; the folder of a run that failed alike is kept: {}", folder.display())
        }
        Kept::TooMany => String::new(),
    }
}
