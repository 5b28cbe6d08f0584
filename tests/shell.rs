//! What shells and `man` are told of the commands.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::process::Command;

use common::{output, starlings};

#[test]
fn bash_completes_commands_and_options() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("starlings.bash");
    let (code, said, stderr) = output(starlings().args(["completions", "bash"]));
    assert_eq!(code, 0, "{stderr}");
    std::fs::write(&script, said).unwrap();
    let ask = |line: &str| {
        let words = line.split(' ').count();
        let ask = format!(
            "source '{}'; COMP_WORDS=({line}); [ {words} -gt ${{#COMP_WORDS[@]}} ] && COMP_WORDS+=(''); COMP_CWORD={}; \
             _starlings starlings \"${{COMP_WORDS[COMP_CWORD]}}\" \"${{COMP_WORDS[COMP_CWORD-1]}}\"; echo \"${{COMPREPLY[@]}}\"",
            script.display(),
            words - 1
        );
        let answer = Command::new("bash").args(["-c", &ask]).output().unwrap();
        assert!(answer.status.success(), "{}", String::from_utf8_lossy(&answer.stderr));
        String::from_utf8(answer.stdout).unwrap()
    };
    assert_eq!(ask("starlings expl").trim(), "explain");
    assert!(ask("starlings run --st").contains("--state-memory"), "{}", ask("starlings run --st"));
}

#[test]
fn every_command_has_its_page() {
    let folder = tempfile::tempdir().unwrap();
    let (code, _, stderr) = output(starlings().arg("manual").arg(folder.path()));
    assert_eq!(code, 0, "{stderr}");
    let page = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert!(page("starlings.1").contains("starlings\\-run(1)"), "{}", page("starlings.1"));
    assert!(page("starlings-run.1").contains("\\-\\-state\\-memory"), "{}", page("starlings-run.1"));
    let (_, help, _) = output(starlings().arg("--help"));
    let commands =
        help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    for name in
        commands.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next())
    {
        if name != "help" {
            assert!(page(&format!("starlings-{name}.1")).starts_with(".ie"), "{name}");
        }
    }
}

#[test]
fn a_folder_that_cannot_be_made_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    let (code, _, stderr) = output(starlings().arg("manual").arg(file.join("pages")));
    assert_eq!(code, 2);
    assert!(stderr.contains("cannot write to"), "{stderr}");
}
