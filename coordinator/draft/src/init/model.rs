//! The model of a study: what it says of itself, and the lines of `[model]`.
//!
//! Next file to read: [`super::roles`].

use std::path::{Path, PathBuf};

use serde_json::Value;
use starlings_models::catalogue::{self, EQUATIONS};
use starlings_models::{ModelDef, SolverDef, Spec, meant, nearest};
use starlings_study::SolverHost;
use toml_edit::{DocumentMut, Item, Table};

use super::{Ask, ModelWish, Question, Wishes};
use crate::DraftError;
use crate::files::quoted;

/// A model that is chosen.
#[derive(Debug)]
pub(super) struct Model {
    /// What it says of itself; `None` where the study writes equations.
    pub(super) spec: Option<Spec>,
    /// Lines of `[model]`, without the constants.
    pub(super) lines: String,
    /// Lines of `[model.layout]` and what is below it, which stand after the constants.
    pub(super) layout: String,
    /// Constants that its file gives.
    pub(super) constants: Vec<(String, f64)>,
    /// A file that is copied into the study's folder.
    pub(super) copy: Option<PathBuf>,
    /// One word for it.
    pub(super) name: String,
}

/// Finds the model that is wanted; asks where nothing says it.
pub(super) fn model(
    wishes: &Wishes,
    out: &Path,
    host: &SolverHost,
    ask: Ask<'_>,
) -> Result<Model, DraftError> {
    match &wishes.model {
        Some(ModelWish::Kind(kind)) => of_kind(kind).map_err(DraftError::Wish),
        Some(ModelWish::Layout(file, kind)) => {
            of_layout(file, kind.as_deref()).map_err(|message| DraftError::file(file, message))
        }
        Some(ModelWish::Solver(def)) => of_solver(def, out, host).map_err(DraftError::Wish),
        Some(ModelWish::Fmu(file)) => of_fmu(file, host).map_err(|message| DraftError::file(file, message)),
        None if wishes.recordings.is_empty() => {
            let message =
                "nothing says what the study is about: give a recording, or a model by --model or --solver";
            Err(DraftError::Wish(message.to_owned()))
        }
        None => {
            let kinds: Vec<String> = catalogue::specs().into_iter().map(|spec| spec.kind).collect();
            let question = Question {
                text: "Which model? (`equations` writes one into the study, for you to change)".to_owned(),
                choices: kinds,
                default: Some(EQUATIONS.to_owned()),
                option: "--model KIND".to_owned(),
            };
            of_kind(&ask(&question).unwrap_or_else(|| EQUATIONS.to_owned())).map_err(DraftError::Wish)
        }
    }
}

fn of_kind(kind: &str) -> Result<Model, String> {
    let mut specs = catalogue::specs();
    let known: Vec<String> = specs.iter().map(|spec| spec.kind.clone()).collect();
    let Some(at) = known.iter().position(|known| known == kind) else {
        let hint = meant(nearest(kind, &known));
        return Err(format!("no model named `{kind}`{hint} (known: {})", known.join(", ")));
    };
    let spec = (kind != EQUATIONS).then(|| specs.swap_remove(at));
    Ok(Model {
        spec,
        lines: format!("kind = {}\n", quoted(kind)),
        layout: String::new(),
        constants: Vec::new(),
        copy: None,
        name: kind.to_owned(),
    })
}

/// The model of a file with a layout: the layout alone, or below `[model.layout]` with constants beside it.
fn of_layout(file: &Path, kind: Option<&str>) -> Result<Model, String> {
    let text = std::fs::read_to_string(file).map_err(|error| format!("cannot be read: {error}"))?;
    let document: DocumentMut = text
        .parse()
        .map_err(|error: toml_edit::TomlError| format!("this is not TOML: {}", error.message()))?;
    let model = document.get("model").and_then(Item::as_table_like);
    let layout: Table = match model.and_then(|model| model.get("layout")) {
        Some(layout) => layout.clone().into_table().map_err(|_| "`layout` is no table".to_owned())?,
        None => document.as_table().clone(),
    };
    let own = model.and_then(|model| model.get("kind")).and_then(Item::as_str);
    let by_key = || {
        let kinds = [("elements", "rcr-network"), ("segments", "artery-1d")];
        kinds.into_iter().find(|(key, _)| layout.contains_key(key)).map(|(_, kind)| kind)
    };
    let kind =
        kind.or(own).or_else(by_key).ok_or("of which model is this the layout? say it by --model KIND")?;
    let mut found = of_kind(kind)?;
    let numbers = model.and_then(|model| model.get("constants")).and_then(Item::as_table_like);
    found.constants = numbers
        .into_iter()
        .flat_map(toml_edit::TableLike::iter)
        .filter_map(|(name, item)| {
            let number = item.as_float().or_else(|| item.as_integer().map(|whole| whole as f64))?;
            Some((name.to_owned(), number))
        })
        .collect();
    let def = ModelDef {
        kind: kind.to_owned(),
        layout: Some(as_json(&Item::Table(layout.clone()))),
        ..ModelDef::default()
    };
    found.spec = Some(catalogue::build(&def).map_err(|error| error.to_string())?.spec().clone());
    found.layout = below_model(layout);
    found.name = stem(file);
    Ok(found)
}

/// The text of a table as `[model.layout]`.
fn below_model(mut layout: Table) -> String {
    layout.set_implicit(false);
    layout.set_position(None);
    let mut model = Table::new();
    model.set_implicit(true);
    model.insert("layout", Item::Table(layout));
    let mut document = DocumentMut::new();
    document.insert("model", Item::Table(model));
    document.to_string().trim_start().to_owned()
}

/// A value of TOML as one of JSON, which is what a model takes.
fn as_json(item: &Item) -> Value {
    if let Some(table) = item.as_table_like() {
        return Value::Object(table.iter().map(|(key, item)| (key.to_owned(), as_json(item))).collect());
    }
    match item {
        Item::ArrayOfTables(tables) => {
            tables.iter().map(|table| as_json(&Item::Table(table.clone()))).collect()
        }
        Item::Value(toml_edit::Value::Array(items)) => {
            items.iter().map(|item| as_json(&Item::Value(item.clone()))).collect()
        }
        Item::Value(toml_edit::Value::String(text)) => text.value().as_str().into(),
        Item::Value(toml_edit::Value::Integer(whole)) => (*whole.value()).into(),
        Item::Value(toml_edit::Value::Float(number)) => (*number.value()).into(),
        Item::Value(toml_edit::Value::Boolean(flag)) => (*flag.value()).into(),
        _ => Value::Null,
    }
}

/// A solver that says what it is.
fn of_solver(def: &SolverDef, out: &Path, host: &SolverHost) -> Result<Model, String> {
    let told = host.describe(def).map_err(|why| {
        let words = why.last_words.map(|words| format!("{words}: ")).unwrap_or_default();
        format!("the solver does not say what it is: {words}{}", why.reason)
    })?;
    if let Some(fault) = told.fault() {
        return Err(format!("the solver `{}` describes itself wrongly: {fault}", told.name));
    }
    let mut lines = vec!["kind = \"solver\"".to_owned()];
    if def.adapter != SolverDef::default().adapter {
        lines.push(format!("adapter = {}", quoted(&def.adapter)));
    }
    if !def.command.is_empty() {
        lines.push(format!("command = [{}]", list(&def.command)));
        let folder = quoted(&way(out, &def.folder));
        lines.push(format!("folder = {folder}      # where the command is started, from this file"));
    }
    if let Some(address) = &def.address {
        lines.push(format!("address = {}", quoted(address)));
    }
    if def.ranks > 1 {
        lines.push(format!("ranks = {}", def.ranks));
    }
    let lines = lines.join("\n") + "\n";
    Ok(Model {
        spec: Some(told.spec),
        lines,
        layout: String::new(),
        constants: Vec::new(),
        copy: None,
        name: word(&told.name),
    })
}

fn of_fmu(file: &Path, host: &SolverHost) -> Result<Model, String> {
    let beside = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = beside.canonicalize().map_err(|error| format!("cannot be read: {error}"))?;
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let def = SolverDef {
        adapter: "fmu".to_owned(),
        command: vec![name.clone()],
        folder: folder.to_string_lossy().into_owned(),
        ..SolverDef::default()
    };
    let told = host.describe(&def).map_err(|why| why.reason)?;
    let lines = format!(
        "kind = \"solver\"\nadapter = \"fmu\"\ncommand = [{}]      # with \"--states\", \"h1,h2\" behind it the unit can be filtered\n",
        quoted(&name)
    );
    Ok(Model {
        spec: Some(told.spec),
        lines,
        layout: String::new(),
        constants: Vec::new(),
        copy: Some(file.to_owned()),
        name: stem(file),
    })
}

fn list(words: &[String]) -> String {
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(", ")
}

/// Name of a file without its ending.
pub(super) fn stem(file: &Path) -> String {
    word(&file.file_stem().unwrap_or_default().to_string_lossy())
}

/// A text as the name of a study.
fn word(text: &str) -> String {
    let name: String =
        text.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect();
    let name = name.trim_matches(['-', '.']).to_owned();
    if name.is_empty() { "study".to_owned() } else { name }
}

/// The way from a folder that is still to be made to one that is there.
fn way(from: &Path, to: &str) -> String {
    let plain = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let (from, to) = (plain(from), plain(Path::new(to)));
    let common = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    if common < 2 {
        return to.to_string_lossy().into_owned();
    }
    let up = from.components().skip(common).map(|_| "..".to_owned());
    let down = to.components().skip(common).map(|part| part.as_os_str().to_string_lossy().into_owned());
    let parts: Vec<String> = up.chain(down).collect();
    if parts.is_empty() { ".".to_owned() } else { parts.join("/") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_between_folders_is_relative_where_they_have_more_than_the_root_in_common() {
        assert_eq!(way(Path::new("/a/b/study"), "/a/b"), "..");
        assert_eq!(way(Path::new("/a/b/study"), "/a/c/d"), "../../c/d");
        assert_eq!(way(Path::new("/a/b"), "/c/d"), "/c/d");
    }

    #[test]
    fn a_name_of_a_study_has_no_sign_that_a_folder_could_not_have() {
        assert_eq!(word("./solver:2 (new)"), "solver-2--new");
        assert_eq!(word("//"), "study");
    }
}
