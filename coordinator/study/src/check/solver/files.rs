//! The files of a solver: templates, which are read here and become part of the study; files to copy, which must exist; a
//! description that was written where the solver can be asked.
//!
//! Next file to read: [`super`].

use std::collections::BTreeMap;
use std::path::{Component, Path};
use std::sync::Arc;

use starlings_models::{Description, FaultPlace, SolverDef, SolverFault, did_you_mean, nearest};
use toml::Spanned;

use crate::file::Named;
use crate::file::solver::ProgramSection;
use crate::problem::{Problem, Source};

/// Texts of the templates by file of the run.
pub(super) fn templates(
    source: &Source,
    section: &ProgramSection,
    folder: &Path,
) -> BTreeMap<String, String> {
    check_names(source, &section.templates);
    let text = |(name, file): &(Spanned<String>, Spanned<String>)| {
        Some((name.get_ref().clone(), read(source, file, folder)?))
    };
    section.templates.iter().filter_map(text).collect()
}

/// Absolute paths of the files to copy by file of the run.
pub(super) fn copies(source: &Source, section: &ProgramSection, folder: &Path) -> BTreeMap<String, String> {
    check_names(source, &section.copies);
    let mut copies = BTreeMap::new();
    for (name, file) in &section.copies {
        let path = folder.join(file.get_ref());
        if !path.is_file() {
            let message = format!("cannot copy `{}`: there is no such file", path.display());
            source.report_with(file.span(), message, beside(folder, file.get_ref()));
        }
        if let Some((_, template)) = section.templates.iter().find(|(t, _)| t.get_ref() == name.get_ref()) {
            let message = format!(
                "`{}` is both copied and made from the template `{}`",
                name.get_ref(),
                template.get_ref()
            );
            source.report_with(name.span(), message, "remove one of the two");
        }
        copies.insert(name.get_ref().clone(), path.to_string_lossy().into_owned());
    }
    copies
}

/// The description in a file.
pub(super) fn described(source: &Source, name: &Spanned<String>, folder: &Path) -> Option<Description> {
    let text = read(source, name, folder)?;
    let description = serde_json::from_str(&text).map_err(|error| {
        let message = format!("`{}` holds no description of a solver: {error}", name.get_ref());
        let help = "`starlings worker --solver \"COMMAND\" --describe` prints one";
        source.report_with(name.span(), message, help);
    });
    description.ok()
}

/// Reports the faults that were found in the solver's files: of a template at its line, others where the study names the file.
pub(super) fn report(
    source: &Source,
    section: &ProgramSection,
    def: &SolverDef,
    folder: &Path,
    fault: SolverFault,
) {
    let SolverFault { place, message, help } = fault;
    let named = |list: &[crate::file::solver::ProgramQuantity], name: &str| {
        list.iter()
            .find(|q| q.name.get_ref() == name)
            .map(|q| (q.name.span(), q.read.as_ref().map(Spanned::span)))
    };
    let span = match &place {
        FaultPlace::Template(name, line) => {
            let text = def.files.as_ref().and_then(|files| files.templates.get(name));
            let file = section.templates.iter().find(|(n, _)| n.get_ref() == name).map(|(_, file)| file);
            if let (Some(text), Some(file)) = (text, file) {
                let start: usize = text.split_inclusive('\n').take(line - 1).map(str::len).sum();
                let length = text[start..].lines().next().map_or(0, str::len);
                source.adopt(Problem {
                    message,
                    help,
                    file: folder.join(file.get_ref()),
                    source_text: Some(Arc::from(text.as_str())),
                    span: Some(start..start + length),
                });
                return;
            }
            None
        }
        FaultPlace::Output(name) => named(&section.outputs, name).map(|(name, rule)| rule.unwrap_or(name)),
        FaultPlace::Parameter(name) => named(&section.parameters, name).map(|(name, _)| name),
        FaultPlace::Command => None,
    };
    let span = span.unwrap_or_else(|| section.place.clone());
    match help {
        Some(help) => source.report_with(span, message, help),
        None => source.report(span, message),
    }
}

/// A file of the run stays in its folder, and is one.
fn check_names(source: &Source, files: &Named<String>) {
    for (i, (name, _)) in files.iter().enumerate() {
        let path = Path::new(name.get_ref());
        let inside = path.components().all(|part| matches!(part, Component::Normal(_)));
        if name.get_ref().is_empty() || !inside {
            let message = format!("`{}` is no file in the folder of a run", name.get_ref());
            source.report_with(
                name.span(),
                message,
                "give a name such as `beam.inp`, without `..` and not absolute",
            );
        }
        if files[..i].iter().any(|(earlier, _)| earlier.get_ref() == name.get_ref()) {
            let message = format!("two files become `{}` in the folder of a run", name.get_ref());
            let help = "give the names of the run's files: `copies = { \"a.inp\" = \"one/mesh.inp\" }`";
            source.report_with(name.span(), message, help);
        }
    }
}

fn read(source: &Source, file: &Spanned<String>, folder: &Path) -> Option<String> {
    let path = folder.join(file.get_ref());
    let bytes = std::fs::read(&path).map_err(|error| {
        let reason = if error.kind() == std::io::ErrorKind::NotFound {
            "there is no such file".to_owned()
        } else {
            error.to_string()
        };
        let message = format!("cannot read `{}`: {reason}", path.display());
        source.report_with(file.span(), message, beside(folder, file.get_ref()));
    });
    let text = String::from_utf8(bytes.ok()?).map_err(|_| {
        let message = format!("`{}` is not UTF-8 text", file.get_ref());
        source.report_with(file.span(), message, "save it as text in UTF-8");
    });
    text.ok()
}

/// The nearest file beside one that is missing, or where it is looked for.
fn beside(folder: &Path, name: &str) -> String {
    let folder = folder.join(name).parent().map_or(folder.to_owned(), Path::to_owned);
    let present: Vec<String> = std::fs::read_dir(&folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .collect();
    let file = name.rsplit('/').next().unwrap_or(name);
    match nearest(file, &present) {
        Some(near) => did_you_mean(near),
        None => format!("files are looked for in `{}`, the folder of the study", folder.display()),
    }
}
