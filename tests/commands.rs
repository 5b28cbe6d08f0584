//! The commands around `run`: what they print, what they write, what they refuse.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::process::{Command, Stdio};

use common::{bytes, output, repository, run, starlings};
use serde_json::Value;

const STUDY: &str = "examples/pig-aorta/study.toml";

fn json(stdout: &str) -> Value {
    serde_json::from_str(stdout).unwrap_or_else(|e| panic!("{e}: {stdout}"))
}

#[test]
fn check_counts_the_runs_and_shows_the_prior_misfit() {
    let (code, stdout, stderr) = output(starlings().arg("check").arg(repository(STUDY)).arg("--json"));
    assert_eq!(code, 0, "{stderr}");
    let found = json(&stdout);
    assert_eq!(found["particles"], 5, "four parameters, simplex points");
    // 463 samples lie in the training span 0–2.31 s at 200 Hz.
    assert_eq!(found["runs_per_pass"], 5 * 463);
    assert_eq!(found["passes"], serde_json::json!({ "at_least": 2, "at_most": 12 }));
    assert!(found["trial"][0]["rmse"].as_f64().unwrap() > 2.0);
}

#[test]
fn check_says_how_often_the_data_are_gone_through() {
    let (code, stdout, _) = output(starlings().arg("check").arg(repository(STUDY)));
    assert_eq!(code, 0);
    let told = "5 particles, 2315 runs of the model per pass, 2 to 12 passes: as many as the estimate takes to settle";
    assert!(stdout.contains(told), "{stdout}");
}

#[test]
fn models_lists_every_kind_and_offers_the_nearest() {
    let (code, stdout, _) = output(starlings().args(["models", "--json"]));
    assert_eq!(code, 0);
    let kinds: Vec<String> =
        json(&stdout).as_array().unwrap().iter().map(|s| s["kind"].as_str().unwrap().to_owned()).collect();
    for kind in ["windkessel-2", "windkessel-3", "windkessel-4", "oscillator", "equations"] {
        assert!(kinds.iter().any(|k| k == kind), "{kind} in {kinds:?}");
    }
    let (code, stdout, _) = output(starlings().args(["models", "windkessel-3"]));
    assert_eq!(code, 0);
    assert!(stdout.contains("Zc") && stdout.contains("flow"), "{stdout}");
    let (code, _, stderr) = output(starlings().args(["models", "windkesel-3"]));
    assert_eq!(code, 2);
    assert!(stderr.contains("did you mean `windkessel-3`"), "{stderr}");
}

#[test]
fn the_interval_given_the_residuals_comes_first_where_it_is_much_wider_and_in_a_line_where_it_is_not() {
    let dir = tempfile::tempdir().unwrap();
    let told = |study: &str, name: &str| {
        let out = dir.path().join(name);
        let mut command = starlings();
        command.arg("run").arg(repository(study)).arg("--out").arg(&out).args(["--workers", "1"]);
        let (code, stdout, stderr) = output(&mut command);
        assert_eq!(code, 0, "{stderr}");
        let page = String::from_utf8(bytes(&out, "report.html")).unwrap();
        (stdout, page, json(&String::from_utf8(bytes(&out, "summary.json")).unwrap()))
    };
    // 463 samples of a living animal whose residuals carry the information of a few.
    let (stdout, page, summary) = told(STUDY, "pig");
    let at = |text: &str, title: &str| text.find(title).unwrap_or_else(|| panic!("{title}: {stdout}"));
    assert!(at(&stdout, "95 % given the residuals") < at(&stdout, "95 % at the stated noise"));
    assert!(at(&page, "95\u{a0}% given the residuals") < at(&page, "95\u{a0}% at the stated noise"));
    let resistance = &summary["parameters"][0];
    let [stated, given] = ["sd", "sd_given_residuals"].map(|key| resistance[key].as_f64().unwrap());
    assert!(given > 3.0 * stated, "{resistance}");
    let [lo, hi] = [0, 1].map(|end| resistance["interval95_given_residuals"][end].as_f64().unwrap());
    assert!(
        lo < resistance["interval95"][0].as_f64().unwrap() && hi > resistance["estimate"].as_f64().unwrap()
    );
    // A known model with white noise of the stated size.
    let (stdout, page, _) = told("examples/rcr/study.toml", "rcr");
    assert!(stdout.contains("95 % interval ") && !stdout.contains("95 % given the residuals"), "{stdout}");
    assert!(stdout.contains("given the residuals the intervals are at most 1."), "{stdout}");
    assert!(at(&page, "95\u{a0}% given the residuals") > at(&page, "95\u{a0}% at the stated noise"));
}

#[test]
fn the_number_of_workers_comes_from_the_environment_where_the_command_line_has_none() {
    let folder = tempfile::tempdir().unwrap();
    let run = |out: &str, more: &[&str], workers: &str| {
        let mut command = starlings();
        command
            .env("STARLINGS_WORKERS", workers)
            .arg("run")
            .arg(repository("examples/oscillator/study.toml"));
        command.arg("--out").arg(folder.path().join(out)).arg("--json").args(more);
        command
    };
    let workers = |command: &mut Command| {
        let (_, stdout, _) = output(command);
        json(&stdout)["workers"].as_u64().unwrap()
    };
    assert_eq!(workers(&mut run("one", &[], "1")), 1);
    assert_eq!(workers(&mut run("three", &["--workers", "3"], "1")), 3);
    let (code, _, stderr) = output(&mut run("none", &[], "two"));
    assert!(code == 2 && stderr.contains("STARLINGS_WORKERS is `two`: give a number of workers"), "{stderr}");
}

#[test]
fn report_and_export_read_only_the_run_folder() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    run(&repository(STUDY), &out, 1);
    let before: Vec<Vec<u8>> =
        ["report.html", "summary.json", "posterior.csv"].map(|f| bytes(&out, f)).into();
    for file in ["report.html", "summary.json", "posterior.csv"] {
        std::fs::remove_file(out.join(file)).unwrap();
    }
    // Moved elsewhere, away from the study and its recordings.
    let moved = dir.path().join("moved");
    std::fs::rename(&out, &moved).unwrap();
    let picture = dir.path().join("overview.svg");
    let (code, _, stderr) = output(starlings().arg("report").arg(&moved).arg("--overview").arg(&picture));
    assert_eq!(code, 0, "{stderr}");
    let after: Vec<Vec<u8>> =
        ["report.html", "summary.json", "posterior.csv"].map(|f| bytes(&moved, f)).into();
    assert_eq!(before, after);
    assert!(std::fs::read_to_string(picture).unwrap().starts_with("<svg"));
    // The estimate settles with the fourth pass.
    let tables =
        [("estimates", 4 * 463 * 4), ("innovations", 4 * 463), ("analyses", 4 * 463), ("predictions", 843)];
    for (table, rows) in tables {
        let (code, stdout, stderr) = output(starlings().arg("export").arg(&moved).args(["--table", table]));
        assert_eq!(code, 0, "{stderr}");
        assert_eq!(stdout.lines().count(), rows + 1, "{table}");
    }
}

#[test]
fn a_folder_without_a_run_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    for command in ["report", "export"] {
        let (code, _, stderr) = output(starlings().arg(command).arg(dir.path()));
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains("run.db"), "{stderr}");
    }
}

#[test]
fn a_worker_gives_up_with_the_address_when_nobody_answers() {
    // A port that was free a moment ago: nobody listens there.
    let address = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let (code, _, stderr) =
        output(starlings().args(["worker", "--connect", &address, "--insecure", "--patience", "0.2"]));
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains(&address), "{stderr}");
}

#[cfg(unix)]
#[test]
fn a_reader_that_stops_early_ends_a_command_quietly() {
    use std::io::Read;

    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    run(&repository(STUDY), &out, 1);
    let commands = [
        vec!["check".into(), repository(STUDY)],
        vec!["check".into(), repository(STUDY), "--json".into()],
        vec!["models".into()],
        vec!["models".into(), "windkessel-3".into()],
        vec!["models".into(), "--json".into()],
        vec!["simulate".into(), repository(STUDY)],
        vec!["export".into(), out.clone(), "--table".into(), "jobs".into()],
        vec!["report".into(), out.clone()],
        vec!["report".into(), out.clone(), "--json".into()],
        vec!["run".into(), repository(STUDY), "--out".into(), dir.path().join("again")],
    ];
    for arguments in commands {
        let mut child = starlings()
            .args(&arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // Nobody reads: the first write finds a broken pipe.
        drop(child.stdout.take());
        let mut stderr = String::new();
        child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(0), "{arguments:?}: {stderr}");
        assert!(!stderr.contains("panicked") && !stderr.contains("error"), "{arguments:?}: {stderr}");
    }
    assert!(dir.path().join("again/report.html").exists(), "the run went on without a reader");
}

#[cfg(unix)]
#[test]
fn a_message_that_nobody_reads_changes_no_exit_code() {
    for (arguments, expected) in [(["check", "no-such.toml"], 2), (["report", "no-such-folder"], 2)] {
        let mut child =
            starlings().args(arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stderr.take());
        assert_eq!(child.wait().unwrap().code(), Some(expected), "{arguments:?}");
    }
}

#[test]
fn a_model_with_fields_is_listed_with_their_sizes() {
    let (code, stdout, stderr) = output(starlings().args(["models", "fsi-tube"]));
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("displacement[0..25]") && stdout.contains("[model.layout]"), "{stdout}");
    let (_, stdout, _) = output(starlings().args(["models", "windkessel-3"]));
    assert!(!stdout.contains("[model.layout]") && !stdout.contains("components"), "{stdout}");
}

#[test]
fn no_output_replaces_a_study_or_its_data() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("pig.toml");
    std::fs::create_dir(dir.path().join("data")).unwrap();
    std::fs::copy(repository(STUDY), &file).unwrap();
    let recording = dir.path().join("data/in-vivo-1.csv");
    std::fs::copy(repository("examples/pig-aorta/data/in-vivo-1.csv"), &recording).unwrap();
    let out = dir.path().join("run");
    run(&file, &out, 1);
    let kept = [&file, &recording, &out.join("run.db"), &out.join("study.toml")]
        .map(|path| (path.clone(), std::fs::read(path).unwrap()));
    for (path, _) in &kept {
        let (code, _, stderr) = output(starlings().arg("export").arg(&out).arg("-o").arg(path));
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains("choose another file"), "{stderr}");
    }
    for (path, _) in &kept[..2] {
        // However the file is reached.
        let around = path.parent().unwrap().join(".").join(path.file_name().unwrap());
        let (code, _, stderr) = output(starlings().arg("simulate").arg(&file).arg("-o").arg(around));
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains("choose another file"), "{stderr}");
    }
    for (path, bytes) in &kept {
        assert_eq!(&std::fs::read(path).unwrap(), bytes, "{}", path.display());
    }
    // Any other file is written, and written again.
    let twin = dir.path().join("twin.csv");
    for _ in 0..2 {
        let (code, _, stderr) = output(starlings().arg("simulate").arg(&file).arg("-o").arg(&twin));
        assert_eq!(code, 0, "{stderr}");
    }
    let (code, _, stderr) = output(starlings().arg("export").arg(&out).arg("-o").arg(&twin));
    assert_eq!(code, 0, "{stderr}");
}

/// Process numbers of the workers that joined a run, as its events tell: `… (process P, S slots, C cores)`.
#[cfg(target_os = "linux")]
fn worker_processes(out: &std::path::Path) -> Vec<String> {
    let flags = rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY;
    let db = rusqlite::Connection::open_with_flags(out.join("run.db"), flags).unwrap();
    let mut events = db.prepare("SELECT text FROM events WHERE kind = 'worker-joined'").unwrap();
    let texts = events.query_map([], |row| row.get::<_, String>(0)).unwrap();
    let process = |text: &str| text.split("(process ").nth(1)?.split(',').next().map(str::to_owned);
    texts.map(|text| process(&text.unwrap()).unwrap()).collect()
}

/// Whether a process of this number runs; one that only waits to be reaped does not.
#[cfg(target_os = "linux")]
fn is_alive(pid: &String) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    status.lines().any(|line| line.starts_with("State:") && !line.contains("zombie"))
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_run_ends_its_workers_and_says_how_to_go_on() {
    use std::io::Read;

    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    let mut child = starlings()
        .arg("run")
        .arg(repository(STUDY))
        .arg("--out")
        .arg(&out)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    common::wait_until("some analyses", || common::analyses(&out) > 50);
    let interrupted = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(interrupted.success());
    let status = child.wait().unwrap();
    let mut stderr = String::new();
    child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
    assert_eq!(status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("--resume"), "{stderr}");
    assert!(!out.join("posterior.csv").exists());
    let workers = worker_processes(&out);
    assert!(!workers.is_empty(), "the events name the workers that joined");
    common::wait_until("the end of the workers", || !workers.iter().any(is_alive));
}
