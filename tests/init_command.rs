//! `starlings init`: tables as people have them, models that describe themselves, and studies that `check` accepts.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::fmt::Write as _;
use std::path::Path;

use common::{output, refused, repository, starlings};
use serde_json::Value;
use tempfile::TempDir;

/// A folder with one file.
fn folder(name: &str, bytes: impl AsRef<[u8]>) -> TempDir {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join(name), bytes).unwrap();
    folder
}

/// Makes a study in a folder, has `check` accept it, and gives its text and what was noted.
fn drafted(folder: &Path, words: &[&str]) -> (String, String) {
    let (code, stdout, stderr) =
        output(starlings().current_dir(folder).arg("init").args(words).arg("--json"));
    assert_eq!(code, 0, "{words:?}: {stderr}");
    let answer: Value = serde_json::from_str(&stdout).unwrap();
    let file = folder.join(answer["study"].as_str().unwrap());
    let (code, stdout, stderr) = output(starlings().arg("check").arg(&file));
    assert_eq!(code, 0, "{words:?}: {stderr}\n{}", std::fs::read_to_string(&file).unwrap());
    assert!(stdout.contains("the study is sound"), "{stdout}");
    let notes =
        answer["notes"].as_array().unwrap().iter().map(|note| note.as_str().unwrap().to_owned() + "\n");
    (std::fs::read_to_string(file).unwrap(), notes.collect())
}

/// A course that cools, and a power that drives it, as numbers of a table.
fn rows(n: usize, row: impl Fn(usize, f64, f64) -> String) -> String {
    let mut text = String::new();
    for k in 0..n {
        let (t, power) = (k as f64, if (k / 8) % 2 == 0 { 5.0 } else { 0.0 });
        // Scatters like noise, and is the same on every machine.
        let value = 20.0 + 60.0 * (-t / 15.0).exp() + 0.1 * ((k * k % 17) as f64 / 8.0 - 1.0);
        writeln!(text, "{}", row(k, power, value)).unwrap();
    }
    text
}

#[test]
fn a_clean_table_is_kept_byte_by_byte_and_its_units_are_found() {
    let table = "time (min),power [W],T_degC\n".to_owned() + &rows(40, |k, p, v| format!("{k},{p},{v:.3}"));
    let folder = folder("tank.csv", &table);
    let (study, notes) = drafted(folder.path(), &["tank.csv", "--input", "power"]);
    assert!(!notes.contains("--input"), "{notes}");
    let (_, notes) = drafted(folder.path(), &["tank.csv", "--out", "unasked"]);
    assert!(notes.contains("`power [W]` switches") && notes.contains("write --input power"), "{notes}");
    assert_eq!(std::fs::read_to_string(folder.path().join("tank/tank.csv")).unwrap(), table);
    for line in [
        "time_unit = \"min\"",
        "outputs = [{ name = \"T\", unit = \"degC\", value = \"T\" }]",
        "inputs = [{ name = \"power\", unit = \"W\" }]",
        "inputs = { power = \"power [W]\" }",
        "{ column = \"T_degC\", output = \"T\", unit = \"degC\", noise = \"auto\" }",
        "train = [0.0, 32.0]",
        "name = \"gain_T_power\"",
    ] {
        assert!(study.contains(line), "no `{line}` in:\n{study}");
    }
}

#[test]
fn semicolons_decimal_commas_titles_and_a_row_of_units_are_understood() {
    let comma = |v: f64| format!("{v:.2}").replace('.', ",");
    let table = "Rig 7, Monday\n\nTime;Power;T\n(s);(W);(degC)\n".to_owned()
        + &rows(40, |k, p, v| format!("{};{};{}", comma(k as f64 * 0.5), comma(p), comma(v)));
    let folder = folder("rig.csv", table);
    let (study, notes) = drafted(folder.path(), &["rig.csv", "--input", "Power"]);
    assert!(study.contains("time_unit = \"s\"") && study.contains("unit = \"degC\""), "{study}");
    for note in ["separated by semicolons", "decimal commas", "taken for units", "1 lines above"] {
        assert!(notes.contains(note), "no `{note}` in: {notes}");
    }
    let written = std::fs::read_to_string(folder.path().join("rig/rig.csv")).unwrap();
    assert!(written.starts_with("time,Power,T\n0.0,5.0,79.9\n0.5,"), "{written}");
}

#[test]
fn a_table_in_utf_16_with_tabs_is_read() {
    let text = "time\tT\n".to_owned() + &rows(30, |k, _, v| format!("{k}\t{v:.2}"));
    let bytes: Vec<u8> = [0xFEFF].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let (_, notes) = drafted(folder("a.txt", bytes).path(), &["a.txt"]);
    assert!(notes.contains("UTF-16") && notes.contains("tabs"), "{notes}");
}

#[test]
fn dates_become_seconds_and_a_clock_in_a_column_of_its_own_belongs_to_them() {
    let iso = "timestamp,T\n".to_owned() + &rows(30, |k, _, v| format!("2024-01-05 12:{k:02}:30,{v:.2}"));
    let one = folder("a.csv", iso);
    let (study, notes) = drafted(one.path(), &["a.csv"]);
    assert!(study.contains("time_unit = \"s\"") && notes.contains("seconds after the first row"), "{notes}");
    let written = std::fs::read_to_string(one.path().join("a/a.csv")).unwrap();
    assert!(written.lines().nth(2).unwrap().starts_with("60.0,"), "{written}");

    // Over midnight.
    let two = "Date;Clock;T\n".to_owned()
        + &rows(30, |k, _, v| {
            let (day, hour, minute) = (5 + k / 20, (23 + k / 20) % 24, 3 * k % 60);
            format!("{day:02}.01.2024;{hour:02}:{minute:02}:00;{v:.2}")
        });
    let two = folder("b.csv", two);
    drafted(two.path(), &["b.csv"]);
    let written = std::fs::read_to_string(two.path().join("b/b.csv")).unwrap();
    assert!(written.lines().nth(21).unwrap().starts_with("3600.0,"), "{written}");
}

#[test]
fn gaps_texts_and_rows_out_of_order_are_put_right_and_told() {
    let mut lines: Vec<String> = rows(40, |k, p, v| match k {
        7 => format!("{k},,{v:.2},ok"),
        9 => format!("{k},{p},n/a,ok"),
        11 => format!("{k},{p},over,bad"),
        _ => format!("{k},{p},{v:.2},ok"),
    })
    .lines()
    .map(str::to_owned)
    .collect();
    lines.swap(3, 4);
    lines.push(lines[5].clone());
    let table = format!("time,power,T,state\n{}\n", lines.join("\n"));
    let folder = folder("a.csv", table);
    let (_, notes) = drafted(folder.path(), &["a.csv", "--input", "power"]);
    for note in [
        "1 cells of column `T` are no numbers",
        "column `state` holds texts",
        "the rows were sorted by time",
        "1 rows with the time of an earlier one",
    ] {
        assert!(notes.contains(note), "no `{note}` in: {notes}");
    }
    let written = std::fs::read_to_string(folder.path().join("a/a.csv")).unwrap();
    let row = |k: usize| written.lines().nth(k + 1).unwrap().to_owned();
    // The input is linear across its gap, the measurement stays one.
    assert!(row(7).starts_with("7.0,2.5,"), "{}", row(7));
    assert_eq!(row(9), "9.0,0.0,");
    assert_eq!(written.lines().count(), 41);
}

#[test]
fn a_table_of_blanks_without_names_is_taken_and_its_columns_are_called_by_number() {
    let table = rows(30, |k, p, v| format!("  {k}   {p}  {v:.3}"));
    let (study, notes) = drafted(folder("a.dat", table).path(), &["a.dat", "--input", "c2"]);
    assert!(notes.contains("no names of columns") && notes.contains("blanks"), "{notes}");
    assert!(study.contains("output = \"c3\""), "{study}");
    let commented = "# time flow T\n".to_owned() + &rows(30, |k, p, v| format!("{k} {p} {v:.3}"));
    let (study, _) = drafted(folder("b.dat", commented).path(), &["b.dat", "--input", "flow"]);
    assert!(study.contains("output = \"T\""), "{study}");
}

#[test]
fn a_column_that_numbers_the_rows_is_neither_measured_nor_the_time_where_there_is_another() {
    let table = "rownames,t,T\n".to_owned() + &rows(30, |k, _, v| format!("{},{k},{v:.3}", k + 1));
    let (study, notes) = drafted(folder("a.csv", table).path(), &["a.csv"]);
    assert!(notes.contains("column `rownames` numbers the rows"), "{notes}");
    assert!(study.contains("time = \"t\"") && !study.contains("rownames\","), "{study}");
    let table = ",age,T\n".to_owned() + &rows(30, |k, _, v| format!("{},{},{v:.3}", k + 1, 2 * k));
    let (study, _) = drafted(folder("b.csv", table).path(), &["b.csv"]);
    assert!(study.contains("time = \"age\""), "{study}");
    // Alone it counts the samples.
    let table = ",T\n".to_owned() + &rows(30, |k, _, v| format!("{k},{v:.3}"));
    let (study, _) = drafted(folder("c.csv", table).path(), &["c.csv"]);
    assert!(study.contains("output = \"T\""), "{study}");
}

#[test]
fn what_cannot_be_known_is_said_with_the_option_that_says_it() {
    // The first column does not increase, and none is called time.
    let table = "a,b\n".to_owned() + &rows(30, |k, p, v| format!("{},{v:.3}", p + (k % 3) as f64));
    let one = folder("a.csv", table);
    refused(starlings().current_dir(one.path()).args(["init", "a.csv"]), &["--time COLUMN, or --step STEP"]);
    let (study, _) = drafted(one.path(), &["a.csv", "--step", "0.5", "--out", "counted"]);
    assert!(study.contains("time = \"time\""), "{study}");

    let table = "time,x,y\n".to_owned() + &rows(30, |k, p, v| format!("{k},{p},{v:.3}"));
    let two = folder("b.csv", table);
    refused(
        starlings().current_dir(two.path()).args(["init", "b.csv", "--model", "windkessel-3"]),
        &["input `flow` of the model", "--input COLUMN=flow"],
    );
    refused(
        starlings().current_dir(two.path()).args(["init", "b.csv", "--model", "windkesel-3"]),
        &["did you mean `windkessel-3`?"],
    );
    refused(
        starlings().current_dir(two.path()).args(["init", "b.csv", "--input", "z"]),
        &["there is no column `z`"],
    );
    assert!(!two.path().join("b").exists(), "nothing is left where nothing was written");
    drafted(two.path(), &["b.csv", "--model", "windkessel-3", "--input", "x=flow", "--output", "y=pressure"]);
}

#[test]
fn nothing_is_ever_overwritten() {
    let folder = folder("a.csv", "time,T\n".to_owned() + &rows(30, |k, _, v| format!("{k},{v:.2}")));
    drafted(folder.path(), &["a.csv"]);
    let before = std::fs::read(folder.path().join("a/study.toml")).unwrap();
    refused(starlings().current_dir(folder.path()).args(["init", "a.csv"]), &["a is there already", "--out"]);
    assert_eq!(std::fs::read(folder.path().join("a/study.toml")).unwrap(), before);
}

#[test]
fn files_that_are_no_tables_are_called_what_they_are() {
    for (bytes, words) in [
        (&b"PK\x03\x04rest"[..], "a workbook or an archive: export the sheet as CSV"),
        (b"\x89HDF\r\n\x1a\n", "an HDF5 file (NetCDF 4, MATLAB 7.3): read it in Python, `starlings.read`"),
        (b"PAR1....", "a Parquet file"),
        (b"MATLAB 5.0 MAT-file", "a MATLAB file"),
        (b"", "the file is empty"),
        (b"time,T\n", "there is no row with numbers"),
        (b"time,T\n0,1\n1,2\n", "needs at least three"),
        (b"when,T\n1/5/2024,1\n2/5/2024,2\n3/5/2024,4\n", "day and month cannot be told apart"),
    ] {
        let folder = folder("a.csv", bytes);
        refused(starlings().current_dir(folder.path()).args(["init", "a.csv"]), &[words]);
    }
    let empty = TempDir::new().unwrap();
    refused(starlings().current_dir(empty.path()).args(["init", "no.csv"]), &["cannot be read"]);
    refused(starlings().current_dir(empty.path()).arg("init"), &["give a recording, or a model"]);
}

#[test]
fn every_built_in_model_becomes_a_study_by_itself() {
    let (code, stdout, stderr) = output(starlings().args(["models", "--json"]));
    assert_eq!(code, 0, "{stderr}");
    let kinds: Vec<Value> = serde_json::from_str(&stdout).unwrap();
    let folder = TempDir::new().unwrap();
    for kind in kinds.iter().map(|model| model["kind"].as_str().unwrap()).filter(|kind| *kind != "equations")
    {
        drafted(folder.path(), &["--model", kind, "--times", "0:0.001:0.02"]);
    }
}

#[test]
fn columns_find_their_places_in_a_model_by_units_and_priors_their_size() {
    let folder = TempDir::new().unwrap();
    let text = std::fs::read_to_string(repository("examples/pig-aorta/data/in-vivo-1.csv")).unwrap();
    let (heading, rest) = text.split_once('\n').unwrap();
    let heading =
        heading.replace("pressure", "AoP (mmHg)").replace("flow", "AoQ (mL/s)").replace("time", "time (s)");
    std::fs::write(folder.path().join("pig.csv"), format!("{heading}\n{rest}")).unwrap();
    let (study, _) = drafted(folder.path(), &["pig.csv", "--model", "windkessel-3"]);
    assert!(study.contains("inputs = { flow = \"AoQ (mL/s)\" }"), "{study}");
    assert!(study.contains("column = \"AoP (mmHg)\", output = \"pressure\""), "{study}");
    assert!(
        study.contains("name = \"initial:p\"")
            && study.contains("the size that the units of the recording suggest"),
        "{study}"
    );
}

#[test]
fn a_netlist_and_a_network_of_another_program_become_studies() {
    let netlist = "nodes = [{ name = \"asc\", initial = 70.0 }]\nelements = [\n  { name = \"inflow\", kind = \"flow\", to = \"asc\" },\n  \
                   { name = \"wall\", kind = \"C\", from = \"asc\", value = 1.0 },\n  { name = \"body\", kind = \"R\", from = \"asc\", value = 1.2 },\n]\n";
    let one = folder("net.toml", netlist);
    let (study, _) = drafted(one.path(), &["net.toml"]);
    assert!(study.contains("kind = \"rcr-network\"") && study.contains("[model.layout]"), "{study}");
    let two = TempDir::new().unwrap();
    let name = "steadyFlow_R_R.json";
    std::fs::copy(repository("tests/import_files/svzerodsolver").join(name), two.path().join(name)).unwrap();
    drafted(two.path(), &[name]);
}

#[test]
fn a_solver_that_describes_itself_becomes_a_study_with_and_without_a_recording() {
    let folder = TempDir::new().unwrap();
    for file in ["study.toml", "force.csv", "position.csv"] {
        std::fs::copy(repository("examples/oscillator").join(file), folder.path().join(file)).unwrap();
    }
    let solver = format!("{} serve study.toml", env!("CARGO_BIN_EXE_starlings"));
    let (study, _) = drafted(folder.path(), &["--solver", &solver, "--out", "alone"]);
    assert!(study.contains("kind = \"solver\"") && study.contains("folder = \"..\""), "{study}");
    let force = std::fs::read_to_string(folder.path().join("force.csv")).unwrap();
    let position = std::fs::read_to_string(folder.path().join("position.csv")).unwrap();
    let joined: Vec<String> = force
        .lines()
        .filter_map(|line| {
            let time = line.split(',').next()?;
            let seen = position.lines().find(|other| other.split(',').next() == Some(time))?;
            Some(format!("{line},{}", seen.split_once(',')?.1))
        })
        .collect();
    assert!(joined.len() > 10, "{joined:?}");
    std::fs::write(folder.path().join("both.csv"), joined.join("\n")).unwrap();
    let (study, _) = drafted(folder.path(), &["both.csv", "--solver", &solver]);
    assert!(
        study.contains("inputs = { F = \"force\" }") && study.contains("output = \"position\""),
        "{study}"
    );
}
