//! What `starlings deploy kubernetes` writes: manifests, the study, and an access file that both sides take.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod access_kit;
mod common;

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

use access_kit::{token, value, worker};
use common::{output, repository, starlings};

const STUDY: &str = "examples/pig-aorta/study.toml";

/// Writes manifests into `out`: exit code and everything that was said.
fn write(study: &Path, out: &Path, options: &[&str]) -> (i32, String) {
    let mut command = starlings();
    command.args(["deploy", "kubernetes"]).arg(study).args([
        "--image",
        "registry.local/starlings:1",
        "--out",
    ]);
    let (code, stdout, stderr) = output(command.arg(out).args(options));
    (code, stdout + &stderr)
}

fn read(out: &Path, name: &str) -> String {
    std::fs::read_to_string(out.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn the_base_holds_the_study_with_its_data_and_no_secret_outside_its_folder() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("base");
    let (code, said) = write(&repository(STUDY), &out, &["--workers", "3"]);
    assert!(code == 0 && said.contains("kubectl apply -k"), "{said}");
    for name in ["study.toml", "data/in-vivo-1.csv"] {
        let original = std::fs::read(repository("examples/pig-aorta").join(name)).unwrap();
        assert_eq!(std::fs::read(out.join("study").join(name)).unwrap(), original, "{name}");
    }
    let kustomization = read(&out, "kustomization.yaml");
    assert!(kustomization.contains("study/data/in-vivo-1.csv") && !kustomization.contains("scale.yaml"));
    let secret = token(&out.join("access/access.json"));
    for name in ["access/access.json", "access/access.key"] {
        let mode = std::fs::metadata(out.join(name)).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600, "{name}");
    }
    for name in ["kustomization.yaml", "coordinator.yaml", "workers.yaml", "network.yaml"] {
        assert!(!read(&out, name).contains(&secret[..16]), "{name}");
    }
    assert_eq!(read(&out, ".gitignore"), "access/\n");
    let address =
        |out: &Path| value(&out.join("access/access.json"), "addresses")[0].as_str().unwrap().to_owned();
    let first = address(&out);
    assert!(first.starts_with("starlings-pig-aorta-") && first.ends_with("-coordinator:7000"), "{first}");
    // Two deployments of one study are two, also in the same second.
    let again = dir.path().join("again");
    assert_eq!(write(&repository(STUDY), &again, &["--workers", "3"]).0, 0);
    assert_ne!(first, address(&again));
}

#[test]
fn an_access_file_that_was_made_beforehand_is_taken_by_both_sides_in_copies_of_their_own() {
    let dir = tempfile::tempdir().unwrap();
    let ours = dir.path().join("access.json");
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let make = |file: &Path| output(starlings().args(["deploy", "access", "--address", &free]).arg(file));
    assert_eq!(make(&ours).0, 0);
    let secret = token(&ours);
    let (code, _, said) = make(&ours);
    assert!(code == 2 && said.contains("is an access file already"), "{said}");
    let theirs = dir.path().join("theirs");
    std::fs::create_dir(&theirs).unwrap();
    std::fs::copy(&ours, theirs.join("access.json")).unwrap();
    // As in a pod: the worker is there first, and never sees what the coordinator writes into its own copy.
    let mut worker = worker(&theirs.join("access.json"), &[]);
    let options = ["--listen", &free, "--access", ours.to_str().unwrap(), "--json", "--out"];
    let run = dir.path().join("run");
    let mut command = starlings();
    command.arg("run").arg(repository("examples/rcr/study.toml")).args(options).arg(&run);
    let (code, _, said) = output(&mut command);
    assert_eq!(code, 0, "{said}");
    assert_eq!(worker.end(), Some(0), "{}", worker.said());
    assert_eq!(token(&ours), secret, "the secrets are those that were made");
}

#[test]
fn what_no_cluster_could_run_is_refused_before_anything_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("base");
    let cases: [(&[&str], &str); 3] = [
        (&["--workers", "0"], "must be at least 1"),
        (&["--workers", "4", "--max-workers", "3"], "--max-workers must be at least --workers"),
        (&["--workers", "1", "--queue-metric", "queue"], "--max-workers"),
    ];
    for (options, words) in cases {
        let (code, said) = write(&repository(STUDY), &out, options);
        assert!(code == 2 && said.contains(words), "{options:?}: {said}");
    }
    let text = std::fs::read_to_string(repository("examples/rcr/study.toml")).unwrap();
    let folder = dir.path().join("study");
    std::fs::create_dir(&folder).unwrap();
    for entry in std::fs::read_dir(repository("examples/rcr")).unwrap().flatten() {
        if entry.path().extension().is_some_and(|ending| ending == "csv") {
            std::fs::copy(entry.path(), dir.path().join(entry.file_name())).unwrap();
            std::fs::copy(entry.path(), folder.join(entry.file_name())).unwrap();
        }
    }
    let study = folder.join("study.toml");
    std::fs::write(&study, text.replace("file = \"", "file = \"../")).unwrap();
    let (code, said) = write(&study, &out, &["--workers", "1"]);
    assert!(code == 2 && said.contains("does not stand in its folder"), "{said}");
    std::fs::write(&study, text + &format!("# {}\n", "x".repeat(1 << 20))).unwrap();
    let (code, said) = write(&study, &out, &["--workers", "1"]);
    assert!(
        code == 2 && said.contains("a ConfigMap holds 1048576") && said.contains("--study-claim"),
        "{said}"
    );
    assert!(!out.exists(), "nothing was written");
    let (code, said) = write(&study, &out, &["--workers", "1", "--study-claim", "data"]);
    assert_eq!(code, 0, "{said}");
}

/// The whole of a base as `kubectl kustomize` puts it together, validated strictly: what the validator says, nothing where all is well.
fn faults(base: &Path, change: impl Fn(String) -> String) -> String {
    let (code, made, said) = output(Command::new("kubectl").arg("kustomize").arg(base));
    assert_eq!(code, 0, "{said}");
    let file = base.join("all.yaml");
    std::fs::write(&file, change(made)).unwrap();
    let mut validate = Command::new("kubernetes-validate");
    let (code, stdout, stderr) = output(validate.args(["--strict", "-k", "1.31"]).arg(&file));
    std::fs::remove_file(&file).unwrap();
    if code == 0 { String::new() } else { stdout + &stderr }
}

#[test]
#[ignore = "needs kubectl and kubernetes-validate: .ci/kubernetes"]
fn every_form_of_the_base_is_valid_by_the_published_schema_and_a_misspelt_key_is_not() {
    let dir = tempfile::tempdir().unwrap();
    let forms: [&[&str]; 5] = [
        &["--workers", "3"],
        &["--workers", "3", "--slots", "2", "--memory", "512Mi", "--storage", "1Gi"],
        &["--workers", "1", "--max-workers", "9"],
        &["--workers", "1", "--max-workers", "9", "--queue-metric", "starlings_queue_runs"],
        &["--workers", "1", "--study-claim", "data"],
    ];
    let studies = [STUDY, "examples/calculix/study.toml"];
    for (i, options) in forms.iter().enumerate() {
        for (j, study) in studies.iter().enumerate() {
            let out = dir.path().join(format!("{i}-{j}"));
            let (code, said) = write(&repository(study), &out, options);
            assert_eq!(code, 0, "{study}: {said}");
            assert_eq!(faults(&out, |text| text), "", "{study} {options:?}");
        }
    }
    let misspelt = faults(&dir.path().join("0-0"), |text| text.replace("replicas:", "replicaz:"));
    assert!(misspelt.contains("replicaz"), "{misspelt}");
    // Every document was seen: a job, a service, a deployment, a claim, budgets, policies, secrets and a map.
    let (_, made, _) = output(Command::new("kubectl").arg("kustomize").arg(dir.path().join("2-0")));
    for kind in [
        "Job",
        "Service",
        "Deployment",
        "PersistentVolumeClaim",
        "PodDisruptionBudget",
        "NetworkPolicy",
        "Secret",
        "ConfigMap",
        "HorizontalPodAutoscaler",
    ] {
        assert!(made.contains(&format!("kind: {kind}\n")), "{kind}");
    }
}
