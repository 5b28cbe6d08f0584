//! `starlings infer --follow`: a recording that is followed, its alarms, restarts and refusals.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;

use std::fmt::Write as _;
use std::fs;

use infer_kit::{STUDY, coupled, folder, followed, infer, noise, recording};
use serde_json::Value;

#[test]
fn a_change_is_an_alarm_where_it_happens_and_nowhere_else() {
    // A thousand steps tell a doubled coupling by about fifty units of χ².
    let dir = folder(&STUDY.replace("block = 200", "block = 1000"), "");
    let (code, lines, stderr) = followed(dir.path(), &recording(12_000, 8_000), &[]);
    assert_eq!(code, 0, "{stderr}");
    let lines: Vec<Value> = lines.iter().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 12, "a line per block of 1000");
    let alarms: Vec<f64> = lines
        .iter()
        .filter(|line| line["alarm"] == true)
        .map(|line| line["time"].as_f64().unwrap())
        .collect();
    assert_eq!(alarms, [90.0], "the coupling doubles at 80, and the block after that ends at 90");
    let last = &lines[11]["coefficients"]["c"];
    let (c, sd) = (last[0].as_f64().unwrap(), last[1].as_f64().unwrap());
    // As above: four sd and the error of Euler's path.
    assert!((c - 6.0).abs() < 4.0 * sd + 0.2, "after the change all is estimated anew: {c} ± {sd}");
}

#[test]
fn a_change_that_no_block_shows_is_an_alarm_from_longer_stretches_and_located() {
    // Two hundred steps tell a coupling of 4.5 instead of 3 by two or three units of χ², where an alarm takes more than thirty.
    let dir = folder(STUDY, "");
    let changed = coupled(40_000, 20_000, 4.5);
    let read = |lines: &[String]| -> Vec<Value> {
        lines.iter().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let (code, whole, stderr) = followed(dir.path(), &changed, &[]);
    assert_eq!(code, 0, "{stderr}");
    let lines = read(&whole);
    let alarms: Vec<&Value> = lines.iter().filter(|line| line["alarm"] == true).collect();
    assert_eq!(alarms.len(), 1, "{alarms:?}");
    let time = alarms[0]["time"].as_f64().unwrap();
    let since = alarms[0]["test"]["since"].as_f64().unwrap();
    assert!(time > 200.0 && time <= 280.0 && (since - 200.0).abs() <= 30.0, "{time}, {since}");
    let last = &lines[199]["coefficients"]["c"];
    let (c, sd) = (last[0].as_f64().unwrap(), last[1].as_f64().unwrap());
    assert!((c - 4.5).abs() < 4.0 * sd + 0.2, "{c} ± {sd}");
    // A restart between the change and its alarm goes on with the same lines.
    let rows: Vec<&str> = changed.lines().collect();
    let (_, mut parts, _) =
        followed(dir.path(), &(rows[..22_150].join("\n") + "\n"), &["--state", "state.json"]);
    parts.extend(followed(dir.path(), &changed, &["--state", "state.json"]).1);
    assert_eq!(parts, whole);
    let (_, steady, _) = followed(dir.path(), &recording(40_000, usize::MAX), &[]);
    assert!(read(&steady).iter().all(|line| line["alarm"] == false));
}

#[test]
fn a_recording_on_standard_input_is_not_taken_for_the_program_that_started_it() {
    let dir = folder(STUDY, "");
    let study = dir.path().join("study.toml");
    let mut command = common::starlings();
    command.args(["--end-with-stdin", "infer"]).arg(study).args(["--follow", "-"]);
    common::refused(
        &mut command,
        &["--end-with-stdin cannot be used with `infer --follow -`", "follow a file"],
    );
}

#[test]
fn a_restart_goes_on_with_the_same_lines() {
    let dir = folder(STUDY, "");
    let data = recording(6_000, 4_000);
    let (_, whole, _) = followed(dir.path(), &data, &[]);
    let rows: Vec<&str> = data.lines().collect();
    // Cut in the middle of a block: what came after the last line is given again.
    let (_, mut parts, _) =
        followed(dir.path(), &(rows[..2_500].join("\n") + "\n"), &["--state", "state.json"]);
    let (code, rest, stderr) = followed(dir.path(), &data, &["--state", "state.json"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stderr.contains("its first 2401 rows were in the state already"), "{stderr}");
    parts.extend(rest);
    assert_eq!(parts, whole);
}

#[test]
fn a_recording_that_is_not_the_one_of_its_state_is_told_and_changes_nothing() {
    let dir = folder(STUDY, "");
    let data = recording(3_000, usize::MAX);
    let state = ["--state", "state.json"];
    // A block ends with row 1400.
    let (head, _) = data.split_at(data.match_indices('\n').nth(1_401).unwrap().0 + 1);
    followed(dir.path(), head, &state);
    let kept = fs::read(dir.path().join("state.json")).unwrap();
    // Another recording of the same columns; one that was begun anew and is shorter, and one whose rows lie between.
    let another = coupled(3_000, 500, 0.4);
    let anew = &another[..another.len() / 3];
    let between: String = data
        .lines()
        .enumerate()
        .map(|(k, row)| match row.split_once(',') {
            Some((time, rest)) if k > 0 => format!("{},{rest}\n", time.parse::<f64>().unwrap() + 0.001),
            _ => format!("{row}\n"),
        })
        .collect();
    for (data, says) in [
        (another.as_str(), "with which the state ends"),
        (anew, "there is no row at"),
        (between.as_str(), "there is no row at"),
    ] {
        let (code, lines, stderr) = followed(dir.path(), data, &state);
        assert!(code == 2 && stderr.contains(says) && stderr.contains("a state file of its own"), "{stderr}");
        assert!(lines.is_empty(), "{lines:?}");
        assert_eq!(fs::read(dir.path().join("state.json")).unwrap(), kept);
    }
    // What goes on behind the state needs none of the rows before it.
    let (code, rest, stderr) =
        followed(dir.path(), &format!("{}\n{}", data.lines().next().unwrap(), &data[head.len()..]), &state);
    assert!(code == 0 && !rest.is_empty() && !stderr.contains("already"), "{stderr}");
}

#[test]
fn the_state_of_another_study_is_refused() {
    let dir = folder(STUDY, "");
    let data = recording(1_500, usize::MAX);
    let (code, _, stderr) = followed(dir.path(), &data, &["--state", "state.json"]);
    assert_eq!(code, 0, "{stderr}");
    let changes = [
        ("recent = 1", "recent = 2"),
        ("level = 0.0", "level = 1.0"),
        ("block = 300", "diffusion = \"diagonal\""),
        ("block = 300", "prefactor = false"),
        ("block = 300", "measurement_noise = \"none\""),
        ("rate = \"-c*x - d*z\"", "rate = \"-c*x - 2*d*z\""),
        ("column = \"z\"", "column = \"x\""),
    ];
    for (from, to) in changes {
        assert!(STUDY.contains(from));
        fs::write(dir.path().join("study.toml"), STUDY.replace(from, to)).unwrap();
        let (code, lines, stderr) = followed(dir.path(), &data, &["--state", "state.json"]);
        assert!(code == 2 && stderr.contains("state of another study"), "{to}: {stderr}");
        assert!(lines.is_empty(), "{to}: {lines:?}");
    }
}

#[test]
fn a_stream_that_stops_repeats_jumps_or_holds_text_is_told_with_its_line() {
    let dir = folder(STUDY, "");
    let good = recording(1_000, usize::MAX);
    let lines: Vec<&str> = good.lines().collect();
    let cases = [
        (lines[..100].join("\n") + "\n", "ended after 98 steps"),
        ([&lines[..700], &lines[699..]].concat().join("\n"), "standard input:701: time 6.98 of row"),
        ([&lines[..700], &lines[701..]].concat().join("\n"), "standard input:701: time jumps"),
        (good.replace("\n7.0,", "\n7.0,off"), "standard input:702: `off"),
        ("time,x\n".to_owned(), "no column `z`"),
        (String::new(), "the file is empty"),
    ];
    for (data, says) in cases {
        let (code, _, stderr) = followed(dir.path(), &data, &[]);
        assert!(code == 2 && stderr.contains(says), "no `{says}` in: {stderr}");
    }
}

#[test]
fn a_stream_whose_terms_cannot_be_told_apart_says_so_in_every_line_and_once_beside_them() {
    let collinear = STUDY.replace(r#"parameters = ["k", "c", "d"]"#, r#"functions = ["x", "z", "2*x - z"]"#);
    let dir = folder(&collinear, "");
    let (code, lines, stderr) = followed(dir.path(), &recording(1_000, usize::MAX), &[]);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(lines.len(), 5);
    for line in lines {
        let line: Value = serde_json::from_str(&line).unwrap();
        assert!(line["error"].as_str().unwrap().contains("cannot tell these terms apart"), "{line}");
        assert!(line["diffusion"].is_null(), "{line}");
    }
    assert_eq!(stderr.matches("cannot tell these terms apart").count(), 1, "{stderr}");
}

#[test]
fn a_stream_with_errors_of_the_measurement_has_the_noise_of_the_whole_inference() {
    let mut state = 1_u64;
    let mut error = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        0.2 * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
    };
    let mut data = "time,x,z\n".to_owned();
    for line in recording(1_000, usize::MAX).lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        writeln!(data, "{:?},{:?},{:?}", cells[0], cells[1] + error(), cells[2] + error()).unwrap();
    }
    let study = STUDY.replace("block = 200", "block = 1000").replace("[infer]", "[infer]\nMEASURED");
    for (word, corrected) in [("auto", true), ("none", false)] {
        let study = study.replace("MEASURED", &format!("measurement_noise = \"{word}\""));
        let dir = folder(&study, &data);
        let whole = infer(dir.path(), "out", "1");
        assert_eq!(whole["diffusion"]["lag_corrected"], corrected);
        let (code, lines, stderr) = followed(dir.path(), &data, &[]);
        assert_eq!(code, 0, "{stderr}");
        let line: Value = serde_json::from_str(&lines[0]).unwrap();
        assert_eq!(line["lag_corrected"], corrected, "{line}");
        for l in 0..2 {
            let [one, other] =
                [&line["diffusion"][l], &whole["diffusion"]["matrix"][l][l]].map(|v| v.as_f64().unwrap());
            // The same sums, added in another order.
            assert!((one / other - 1.0).abs() < 1e-6, "{word}: {one} and {other}");
        }
    }
}

#[test]
fn a_stream_with_errors_of_the_measurement_has_no_test_and_says_why() {
    let (mut noise, mut data) = (noise(3), "time,x,z\n".to_owned());
    for line in recording(4_000, usize::MAX).lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let [x, z] = [cells[1] + 0.1 * noise(), cells[2] + 0.1 * noise()];
        writeln!(data, "{:?},{x:?},{z:?}", cells[0]).unwrap();
    }
    let dir = folder(STUDY, "");
    let (code, lines, stderr) = followed(dir.path(), &data, &[]);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(
        stderr.matches("no test of a change: errors of the measurement matter").count(),
        1,
        "{stderr}"
    );
    let lines: Vec<Value> = lines.iter().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 20);
    assert!(lines.iter().all(|line| line["alarm"] == false && line["test"].is_null()), "{lines:?}");
    assert!(!lines[19]["coefficients"].is_null(), "estimates go on: {}", lines[19]);
}

#[test]
fn what_needs_a_whole_recording_is_refused_for_a_stream() {
    let reduced = "\n[infer.reduced]\nstart = { a = 1.0 }\ncoefficients = { k = \"a\" }\n";
    let cases = [
        (STUDY.replace("block = 300", "measurement_noise = 0.1"), "a given `measurement_noise`"),
        (STUDY.replace("block = 300", "richardson = true"), "`richardson` is not part of --follow"),
        (format!("{STUDY}{reduced}"), "[infer.reduced] is not part of --follow"),
    ];
    for (study, says) in cases {
        let dir = folder(&study, "");
        let (code, lines, stderr) = followed(dir.path(), &recording(500, usize::MAX), &[]);
        assert!(code == 2 && lines.is_empty() && stderr.contains(says), "no `{says}` in: {stderr}");
    }
}

#[test]
fn half_a_row_at_the_end_of_a_stream_is_not_taken() {
    let dir = folder(STUDY, "");
    let data = recording(400, usize::MAX);
    // The last row closes the second block, and half of its last number is a number.
    let half = &data[..data.len() - 4];
    let (code, lines, stderr) = followed(dir.path(), half, &[]);
    assert!(code == 0 && lines.len() == 1, "{lines:?} {stderr}");
    assert!(stderr.contains("ended after 399 steps") && stderr.contains("was not taken"), "{stderr}");
    let (_, lines, stderr) = followed(dir.path(), &data, &[]);
    assert!(lines.len() == 2 && !stderr.contains("was not taken"), "{stderr}");
}
