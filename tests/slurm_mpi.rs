//! A solver on several ranks under a real Slurm of four nodes, which `.ci/slurm test` starts: an allocation of two nodes for a worker, whose
//! solver has a rank on each.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod access_kit;
mod common;
mod slurm_kit;

use std::path::Path;

use access_kit::Started;
use common::{output, repository, starlings};
use slurm_kit::{deploy, remove};

/// The example with ranks that `srun` starts on the nodes of the allocation.
fn study(folder: &Path) -> std::path::PathBuf {
    for entry in std::fs::read_dir(repository("examples/mpi")).unwrap().flatten() {
        std::fs::copy(entry.path(), folder.join(entry.file_name())).unwrap();
    }
    // Every rank leaves a file with the name of its node.
    let ranks = folder.join("ranks");
    std::fs::create_dir(&ranks).unwrap();
    let text = std::fs::read_to_string(folder.join("rod.py")).unwrap();
    let told = format!(
        "import os\nopen(os.path.join({:?}, os.environ.get('SLURM_PROCID', 'none') + '-' + os.environ.get('SLURMD_NODENAME', 'none')), 'w')\n",
        ranks.to_str().unwrap()
    );
    std::fs::write(folder.join("rod.py"), text.replacen("import numpy", &(told + "import numpy"), 1))
        .unwrap();
    let file = folder.join("study.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let environment = "environment = { STARLINGS_MPI_LAUNCHER = \"srun\", SLURM_MPI_TYPE = \"pmix\", ";
    let text = text.replacen("environment = { ", environment, 1);
    std::fs::write(
        &file,
        text.replacen("adapter = \"mpi\"", "adapter = \"mpi\"\ndescribed = \"solver.json\"", 1),
    )
    .unwrap();
    // What it says of itself, on a rank of this machine.
    let mut describe = starlings();
    describe.args(["worker", "--describe", "--adapter", "mpi", "--solver", "python3 rod.py"]);
    let (code, described, said) = output(describe.current_dir(folder));
    assert_eq!(code, 0, "{said}");
    std::fs::write(folder.join("solver.json"), described).unwrap();
    std::fs::remove_dir_all(&ranks).unwrap();
    std::fs::create_dir(&ranks).unwrap();
    file
}

#[test]
#[ignore = "needs a Slurm and MPI: .ci/slurm test"]
fn the_ranks_of_a_solver_are_on_both_nodes_of_the_allocation_of_its_worker_and_no_byte_changes() {
    let dir = tempfile::tempdir().unwrap();
    let file = study(dir.path());
    let (out, fit) = (dir.path().join("pool"), dir.path().join("fit"));
    let options = [
        "--workers",
        "1",
        "--slots",
        "1",
        "--",
        "--nodes=2",
        "--ntasks=2",
        "--ntasks-per-node=1",
        "--exclusive",
    ];
    let (code, said) = deploy(&file, &out, &options);
    assert_eq!(code, 0, "{said}");
    let mut call = starlings();
    call.arg("run").arg(&file).args(["--listen", "127.0.0.1:0", "--access"]).arg(out.join("access.json"));
    let mut coordinator = Started::of(call.arg("--out").arg(&fit));
    assert_eq!(coordinator.end(), Some(0), "{}", coordinator.said());
    let mut ranks: Vec<String> = std::fs::read_dir(dir.path().join("ranks"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    ranks.sort();
    let numbers: Vec<&str> = ranks.iter().map(|rank| rank.split('-').next().unwrap()).collect();
    let nodes: std::collections::BTreeSet<&str> =
        ranks.iter().map(|rank| rank.split_once('-').unwrap().1).collect();
    assert!(numbers == ["0", "1"] && nodes.len() == 2, "{ranks:?}");

    // The same ranks on this machine alone.
    let alone = dir.path().join("alone");
    let mut local = starlings();
    local.arg("run").arg(repository("examples/mpi/study.toml")).arg("--out").arg(&alone);
    let (code, _, said) = output(&mut local);
    assert_eq!(code, 0, "{said}");
    let posterior = |folder: &Path| std::fs::read(folder.join("posterior.csv")).unwrap();
    assert_eq!(posterior(&fit), posterior(&alone));
    remove(&out);
}
