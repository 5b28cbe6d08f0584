//! `starlings init`: a first version of a study, from a recording, a model, or both.

use std::io::{self, BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::Parser;
use serde_json::json;
use starlings_coordinator::draft::DraftError;
use starlings_coordinator::draft::import::import;
use starlings_coordinator::draft::init::{ModelWish, Question, Wishes, init};
use starlings_models::SolverDef;

use crate::conformance::{Span, span};
use crate::console::{line, note};
use crate::failure::Failure;
use crate::load;
use crate::plain::Plain;
use crate::run_folder::quoted;
use crate::solvers::adapter_names;

/// Write a first version of a study: from a recording, a model, or both. `check` accepts it, and what was guessed says `TODO`.
///
/// On a terminal it asks what it cannot know; elsewhere, and with --yes, options and defaults decide.
#[derive(Parser)]
pub(crate) struct Args {
    /// Tables with a recording each (CSV with any separator, dates, gaps, units in the headings), the FMU of a model (.fmu), a netlist
    /// (.toml with a layout), or a network of another program (.json, .yaml, as `starlings import` takes it).
    files: Vec<PathBuf>,
    /// A built-in model, by its kind; without a model the study begins with equations for its columns.
    #[arg(long, value_name = "KIND", conflicts_with_all = ["solver", "address"])]
    model: Option<String>,
    /// The command that starts a solver which says what it is, as a shell would take it apart.
    #[arg(long, value_name = "CMD")]
    solver: Option<String>,
    /// Where a solver listens that is running already.
    #[arg(long, value_name = "ADDR")]
    address: Option<String>,
    /// How the solver is reached.
    #[arg(long, default_value = "grpc", value_name = "NAME", value_parser = adapter_names())]
    adapter: String,
    /// Ranks of an MPI solver.
    #[arg(long, default_value_t = 1, value_name = "N")]
    ranks: usize,
    /// The column of the times.
    #[arg(long, value_name = "COLUMN", conflicts_with = "step")]
    time: Option<String>,
    /// Time from row to row, in a file without times.
    #[arg(long, value_name = "STEP")]
    step: Option<f64>,
    /// Unit of the times, where the file does not say it.
    #[arg(long, value_name = "UNIT")]
    time_unit: Option<String>,
    /// A column that drives the model, with the model's name for it where that is another.
    #[arg(long = "input", value_name = "COLUMN[=NAME]", value_parser = named)]
    inputs: Vec<(String, Option<String>)>,
    /// A column that was measured, with the model's name for it where that is another.
    #[arg(long = "output", value_name = "COLUMN[=NAME]", value_parser = named)]
    outputs: Vec<(String, Option<String>)>,
    /// Standard deviation of the errors of a column; without it the data tell.
    #[arg(long = "noise", value_name = "COLUMN=SD", value_parser = sized)]
    noise: Vec<(String, f64)>,
    /// A parameter that is unknown, beside those without a default.
    #[arg(long = "unknown", value_name = "NAME")]
    unknown: Vec<String>,
    /// Times of the predictions that stand for a recording where there is none; 0:0.01:1 without it.
    #[arg(long, value_name = "START:STEP:END", value_parser = span)]
    times: Option<Span>,
    /// Folder of the study; by default named as the first file or the model, in the current folder. It must not be there yet.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Ask nothing.
    #[arg(short, long)]
    yes: bool,
    /// Print what was written as JSON; nothing is asked.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Writes the study.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let of_another = |file: &Path| ["json", "yaml", "yml"].contains(&ending(file).as_str());
    let out = out(args)?;
    let host = load::host_here();
    let draft = match args.files.as_slice() {
        [file] if of_another(file) && args.wants_no_more() => import(file, &out, &host),
        files if files.iter().any(|file| of_another(file)) => {
            let message = "a network of another program becomes a study by itself: give that file alone, then edit the study";
            return Err(Failure::input(message));
        }
        _ => init(&wishes(args)?, &out, &host, &mut answers(args)),
    };
    let draft = draft.map_err(|error| match error {
        DraftError::Write { .. } => Failure::run(error),
        _ => Failure::input(error),
    })?;
    if args.json {
        return line(format_args!("{:#}", json!({ "study": draft.study, "notes": draft.notes })));
    }
    for text in &draft.notes {
        note(text);
    }
    let study = draft.study.display();
    let word = quoted(&study.to_string());
    line(format_args!("{study} was written: `starlings check {word}` says what a run would do"))
}

impl Args {
    /// Whether nothing is said but the file.
    fn wants_no_more(&self) -> bool {
        self.model.is_none()
            && self.solver.is_none()
            && self.address.is_none()
            && self.inputs.is_empty()
            && self.outputs.is_empty()
    }
}

/// The folder: as it is named, or by what the study is made of.
fn out(args: &Args) -> Result<PathBuf, Failure> {
    if let Some(out) = &args.out {
        return Ok(out.clone());
    }
    let of_file = args.files.first().and_then(|file| file.file_stem()).map(PathBuf::from);
    let of_solver = || {
        let words = shell_words::split(args.solver.as_deref()?).ok()?;
        // `python3 beam.py` is about the beam.
        let program = words.iter().rev().find(|word| !word.starts_with('-')).or(words.first())?;
        Path::new(program).file_stem().map(PathBuf::from)
    };
    let of_model = || args.model.as_ref().map(PathBuf::from);
    of_file.or_else(of_model).or_else(of_solver).ok_or_else(|| {
        Failure::input(
            "nothing says what the study is about: give a recording, or a model by --model or --solver",
        )
    })
}

fn wishes(args: &Args) -> Result<Wishes, Failure> {
    let is = |wanted: &'static [&str]| move |file: &&PathBuf| wanted.contains(&ending(file).as_str());
    let models: Vec<&PathBuf> = args.files.iter().filter(is(&["fmu", "toml"])).collect();
    let recordings: Vec<PathBuf> =
        args.files.iter().filter(|file| !is(&["fmu", "toml"])(file)).cloned().collect();
    let model = match models[..] {
        [] => None,
        [file] if ending(file) == "fmu" => Some(ModelWish::Fmu(file.clone())),
        [file] => Some(ModelWish::Layout(file.clone(), args.model.clone())),
        _ => return Err(Failure::input("several files of models: a study has one")),
    };
    if models.len() + usize::from(args.solver.is_some() || args.address.is_some()) > 1 {
        return Err(Failure::input("a file of a model and a solver: a study has one model"));
    }
    if args.step.is_some_and(|step| !(step > 0.0 && step.is_finite())) {
        return Err(Failure::input("--step must be above zero"));
    }
    let solver = solver(args)?;
    let solver = || solver.map(|def| ModelWish::Solver(Box::new(def)));
    Ok(Wishes {
        recordings,
        model: model.or_else(solver).or_else(|| args.model.clone().map(ModelWish::Kind)),
        time: args.time.clone(),
        step: args.step,
        time_unit: args.time_unit.clone(),
        inputs: args.inputs.clone(),
        outputs: args.outputs.clone(),
        noise: args.noise.clone(),
        unknown: args.unknown.clone(),
        times: args.times.clone().map(|times| times.0).unwrap_or_default(),
    })
}

fn solver(args: &Args) -> Result<Option<SolverDef>, Failure> {
    if args.solver.is_none() && args.address.is_none() {
        return Ok(None);
    }
    let command = args.solver.as_deref().map(shell_words::split).transpose().map_err(Failure::input)?;
    let folder = std::env::current_dir().map_err(Failure::run)?;
    Ok(Some(SolverDef {
        adapter: args.adapter.clone(),
        command: command.unwrap_or_default(),
        address: args.address.clone(),
        folder: folder.display().to_string(),
        ranks: args.ranks,
        ..SolverDef::default()
    }))
}

/// Who answers: the person at the terminal, or nobody.
fn answers(args: &Args) -> impl FnMut(&Question) -> Option<String> {
    let silent = args.yes || args.json || !io::stdin().is_terminal() || !io::stderr().is_terminal();
    move |question| if silent { None } else { asked(question, &mut io::stdin().lock()) }
}

/// Asks until there is an answer that is possible; `None` at the end of what can be read.
fn asked(question: &Question, from: &mut impl BufRead) -> Option<String> {
    loop {
        let choices = if question.choices.is_empty() {
            String::new()
        } else {
            format!(" {}", question.choices.join(", "))
        };
        let default = question.default.as_ref().map(|value| format!(" [{value}]")).unwrap_or_default();
        let _ = write!(io::stderr(), "{}", Plain(format!("{}{choices}{default} ", question.text)));
        let _ = io::stderr().flush();
        let mut answer = String::new();
        if from.read_line(&mut answer).ok()? == 0 {
            return None;
        }
        match answer.trim() {
            "" if question.default.is_some() => return question.default.clone(),
            "" => {}
            given if question.choices.is_empty() || question.choices.iter().any(|c| c == given) => {
                return Some(given.to_owned());
            }
            other => note(format_args!("`{other}` is none of them")),
        }
    }
}

fn ending(file: &Path) -> String {
    file.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase()
}

fn named(argument: &str) -> Result<(String, Option<String>), String> {
    let (column, name) =
        argument.rsplit_once('=').map_or((argument, None), |(column, name)| (column, Some(name)));
    if column.trim().is_empty() || name.is_some_and(|name| name.trim().is_empty()) {
        return Err("expected COLUMN or COLUMN=NAME".to_owned());
    }
    Ok((column.trim().to_owned(), name.map(|name| name.trim().to_owned())))
}

fn sized(argument: &str) -> Result<(String, f64), String> {
    let (column, sd) = argument.rsplit_once('=').ok_or("expected COLUMN=SD")?;
    let sd: f64 = sd.trim().parse().map_err(|_| format!("`{sd}` is no number"))?;
    if !(sd > 0.0 && sd.is_finite()) {
        return Err("a standard deviation is above zero".to_owned());
    }
    Ok((column.trim().to_owned(), sd))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_question_is_asked_until_the_answer_is_one_of_its_choices() {
        let question = Question {
            text: "Which?".to_owned(),
            choices: vec!["a".to_owned(), "b".to_owned()],
            default: Some("a".to_owned()),
            option: "--which".to_owned(),
        };
        let answer = |typed: &str| asked(&question, &mut typed.as_bytes());
        assert_eq!(answer("c\nb\n").as_deref(), Some("b"));
        assert_eq!(answer("\n").as_deref(), Some("a"));
        assert_eq!(answer("c\n"), None);
        let open = Question { choices: Vec::new(), default: None, ..question.clone() };
        assert_eq!(asked(&open, &mut "\n  x y \n".as_bytes()).as_deref(), Some("x y"));
    }

    #[test]
    fn a_column_may_have_an_equals_sign_and_a_name_behind_it() {
        assert_eq!(named("p (mmHg)=pressure"), Ok(("p (mmHg)".to_owned(), Some("pressure".to_owned()))));
        assert_eq!(named("p"), Ok(("p".to_owned(), None)));
        assert!(named("=p").is_err() && named("p=").is_err());
        assert!(sized("p=0").is_err() && sized("p").is_err());
    }
}
