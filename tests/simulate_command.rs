//! `starlings simulate`: twins, their noise and effects, and what is refused.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use common::{output, repository, starlings};

const STUDY: &str = "examples/pig-aorta/study.toml";

#[test]
fn simulate_is_reproducible_and_its_noise_has_the_asked_size() {
    let twin = |seed: &str, noise: &str| {
        let (code, stdout, stderr) = output(starlings().args(["simulate"]).arg(repository(STUDY)).args([
            "--set",
            "R=3.4",
            "--set",
            "initial:p=100",
            "--noise",
            noise,
            "--seed",
            seed,
        ]));
        assert_eq!(code, 0, "{stderr}");
        stdout
    };
    let pressure = |text: &str| -> Vec<f64> {
        text.lines().skip(1).map(|line| line.split(',').nth(1).unwrap().parse().unwrap()).collect()
    };
    let (clean, noisy) = (twin("1", "0"), twin("1", "2.0"));
    assert_eq!(noisy, twin("1", "2.0"));
    assert_ne!(noisy, twin("2", "2.0"));
    assert!(clean.starts_with("time,pressure,flow\n"), "{}", &clean[..40]);
    let (clean, noisy) = (pressure(&clean), pressure(&noisy));
    let n = clean.len() as f64;
    let sd = (clean.iter().zip(&noisy).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / n).sqrt();
    // 843 samples: the sample sd of noise 2 is within 10 % at more than four standard errors.
    assert!((sd - 2.0).abs() < 0.2, "{sd}");
}

#[test]
fn simulate_adds_a_built_in_effect_to_the_two_element_model() {
    let run = |study: &str, extra: &[&str]| {
        let mut command = starlings();
        command.arg("simulate").arg(repository(study)).args([
            "--set",
            "R=3",
            "--set",
            "C=1.2",
            "--set",
            "initial:p=90",
        ]);
        let (code, stdout, stderr) = output(command.args(extra));
        assert_eq!(code, 0, "{stderr}");
        stdout
            .lines()
            .skip(1)
            .map(|l| l.split(',').nth(1).unwrap().parse::<f64>().unwrap())
            .collect::<Vec<_>>()
    };
    let three = run(STUDY, &["--set", "Zc=0.1"]);
    let two = run("examples/pig-aorta/two-element.toml", &["--effect", "series-resistance=0.1"]);
    let worst = three.iter().zip(&two).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // The same closed-form step and one product: equal to rounding.
    assert!(worst < 1e-10, "{worst}");
    let (code, _, stderr) = output(
        starlings().arg("simulate").arg(repository(STUDY)).args(["--effect", "series-resistence=0.1"]),
    );
    assert_eq!(code, 2);
    assert!(stderr.contains("series-resistance"), "{stderr}");
}

#[test]
fn simulate_names_what_is_wrong_with_its_arguments() {
    let refused = |study: &str, arguments: &[&str]| {
        let (code, stdout, stderr) =
            output(starlings().arg("simulate").arg(repository(study)).args(arguments));
        assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
        stderr
    };
    assert!(refused(STUDY, &["--noise", "-1"]).contains("--noise must be zero or a positive number"));
    let until = refused(STUDY, &["--until", "-1", "--step", "0.1"]);
    assert!(until.contains("--until after the record's start"), "{until}");
    let step = refused(STUDY, &["--until", "1", "--step", "-0.1"]);
    assert!(step.contains("--step must be positive"), "{step}");
    let unknown = refused(STUDY, &["--set", "zz=3"]);
    assert!(unknown.contains("no parameter, constant or initial value of that name"), "{unknown}");
    assert!(unknown.contains("Zc") && unknown.contains("initial:p"), "{unknown}");
    let near = refused(STUDY, &["--set", "initial:P=90"]);
    assert!(near.contains("did you mean `initial:p`"), "{near}");
    let period = refused("examples/fsi-tube/study.toml", &["--periodic", "0.3"]);
    assert!(period.contains("input `flow` is") && period.contains("it has another period"), "{period}");
    let host = refused("examples/oscillator/study.toml", &["--effect", "series-resistance=1"]);
    assert!(host.contains("cannot host") && host.contains("windkessel-2"), "{host}");
}

#[test]
fn a_twin_of_a_model_with_fields_is_a_recording_of_the_next_study() {
    const TUBE: &str = "examples/fsi-tube/study.toml";
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let mut command = starlings();
    command.arg("simulate").arg(repository(TUBE)).args([
        "--periodic",
        "0.8",
        "--noise",
        "10%",
        "--set",
        "E2=4e6",
    ]);
    let (code, _, stderr) =
        output(command.arg("--state-out").arg(at("initial.csv")).arg("-o").arg(at("wall.csv")));
    assert_eq!(code, 0, "{stderr}");
    assert!(stderr.contains("the periodic state was found in"), "{stderr}");
    assert!(
        stderr.contains("noise of displacement: standard deviation") && !stderr.contains("noise of pressure"),
        "{stderr}"
    );
    let study = std::fs::read_to_string(repository(TUBE)).unwrap();
    let study = study.replace("\"flow.csv:flow\"", "\"flow\"");
    std::fs::write(at("study.toml"), study).unwrap();
    let (code, stdout, stderr) = output(starlings().arg("check").arg(at("study.toml")));
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stdout.contains("displacement (25 components)") && stdout.contains("the study is sound"),
        "{stdout}"
    );
    // Without the column of one component.
    let text = std::fs::read_to_string(at("wall.csv")).unwrap();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let dropped = header.iter().position(|name| *name == "displacement[7]").unwrap();
    let without = |line: &str| {
        let cells = line.split(',').enumerate().filter(|(i, _)| *i != dropped);
        cells.map(|(_, cell)| cell).collect::<Vec<_>>().join(",")
    };
    let rows: Vec<String> = text.lines().map(without).collect();
    std::fs::write(at("wall.csv"), rows.join("\n")).unwrap();
    let (code, stdout, stderr) = output(starlings().arg("check").arg(at("study.toml")));
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("displacement (24 of 25 components observed)"), "{stdout}");
}

/// A study of a walk that is drawn back, with so much noise and a solver.
fn noisy_study(folder: &std::path::Path, noise: &str, solver: &str) -> std::path::PathBuf {
    let rows: Vec<String> = (0..200).map(|i| format!("{},0", f64::from(i) * 0.1)).collect();
    std::fs::write(folder.join("data.csv"), format!("time,x\n{}\n", rows.join("\n"))).unwrap();
    let text = format!(
        "[study]\nname = \"walk\"\n[model]\nkind = \"equations\"\noutputs = [ {{ name = \"x\", value = \"x\" }} ]\n{solver}\n\
         [[model.states]]\nname = \"x\"\ninitial = 1\nrate = \"-k*x\"\nnoise = {noise}\n\
         [[parameters]]\nname = \"k\"\nprior = {{ transform = \"log\", median = 1.0, factor = 2 }}\n\
         [[records]]\nname = \"r\"\nfile = \"data.csv\"\nchannels = [ {{ column = \"x\", output = \"x\", noise = 0.1 }} ]\n\
         [estimator]\nkind = \"batch\"\n"
    );
    let file = folder.join("study.toml");
    std::fs::write(&file, text).unwrap();
    file
}

#[test]
fn noise_of_the_states_is_drawn_from_the_seed_and_a_fit_says_that_it_leaves_it_out() {
    let dir = tempfile::tempdir().unwrap();
    let study = noisy_study(
        dir.path(),
        "\"0.3*s\"",
        "solver = { method = \"heun\", step = 0.01 }\nconstants = { s = 1 }",
    );
    let twin = |more: &[&str]| {
        let (code, stdout, stderr) = output(starlings().arg("simulate").arg(&study).args(more));
        assert_eq!(code, 0, "{stderr}");
        stdout
    };
    let one = twin(&["--seed", "3"]);
    assert_eq!(one, twin(&["--seed", "3"]));
    assert_ne!(one, twin(&["--seed", "4"]));
    let quiet = twin(&["--set", "s=0"]);
    let last: f64 = quiet.lines().last().unwrap().split(',').nth(1).unwrap().parse().unwrap();
    assert!((last - (-19.9_f64).exp()).abs() < 1e-6, "{last}");
    let (code, stdout, stderr) = output(starlings().arg("check").arg(&study));
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("the states' `noise` is left out of the runs of a fit"), "{stdout}");
    let (code, _, stderr) = output(starlings().arg("simulate").arg(&study).args(["--periodic", "1"]));
    assert_eq!(code, 2);
    assert!(stderr.contains("a model with noise has no periodic start"), "{stderr}");
}

#[test]
fn noise_that_cannot_be_simulated_is_refused_where_it_stands() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |noise: &str, solver: &str| {
        let study = noisy_study(dir.path(), noise, solver);
        let (code, _, stderr) = output(starlings().arg("check").arg(study));
        assert_eq!(code, 2, "{stderr}");
        stderr
    };
    let stderr = refused("0.3", "");
    assert!(stderr.contains("the noise of state `x` needs a solver for it"), "{stderr}");
    let stderr = refused("0.3", "solver = { method = \"heun\" }");
    assert!(stderr.contains("the method \"heun\" needs its `step`"), "{stderr}");
    let stderr = refused("{ w = \"0.3*\" }", "solver = { method = \"heun\", step = 0.1 }");
    assert!(stderr.contains("found the end") && stderr.contains("noise = { w = \"0.3*\" }"), "{stderr}");
    let stderr = refused("[1]", "solver = { method = \"heun\", step = 0.1 }");
    assert!(stderr.contains("a number or an expression in quotes"), "{stderr}");
}
