//! A solver on several ranks under a real Slurm of four nodes, which `.ci/slurm test` starts: a worker has an allocation of two nodes, and
//! `srun` starts a rank of its solver on each.
//!
//! The ranks do not speak with each other: MPI libraries find theirs by PMIx, which wants every node to be a machine of its own.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod access_kit;
mod common;
mod slurm_kit;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use common::{output, repository, starlings};
use slurm_kit::{coordinator, deploy, remove};

/// Every rank tells its number and node; the first one is the solver of the example.
const RANK: &str = "folder=\"$(dirname \"$0\")\"
: > \"$folder/ranks/$SLURM_PROCID-$SLURMD_NODENAME\"
[ \"$SLURM_PROCID\" = 0 ] && exec python3 oscillator.py
exec sleep 1000
";

/// The example with two ranks that `srun` starts on the nodes of the allocation.
fn study(folder: &Path) -> PathBuf {
    for entry in std::fs::read_dir(repository("examples/solver-python")).unwrap().flatten() {
        if entry.path().is_file() {
            std::fs::copy(entry.path(), folder.join(entry.file_name())).unwrap();
        }
    }
    std::fs::create_dir(folder.join("ranks")).unwrap();
    std::fs::write(folder.join("rank.sh"), RANK).unwrap();
    let mut describe = starlings();
    describe.args(["worker", "--describe", "--solver", "python3 oscillator.py"]).current_dir(folder);
    let (code, described, said) = output(&mut describe);
    assert_eq!(code, 0, "{said}");
    std::fs::write(folder.join("solver.json"), described).unwrap();
    let file = folder.join("study.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let ours = "command = [\"sh\", \"rank.sh\"]
adapter = \"mpi\"
ranks = 2
described = \"solver.json\"
environment = { STARLINGS_MPI_LAUNCHER = \"srun\" }";
    let changed = text.replacen("command = [\"python3\", \"oscillator.py\"]", ours, 1);
    assert_ne!(changed, text);
    std::fs::write(&file, changed).unwrap();
    file
}

#[test]
#[ignore = "needs a Slurm and the Python package: .ci/slurm test"]
fn the_ranks_of_a_solver_are_on_both_nodes_of_the_allocation_of_its_worker_and_no_byte_changes() {
    let dir = tempfile::tempdir().unwrap();
    let file = study(dir.path());
    let (out, fit) = (dir.path().join("pool"), dir.path().join("fit"));
    let options = ["--workers", "1", "--slots", "1", "--"];
    let allocation = ["--nodes=2", "--ntasks=2", "--ntasks-per-node=1", "--exclusive"];
    let (code, said) = deploy(&file, &out, &[&options[..], &allocation].concat());
    assert_eq!(code, 0, "{said}");
    let mut coordinator = coordinator(&file, &out.join("access.json"), &fit);
    assert_eq!(coordinator.end(), Some(0), "{}", coordinator.said());
    let ranks: BTreeSet<String> = std::fs::read_dir(dir.path().join("ranks"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    let split: Vec<(&str, &str)> = ranks.iter().map(|rank| rank.split_once('-').unwrap()).collect();
    assert!(matches!(split[..], [("0", one), ("1", other)] if one != other), "{ranks:?}");

    let alone = dir.path().join("alone");
    let mut local = starlings();
    local.arg("run").arg(repository("examples/solver-python/study.toml")).arg("--out").arg(&alone);
    let (code, _, said) = output(&mut local);
    assert_eq!(code, 0, "{said}");
    let posterior = |folder: &Path| std::fs::read(folder.join("posterior.csv")).unwrap();
    assert_eq!(posterior(&fit), posterior(&alone));
    remove(&out);
}
