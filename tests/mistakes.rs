//! Mistakes of a new user, in tables: what was done, the first line of the answer, the exit code; and docs/mistakes.md, which is
//! made of the same tables.
//!
//! A block of `mistakes/*.txt` is one mistake: `# ` what was done, then places of a file that are changed (`FILE - ` from and
//! `FILE + ` to, the whole file where there is no `-`), `$ ` the command, and the exit code with the beginning of the answer, in
//! which `…` stands for anything. The sound files stand in `mistakes/*.base`.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
#[path = "mistakes/kit.rs"]
mod kit;

use std::fmt::Write as _;
use std::path::Path;

use common::repository;
use kit::{Mistake, TABLES, base, first, matches, mistakes, placed, typed};

/// Makes every mistake of a table and compares.
fn check(table: &str) {
    let (code, _, stderr) = typed(placed(&base(table)).path(), "check study.toml");
    assert_eq!(code, 0, "the sound files of `{table}`: {stderr}");
    let mut wrong = String::new();
    for mistake in mistakes(table) {
        let folder = placed(&mistake.files);
        let (code, _, stderr) = typed(folder.path(), &mistake.command);
        let path = folder.path().display().to_string();
        let (wanted, got) = (mistake.said.replace("{folder}", &path), first(&stderr));
        if code != mistake.code || !matches(&wanted, &got) {
            writeln!(
                wrong,
                "# {}\n  wanted {} {wanted}\n  got    {code} {got}\n",
                mistake.what, mistake.code
            )
            .unwrap();
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

#[test]
fn mistakes_in_a_study_or_its_recording_are_told_in_the_first_line() {
    check("study");
}

#[test]
fn mistakes_with_a_program_of_files_are_told_in_the_first_line() {
    check("program");
}

#[test]
#[ignore = "needs the Python package: .ci/solvers"]
fn mistakes_in_a_solver_in_python_are_told_in_the_first_line() {
    check("package");
}

/// The page for readers.
fn page() -> String {
    let mut page = "# Mistakes, and what is said\n\nEvery line is made and compared by `cargo test --test mistakes`: what was done, the \
                    beginning of the answer (`…` stands for what differs from case to case), the exit code. The page is written \
                    by `STARLINGS_WRITE_PAGES=1 cargo test --test mistakes the_page`. What else can go wrong: \
                    [errors.md](errors.md).\n"
        .to_owned();
    for (table, title) in TABLES {
        write!(page, "\n## {title}\n\n| mistake | the answer begins with | exit code |\n|---|---|---|\n")
            .unwrap();
        for Mistake { what, said, code, .. } in mistakes(table) {
            // A cell ends at a bar, and code at a backtick.
            let said = said.replace("{folder}/", "").replace('|', "\\|");
            writeln!(page, "| {what} | {said} | {code} |").unwrap();
        }
    }
    page
}

#[test]
fn the_page_of_mistakes_is_made_of_the_tables() {
    let (path, page) = (repository("docs/mistakes.md"), page());
    if std::env::var_os("STARLINGS_WRITE_PAGES").is_some() {
        std::fs::write(&path, &page).unwrap();
    }
    assert_eq!(std::fs::read_to_string(&path).unwrap(), page, "see the page for how it is written");
    let n: usize = TABLES.iter().map(|(table, _)| mistakes(table).len()).sum();
    assert!(n >= 35, "{n} mistakes");
}

#[test]
fn every_fault_of_a_study_and_its_files_is_told_at_once() {
    let mut files = base("study");
    let study = String::from_utf8(files["study.toml"].clone()).unwrap();
    let study = study
        .replace("rate = \"(power", "rate = \"(powr*sine(T)")
        .replace("median = 30,", "median = -30,")
        .replace("column = \"temperature\"", "column = \"temp\"")
        .replace("{ power = \"power\" }", "{ power = \"current\" }");
    files.insert("study.toml".to_owned(), study.into_bytes());
    let (code, stdout, _) = typed(placed(&files).path(), "check study.toml --json");
    let told: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    let messages: Vec<&str> =
        told["problems"].as_array().unwrap().iter().map(|p| p["message"].as_str().unwrap()).collect();
    let wanted = [
        "no function named `sine`; did you mean `sin`?",
        "the prior median -30 of `loss` must be above zero for a log transform",
        "`tank.csv` has no column `current`",
        "`tank.csv` has no column `temp`",
    ];
    assert_eq!((code, messages), (2, wanted.to_vec()), "expression, prior, input, column");
}

#[test]
fn faults_of_form_and_of_files_are_told_together() {
    let mut files = base("program");
    let study = String::from_utf8(files["study.toml"].clone()).unwrap();
    let study = study.replace("factor = 2 }", "facter = 2 }").replace("\"tank.in.tmpl\"", "\"tank.tmpl\"");
    files.insert("study.toml".to_owned(), study.into_bytes());
    files.insert("tank.csv".to_owned(), b"time;temperature\n0;50\n".to_vec());
    let (code, stdout, _) = typed(placed(&files).path(), "check study.toml --json");
    for words in ["unknown key `facter`", "tank.tmpl`: there is no such file", "separated by semicolons"] {
        assert!(stdout.contains(words), "no `{words}` in {stdout}");
    }
    assert_eq!(code, 2);
}

#[test]
fn a_failure_with_json_is_json_on_standard_output() {
    let folder = placed(&base("study"));
    for (command, wanted) in [
        ("check none.toml --json", 2),
        ("run none.toml --json", 2),
        ("explain none.toml --json", 2),
        ("identify none.toml --json", 2),
        ("spectrum none.toml --json", 2),
        ("effects none.toml --json", 2),
        ("report . --json", 2),
        ("models nothing --json", 2),
        ("conformance --json --solver ./none", 2),
        ("check --json --nonsense", 2),
    ] {
        let (code, stdout, stderr) = typed(folder.path(), command);
        let told: serde_json::Value =
            serde_json::from_str(&stdout).unwrap_or_else(|e| panic!("{command}: {e}: {stdout}"));
        assert!(told["error"].as_str().is_some_and(|text| !text.is_empty()), "{command}: {stdout}");
        assert_eq!(code, wanted, "{command}: {stderr}");
        assert!(!stderr.is_empty(), "{command} tells people nothing");
    }
}

#[test]
fn a_program_that_answers_for_the_whole_record_is_served_where_train_selects_a_part() {
    let mut files = base("program");
    // It has its own times and looks at no others.
    let program = String::from_utf8(files["program.py"].clone()).unwrap();
    let line = program.lines().find(|line| line.starts_with("times = ")).unwrap().to_owned();
    let fixed = program.replace(&line, "times = [0.0, 600.0, 1200.0, 1800.0, 2400.0]");
    let study = |train: &str| {
        let text = String::from_utf8(base("program")["study.toml"].clone()).unwrap();
        text.replace("file = \"tank.csv\"", &format!("file = \"tank.csv\"\ntrain = {train}")).into_bytes()
    };
    files.insert("study.toml".to_owned(), study("[0, 1800]"));
    let asking = placed(&files);
    files.insert("program.py".to_owned(), fixed.into_bytes());
    let own = placed(&files);
    let (code, stdout, stderr) = typed(own.path(), "check study.toml");
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stdout.contains("answers for the times of a whole record, not for the training span alone"),
        "{stdout}"
    );
    for folder in [&own, &asking] {
        let (code, _, stderr) = typed(folder.path(), "run study.toml --out run --workers 1");
        assert_eq!(code, 0, "{stderr}");
    }
    // The same numbers reach the fit, so that it is the same posterior.
    let posterior = |folder: &Path| common::bytes(&folder.join("run"), "posterior.csv");
    assert_eq!(posterior(own.path()), posterior(asking.path()));
}

#[test]
fn an_address_where_nobody_listens_is_told_at_once() {
    let mut files = base("study");
    let text = String::from_utf8(files["study.toml"].clone()).unwrap();
    let (start, end) = (text.find("[model]").unwrap(), text.find("[[parameters]]").unwrap());
    let model = "[model]\nkind = \"solver\"\naddress = \"127.0.0.1:1\"\nstart_timeout = 0.5\n\n";
    files.insert("study.toml".to_owned(), format!("{}{model}{}", &text[..start], &text[end..]).into_bytes());
    let (code, _, stderr) = typed(placed(&files).path(), "check study.toml");
    assert_eq!(code, 2, "{stderr}");
    let stderr = stderr.replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" ");
    let wait =
        stderr.find("waiting up to 0.5 s for a solver at 127.0.0.1:1").unwrap_or_else(|| panic!("{stderr}"));
    assert!(wait < stderr.find("was not ready within 0.5 s").unwrap_or(0), "{stderr}");
}

#[test]
fn a_program_that_ends_at_its_start_is_not_advised_to_be_elsewhere() {
    let mut files = base("study");
    let text = String::from_utf8(files["study.toml"].clone()).unwrap();
    let (start, end) = (text.find("[model]").unwrap(), text.find("[[parameters]]").unwrap());
    for (command, advised) in [("[\"false\"]", false), ("[\"no-such-program-here\"]", true)] {
        let model = format!("[model]\nkind = \"solver\"\ncommand = {command}\n\n");
        files.insert(
            "study.toml".to_owned(),
            format!("{}{model}{}", &text[..start], &text[end..]).into_bytes(),
        );
        let (code, _, stderr) = typed(placed(&files).path(), "check study.toml");
        assert_eq!((code, stderr.contains("described = \"solver.json\"")), (2, advised), "{stderr}");
    }
}
