//! A disk without room under the run folder: a file system of a few pages, mounted for one case in a namespace of its own, that
//! is given room before the resume.
//!
//! Next file to read: [`super::judge`].

use std::fs;
use std::process::Command;

use super::judge::{Outcome, clean};
use super::plan::{Reached, Verb};
use super::processes;
use super::study_folder::StudyFolder;

/// Room of the file systems, KiB: from nearly none to more than a run needs.
pub(crate) const ROOM: [u32; 12] = [4, 16, 40, 72, 104, 136, 168, 200, 264, 360, 600, 2048];

/// Runs, makes room, resumes; the codes and the words stand in files.
const SCRIPT: &str = r#"
mount -t tmpfs -o "size=${ROOM}k" tmpfs "$OUT" || exit 77
"$@" 2> "$KEPT/first"; echo $? > "$KEPT/first-code"
if [ "$(cat "$KEPT/first-code")" != 0 ]; then
  mount -o remount,size=64m "$OUT" || exit 77
  "$@" --resume 2> "$KEPT/second"; echo $? > "$KEPT/second-code"
fi
cp "$OUT"/*.csv "$OUT"/*.json "$KEPT"
"#;

/// Whether file systems may be mounted in a namespace here.
pub(crate) fn may_mount() -> bool {
    let tried = Command::new("unshare").args(["-rm", "mount", "-t", "tmpfs", "tmpfs", "/mnt"]).output();
    tried.is_ok_and(|tried| tried.status.success())
}

/// A study whose folder lies on a disk of so much room.
///
/// # Errors
/// When anything else comes of it than the undisturbed result, or an error that says so and a resume to it.
pub(crate) fn judge(verb: Verb, room: u32) -> Result<Outcome, String> {
    let place = StudyFolder::new(verb, Reached::Command, "");
    fs::create_dir(place.out()).unwrap();
    fs::create_dir(place.path("kept")).unwrap();
    let own = place.command(&[]);
    let mut command = Command::new("unshare");
    command.args(["-rm", "sh", "-c", SCRIPT, "sh"]).arg(own.get_program()).args(own.get_args());
    command.env("ROOM", room.to_string()).env("OUT", place.out()).env("KEPT", place.path("kept"));
    place.furnish(&mut command);
    let judged = disturbed(&place, &mut command, verb);
    processes::end(&place.mark());
    judged.map_err(|fault| format!("{verb:?} on a disk of {room} KiB: {fault}"))
}

fn disturbed(place: &StudyFolder, command: &mut Command, verb: Verb) -> Result<Outcome, String> {
    let ended = place.to_the_end(command)?;
    let kept = |name: &str| fs::read_to_string(place.path("kept").join(name)).unwrap_or_default();
    if !processes::of(&place.mark()).is_empty() {
        super::judge::nothing_left(place, &[&ended])?;
    }
    let (first, said) = (kept("first-code"), kept("first"));
    let outcome = match first.trim() {
        "0" => Outcome::WentOn,
        "1" => {
            if !["disk is full", "disk failed or is full", "No space left"].iter().any(|w| said.contains(w)) {
                return Err(format!("the error does not name the disk: {said}"));
            }
            if kept("second-code").trim() != "0" {
                return Err(format!("the resume failed: {}\nafter: {said}", kept("second")));
            }
            Outcome::Resumed
        }
        code => return Err(format!("ended with {code}: {said} {}", ended.stderr)),
    };
    let found = place.result_in(&place.path("kept"))?;
    if found == clean(verb, Reached::Command).result {
        return Ok(outcome);
    }
    Err(format!("another result ({outcome:?}): {said}"))
}
