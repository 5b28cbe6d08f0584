//! Files that a study names, named from the folder that its copy stands in.
//!
//! Absolute paths stay as they are. A file is found by its real place, so that links and `..` on the way do no harm.

use std::path::{Component, Path, PathBuf};

use starlings_models::SOLVER;
use toml_edit::{DocumentMut, Item, TableLike, Value};

use super::{array, each_table, set_text, text};

/// Renames every file of the study: initial values, recordings, inputs of their own files, surfaces, those of a solver.
pub(super) fn relocate(document: &mut DocumentMut, study: &Path, to: &Path) {
    let from = study.parent().unwrap_or(Path::new(""));
    let Some(to) = real(to) else { return };
    let moved = |name: &str| moved(from, &to, name);
    if let Some(model) = document.get_mut("model").and_then(Item::as_table_like_mut)
        && let Some(new) = moved(&text(model, "initial"))
    {
        set_text(model, "initial", &new);
    }
    if let Some(model) = document.get_mut("model").and_then(Item::as_table_like_mut)
        && text(model, "kind") == SOLVER
    {
        relocate_solver(model, from, &to);
    }
    each_table(document.as_table_mut(), "records", &mut |record| {
        if let Some(new) = moved(&text(record, "file")) {
            set_text(record, "file", &new);
        }
        if let Some(inputs) = record.get_mut("inputs").and_then(Item::as_table_like_mut) {
            let names: Vec<String> = inputs.iter().map(|(key, _)| key.to_owned()).collect();
            for name in names {
                let written = text(inputs, &name);
                // `other.csv:column`; a column of the record's own file may hold a colon too.
                let new = written.rsplit_once(':').and_then(|(f, c)| Some(format!("{}:{c}", moved(f)?)));
                if let Some(new) = new {
                    set_text(inputs, &name, &new);
                }
            }
        }
        each_table(record, "channels", &mut |channel| {
            for key in ["surface", "rest"] {
                if let Some(new) = moved(&text(channel, key)) {
                    set_text(channel, key, &new);
                }
            }
        });
    });
}

/// Renames the files of a solver and the folder that it runs in, from which its command leads.
fn relocate_solver(model: &mut dyn TableLike, from: &Path, to: &Path) {
    let moved = |name: &str| moved(from, to, name);
    if let Some(new) = moved(&text(model, "described")) {
        set_text(model, "described", &new);
    }
    for key in ["templates", "copies"] {
        let Some(files) = model.get_mut(key).and_then(Item::as_table_like_mut) else { continue };
        let names: Vec<String> = files.iter().map(|(name, _)| name.to_owned()).collect();
        for name in names {
            if let Some(new) = moved(&text(files, &name)) {
                set_text(files, &name, &new);
            }
        }
    }
    for file in array(model, "copies").into_iter().flat_map(|list| list.iter_mut()) {
        if let Some(new) = file.as_str().and_then(moved) {
            let decor = file.decor().clone();
            *file = Value::from(new);
            *file.decor_mut() = decor;
        }
    }
    let folder = text(model, "folder");
    if Path::new(&folder).is_absolute() {
        return;
    }
    let Some(place) = real(&from.join(&folder)) else { return };
    let parts: Vec<String> = between(to, &place)
        .components()
        .map(|part| part.as_os_str().to_string_lossy().into_owned())
        .collect();
    model.insert("folder", toml_edit::value(if parts.is_empty() { ".".to_owned() } else { parts.join("/") }));
}

/// The name of an existing file as seen from the folder `to`; nothing for an absolute path or what is no file.
fn moved(from: &Path, to: &Path, name: &str) -> Option<String> {
    let file = from.join(name);
    if name.is_empty() || Path::new(name).is_absolute() || !file.is_file() {
        return None;
    }
    let place = real(file.parent()?)?.join(file.file_name()?);
    let parts: Vec<String> = between(to, &place)
        .components()
        .map(|part| part.as_os_str().to_string_lossy().into_owned())
        .collect();
    Some(parts.join("/"))
}

fn real(folder: &Path) -> Option<PathBuf> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    folder.canonicalize().or_else(|_| std::path::absolute(folder)).ok()
}

/// The way from one absolute folder to an absolute file; the file itself where they share no root.
fn between(folder: &Path, file: &Path) -> PathBuf {
    let (a, b): (Vec<Component<'_>>, Vec<Component<'_>>) =
        (folder.components().collect(), file.components().collect());
    let shared = a.iter().zip(&b).take_while(|(x, y)| x == y).count();
    if shared == 0 {
        return file.to_owned();
    }
    let up = std::iter::repeat_n(Component::ParentDir, a.len() - shared);
    up.chain(b[shared..].iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_goes_up_to_the_shared_folder_and_down_again() {
        let way = |folder: &str, file: &str| between(Path::new(folder), Path::new(file));
        assert_eq!(way("/a/runs/one", "/a/data/x.csv"), Path::new("../../data/x.csv"));
        assert_eq!(way("/a", "/a/x.csv"), Path::new("x.csv"));
        assert_eq!(way("/a/b", "/x.csv"), Path::new("../../x.csv"));
    }
}
