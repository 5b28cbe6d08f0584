//! Every way in which a program that is started for every run can go wrong, and what is said of it.

use std::path::Path;

use super::{Bench, ends, map};

#[test]
fn a_failed_run_says_why_and_keeps_its_folder() {
    let mut bench = Bench::new("echo talk; echo 'no licence left' >&2; exit 3", &[]);
    bench.files().templates = map(&[("in.txt", "{{ k }}")]);
    let says = bench.run(2.5, &[1.0]).unwrap_err();
    assert!(says.starts_with("the solver failed: the solver `sh` exited with status 3"), "{says}");
    assert!(says.ends_with("the end of its output:\nno licence left"), "{says}");
    let (_, rest) = says.split_once("the folder of the run is kept: ").unwrap();
    let folder = Path::new(rest.split_once(';').unwrap().0);
    assert_eq!(std::fs::read_to_string(folder.join("in.txt")).unwrap(), "2.5");
    assert_eq!(std::fs::read_to_string(folder.join("starlings-output.txt")).unwrap(), "talk\n");
    assert!(std::fs::read_to_string(folder.join("starlings-input.json")).unwrap().contains("\"k\":2.5"));
}

#[test]
fn a_program_that_says_nothing_on_its_standard_error_is_quoted_from_its_standard_output() {
    let says = Bench::new("echo '*ERROR reading *ELASTIC'; exit 1", &[]).run(1.0, &[1.0]).unwrap_err();
    assert!(says.ends_with("*ERROR reading *ELASTIC"), "{says}");
}

#[test]
fn a_program_that_says_that_a_disk_is_full_is_no_fault_of_its_parameters() {
    for words in ["result.csv: No space left on device", "result.csv: Disk quota exceeded"] {
        let says = Bench::new(&format!("echo '{words}' >&2; exit 1"), &[]).run(1.0, &[1.0]).unwrap_err();
        assert!(says.starts_with("it could not be run: the solver `sh` exited with status 1"), "{says}");
        assert!(says.ends_with(words), "{says}");
    }
}

#[test]
fn a_program_that_never_ends_is_ended_with_its_children() {
    let mut bench = Bench::new("sleep 600 & echo $! > \"$1\"; echo still here >&2; wait", &[]);
    let pid = bench.folder.path().join("pid");
    bench.def.timeout = 1.0;
    let bench = bench.command(&["sh", "solve.sh", &pid.display().to_string()]);
    let says = bench.run(1.0, &[1.0]).unwrap_err();
    assert!(says.contains("did not end within 1 s and was killed (`timeout` sets the limit)"), "{says}");
    assert!(says.contains("still here"), "{says}");
    assert!(ends(&pid), "a child was left behind");
}

#[test]
fn what_cannot_be_read_is_said_with_file_and_remedy() {
    let two = [1.0, 2.0];
    let says = |script: &str, rule: &str| Bench::new(script, &[("tip", rule)]).run(1.0, &two).unwrap_err();
    let text = says("echo 1 > reslt.csv", "csv:result.csv:tip");
    assert!(text.contains("wrote no file `result.csv`, only reslt.csv; did you mean `reslt.csv`?"), "{text}");
    let text = says("printf 'time,tpi\\n1,2\\n'", "csv:-:tip");
    assert!(text.contains("has no column `tip`; it has time, tpi; did you mean `tpi`?"), "{text}");
    let text = says("printf 'tip\\n1\\n2\\n3\\n'", "csv:-:tip");
    assert!(text.contains("has 3 values where 2 belong: one for each of the 2 times"), "{text}");
    let text = says("printf 'time,tip\\n1,2\\n1.5,2\\n'", "csv:-:tip");
    assert!(text.contains("covers the times 1 to 1.5, and t = 2 is asked for"), "{text}");
    let text = says("printf 'tip\\n1\\nbroken\\n'", "csv:-:tip");
    assert!(
        text.contains("`broken` at row 2 in column `tip` of the standard output is not a number"),
        "{text}"
    );
    let text = says("echo hello", "json");
    assert!(text.contains("its output `tip` cannot be read: the standard output is not JSON"), "{text}");
    let text = says("", "json");
    assert!(text.contains("not JSON: it is empty"), "{text}");
    let text = says("echo '{\"tpi\": 1}'", "json");
    assert!(text.contains("has no key `tip`; it has tpi; did you mean `tpi`?"), "{text}");
    let text = says("echo tip 1", "regex:-:tip ([0-9]+)");
    assert!(text.contains("has 1 value where 2 belong"), "{text}");
}

#[test]
fn of_an_endless_output_no_more_than_a_limit_is_remembered() {
    let script = "head -c 70000000 /dev/zero | tr '\\0' '1'";
    let says = Bench::new(script, &[("tip", "column:-:1")]).run(1.0, &[1.0]).unwrap_err();
    assert!(says.contains("the standard output is longer than 64 MiB"), "{says}");
}

#[test]
fn a_value_that_is_not_finite_is_named_with_its_output_its_solver_and_its_time() {
    let says = Bench::new("echo '{\"tip\": [1, NaN]}'", &[]).run(1.0, &[1.0, 2.0]).unwrap_err();
    assert_eq!(says, "output `tip` of the solver `sh` is not a finite number at t = 2");
}

#[test]
fn a_study_that_cannot_work_is_refused_before_any_run() {
    let refused = |change: &dyn Fn(&mut Bench)| {
        let mut bench = Bench::new("", &[]);
        change(&mut bench);
        bench.forward().map(|_| ()).unwrap_err()
    };
    let says = refused(&|bench| bench.files().reads = map(&[("tpi", "json")]));
    assert!(says.contains("reads `tpi`, which is no output; did you mean `tip`?"), "{says}");
    let says = refused(&|bench| bench.files().reads = map(&[("tip", "xml:out.xml")]));
    assert!(says.contains("there is no rule `xml:out.xml`; rules are `json`"), "{says}");
    let says = refused(&|bench| bench.files().templates = map(&[("../in.txt", "")]));
    assert!(says.contains("`../in.txt` lies outside the run's folder"), "{says}");
    let says = refused(&|bench| bench.files().templates = map(&[("in.txt", "{{ k")]));
    assert!(says.contains("the template of `in.txt`, line 1"), "{says}");
    let says = refused(&|bench| bench.def.command.clear());
    assert!(says.contains("needs a `command`"), "{says}");
    let says = refused(&|bench| bench.def.command.push("{kk}".to_owned()));
    assert!(says.contains("`{kk}` in the command stands for nothing; did you mean `{k}`?"), "{says}");
}

#[test]
fn what_does_not_exist_is_named() {
    let says = Bench::new("", &[]).command(&["no-such-solver"]).run(1.0, &[1.0]).unwrap_err();
    assert!(says.contains("the solver `no-such-solver` cannot be started: no such program"), "{says}");
    let mut bench = Bench::new("", &[]);
    bench.files().templates = map(&[("in.txt", "a\n{{ kk }}\n")]);
    let says = bench.run(1.0, &[1.0]).unwrap_err();
    assert!(
        says.contains("template of `in.txt`, line 2: nothing is named `kk`; did you mean `k`?"),
        "{says}"
    );
    bench.files().templates.clear();
    bench.files().copies = map(&[("mesh.inp", "/nowhere/mesh.inp")]);
    let says = bench.run(1.0, &[1.0]).unwrap_err();
    assert!(says.contains("/nowhere/mesh.inp cannot be copied into the run's folder"), "{says}");
}
