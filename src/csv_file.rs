//! A table as CSV, to a file or to standard output, never over what a study needs.

use std::ffi::OsStr;
use std::io::Write;
use std::path::{Component, Path};

use crate::console;
use crate::failure::Failure;

/// Writes the rows, the heading first; `output` `None` is standard output.
pub(crate) fn write<R, F>(output: Option<&Path>, rows: impl IntoIterator<Item = R>) -> Result<(), Failure>
where
    R: IntoIterator<Item = F>,
    F: AsRef<[u8]>,
{
    let lost = |error: std::io::Error| match output {
        None => console::lost(&error),
        Some(path) => Failure::run(format!("cannot write {}: {error}", path.display())),
    };
    let sink: Box<dyn Write> = match output {
        Some(path) => Box::new(
            std::fs::File::create(path)
                .map_err(|e| Failure::input(format!("cannot write {}: {e}", path.display())))?,
        ),
        None => Box::new(std::io::stdout().lock()),
    };
    let mut csv = csv::Writer::from_writer(sink);
    for row in rows {
        csv.write_record(row).map_err(|error| match error.into_kind() {
            csv::ErrorKind::Io(error) => lost(error),
            other => Failure::run(format!("{other:?}")),
        })?;
    }
    csv.flush().map_err(lost)
}

/// Where the files of a study are looked for.
pub(crate) enum Place<'a> {
    /// Its file stands here, and its recordings relative to it.
    Known(&'a Path),
    /// Not known: any file counts whose path ends as the study writes it.
    Unknown,
}

/// Refuses an output that would overwrite the study or a file that it names.
pub(crate) fn spare_study(output: Option<&Path>, study: &str, place: &Place<'_>) -> Result<(), Failure> {
    // What does not exist cannot be overwritten, and a device is no file of a study.
    let existing = output.and_then(|path| Some((path, path.canonicalize().ok()?)));
    let Some((given, target)) = existing.filter(|(_, target)| target.is_file()) else {
        return Ok(());
    };
    let refuse = |what: &str| {
        let given = given.display();
        Err(Failure::input(format!(
            "{given} is {what}, and would be overwritten: choose another file with -o"
        )))
    };
    if std::fs::read(&target).is_ok_and(|bytes| bytes == study.as_bytes()) {
        return refuse("the study file");
    }
    let is_target = |name: &str| match place {
        Place::Known(file) => {
            let beside = file.parent().unwrap_or(Path::new("")).join(name);
            beside.canonicalize().is_ok_and(|path| path == target)
        }
        Place::Unknown => {
            let names = Path::new(name).components().filter_map(|part| match part {
                Component::Normal(part) => Some(part),
                _ => None,
            });
            let names: Vec<&OsStr> = names.collect();
            !names.is_empty() && target.ends_with(names.into_iter().collect::<std::path::PathBuf>())
        }
    };
    // Any quoted text may name a file, and an input as `file:column`.
    let quoted = study.split(['"', '\'', '\n']).filter(|text| !text.trim().is_empty());
    let mut names =
        quoted.flat_map(|text| [Some(text), text.rsplit_once(':').map(|(file, _)| file)]).flatten();
    if names.any(is_target) { refuse("one of the study's data files") } else { Ok(()) }
}
