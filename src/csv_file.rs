//! A table as CSV, to a file or to standard output, never over what a study needs.

use std::borrow::Cow;
use std::ffi::OsStr;
use std::io::Write;
use std::path::{Component, Path, PathBuf};

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
        csv.write_record(row.into_iter().map(|cell| inert(cell.as_ref()).into_owned())).map_err(|error| {
            match error.into_kind() {
                csv::ErrorKind::Io(error) => lost(error),
                other => Failure::run(format!("{other:?}")),
            }
        })?;
    }
    csv.flush().map_err(lost)
}

/// A cell that no spreadsheet takes for a formula: a text that begins like one gets an apostrophe before it.
fn inert(cell: &[u8]) -> Cow<'_, [u8]> {
    let is_number = || std::str::from_utf8(cell).is_ok_and(|text| text.parse::<f64>().is_ok());
    match cell.first() {
        Some(b'=' | b'+' | b'-' | b'@' | b'\t' | b'\r') if !is_number() => [b"'", cell].concat().into(),
        _ => cell.into(),
    }
}

/// Where the files of a study are looked for.
pub(crate) enum StudyLocation<'a> {
    /// Its file stands here, and its recordings relative to it.
    Known(&'a Path),
    /// Not known: any file counts whose path ends as the study writes it.
    Unknown,
}

/// A file that a command writes, with the option that names it.
type Output<'a> = (&'static str, &'a Option<PathBuf>);

/// Refuses, before anything runs, outputs that would overwrite the study, its data or each other, or cannot be written.
pub(crate) fn check_outputs(
    outputs: &[Output<'_>],
    study: &str,
    location: &StudyLocation<'_>,
) -> Result<(), Failure> {
    let given: Vec<(&str, &Path)> =
        outputs.iter().filter_map(|(option, path)| Some((*option, path.as_deref()?))).collect();
    for (i, (option, path)) in given.iter().enumerate() {
        spare_study(path, study, location).map_err(|failure| failure.with(&format!(" with {option}")))?;
        let same = |other: &&(&str, &Path)| is_same(other.1, path);
        if let Some((earlier, _)) = given[..i].iter().find(same) {
            let path = path.display();
            return Err(Failure::input(format!(
                "{earlier} and {option} both name {path}, and one would overwrite the other: choose two files"
            )));
        }
        probe(path)
            .map_err(|e| Failure::input(format!("cannot write {} ({option}): {e}", path.display())))?;
    }
    Ok(())
}

/// Whether two paths are one file, there or still to be made; a device takes any number of outputs.
fn is_same(one: &Path, other: &Path) -> bool {
    let place = |path: &Path| {
        let made = || Some(folder_of(path).canonicalize().ok()?.join(path.file_name()?));
        path.canonicalize().ok().or_else(made).filter(|path| !path.exists() || path.is_file())
    };
    one == other && !one.exists() || place(one).is_some_and(|path| place(other) == Some(path))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Opens a file for writing and leaves everything as it was; a device or a pipe is not touched.
fn probe(path: &Path) -> std::io::Result<()> {
    let mut options = std::fs::OpenOptions::new();
    if path.is_file() || path.is_dir() {
        return options.write(true).open(path).map(drop);
    }
    if path.symlink_metadata().is_ok() {
        return Ok(());
    }
    options.write(true).create_new(true).open(path)?;
    std::fs::remove_file(path)
}

/// Refuses an output that would overwrite the study or a file that it names.
fn spare_study(output: &Path, study: &str, location: &StudyLocation<'_>) -> Result<(), Failure> {
    // What does not exist cannot be overwritten, and a device is no file of a study.
    let Some(target) = output.canonicalize().ok().filter(|target| target.is_file()) else {
        return Ok(());
    };
    let refuse = |what: &str| {
        let given = output.display();
        Err(Failure::input(format!("{given} is {what}, and would be overwritten: choose another file")))
    };
    if std::fs::read(&target).is_ok_and(|bytes| bytes == study.as_bytes()) {
        return refuse("the study file");
    }
    let is_target = |name: &str| match location {
        StudyLocation::Known(file) => {
            let beside = file.parent().unwrap_or(Path::new("")).join(name);
            beside.canonicalize().is_ok_and(|path| path == target)
        }
        StudyLocation::Unknown => {
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

#[cfg(test)]
mod tests {
    use super::inert;

    #[test]
    fn numbers_stay_and_formulas_become_texts() {
        for number in ["-1.5e-3", "+2", "0.25", "-inf", "pressure", ""] {
            assert_eq!(*inert(number.as_bytes()), *number.as_bytes());
        }
        for formula in ["=HYPERLINK(\"http://x\")", "+A1", "-2+3", "@SUM(1)", "\tx"] {
            assert_eq!(*inert(formula.as_bytes()), *format!("'{formula}").as_bytes());
        }
    }
}
