//! `starlings deploy kubernetes`: the manifests of a coordinator and its workers, the study and the access file.

use std::path::{Component, Path, PathBuf};

use clap::Parser;
use starlings_coordinator::study::Study;
use starlings_deploy::{DeployError, KubernetesOrder};

use super::{access, failed};
use crate::console::line;
use crate::failure::Failure;
use crate::load::{is_outside, load_where};

/// Write the manifests of a coordinator and its workers for Kubernetes: a base for kustomize, and the access file as a secret.
///
/// Nothing is applied. The image holds this program; deploy/Containerfile of the sources builds one.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study file.
    study: PathBuf,
    /// Image with this program, and with the solver where the model is one.
    #[arg(long)]
    image: String,
    /// Number of workers; with --max-workers the least.
    #[arg(long, value_name = "N")]
    workers: usize,
    /// Scale workers up to so many, by their use of processors.
    #[arg(long, value_name = "N")]
    max_workers: Option<usize>,
    /// Scale by this external metric of the cluster, the number of runs in the queue, instead.
    #[arg(long, value_name = "NAME", requires = "max_workers")]
    queue_metric: Option<String>,
    /// Runs of one worker at a time, and cores that it asks for.
    #[arg(long, value_name = "N", default_value_t = 1)]
    slots: usize,
    /// Memory of one worker.
    #[arg(long, value_name = "SIZE", default_value = "2Gi")]
    memory: String,
    /// Room for the run folder.
    #[arg(long, value_name = "SIZE", default_value = "10Gi")]
    storage: String,
    /// Claim of a volume that holds the folder of the study, where that is larger than 1 MiB; a ConfigMap holds it otherwise.
    #[arg(long, value_name = "CLAIM")]
    study_claim: Option<String>,
    /// Folder for the manifests; deploy/NAME-kubernetes without it.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Writes the folder.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if args.workers == 0 || args.slots == 0 {
        return Err(Failure::input("--workers and --slots must be at least 1"));
    }
    if args.max_workers.is_some_and(|most| most < args.workers) {
        return Err(Failure::input("--max-workers must be at least --workers"));
    }
    let study = load_where(&args.study, false)?;
    let order = order(args, &study)?;
    let manifests = order.manifests().map_err(failed)?;
    let default = || Path::new("deploy").join(format!("{}-kubernetes", study.name));
    let folder = args.out.clone().unwrap_or_else(default);
    if std::fs::read_dir(&folder).is_ok_and(|mut entries| entries.next().is_some()) {
        return Err(failed(DeployError::Occupied(folder)));
    }
    let manifests = manifests.into_iter().map(|(name, text)| (PathBuf::from(name), text.into_bytes()));
    let files = order.files.iter().map(|(path, bytes)| (Path::new("study").join(path), bytes.clone()));
    // Secrets are not for a repository.
    let ignored = [(PathBuf::from(".gitignore"), b"access/\n".to_vec())];
    for (name, bytes) in manifests.chain(files).chain(ignored) {
        put(&folder.join(name), &bytes)?;
    }
    let secrets = folder.join("access");
    std::fs::create_dir_all(&secrets).map_err(|error| unwritable(&secrets, &error))?;
    access::prepare(&secrets.join("access.json"), &study.name, vec![order.address()])?;
    let shown = shell_words::quote(&folder.to_string_lossy()).into_owned();
    let name = &order.name;
    line(format_args!("{shown} is written; nothing is applied"))?;
    line(format_args!("next:    kubectl apply -k {shown}"))?;
    line(format_args!("status:  kubectl get pods -l app.kubernetes.io/instance={name}"))?;
    line(format_args!(
        "remove:  kubectl delete -k {shown}   (the claim {name}-runs goes with it: copy the run folder before)"
    ))
}

fn order(args: &Args, study: &Study) -> Result<KubernetesOrder, Failure> {
    let name = args.study.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let files = if args.study_claim.is_some() { Vec::new() } else { files(study, &args.study)? };
    Ok(KubernetesOrder {
        name: KubernetesOrder::name_of(&study.name, stamp()),
        image: args.image.clone(),
        workers: args.workers,
        max_workers: args.max_workers,
        queue_metric: args.queue_metric.clone(),
        slots: args.slots,
        memory: args.memory.clone(),
        storage: args.storage.clone(),
        claim: args.study_claim.clone(),
        study: name,
        files,
        is_solver: is_outside(study),
    })
}

/// Tells two deployments of one study apart: by the millisecond, and those of one by who makes them.
fn stamp() -> u64 {
    let milliseconds = jiff::Timestamp::now().as_millisecond().unsigned_abs();
    (milliseconds << 16) | u64::from(std::process::id() & 0xffff)
}

/// The study file and the files that it names, by their paths in its folder.
fn files(study: &Study, path: &Path) -> Result<Vec<(PathBuf, Vec<u8>)>, Failure> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut found =
        vec![(PathBuf::from(path.file_name().unwrap_or_default()), study.text.as_bytes().to_vec())];
    // Any quoted text may name a file, and an input as `file:column`.
    let quoted = study.text.split(['"', '\'', '\n']).filter(|text| !text.trim().is_empty());
    for name in quoted.flat_map(|text| [Some(text), text.rsplit_once(':').map(|(file, _)| file)]).flatten() {
        let named = Path::new(name);
        let beside = folder.join(named);
        if !beside.is_file() || found.iter().any(|(known, _)| known == named) {
            continue;
        }
        if !named.components().all(|part| matches!(part, Component::Normal(_))) {
            return Err(Failure::input(format!(
                "the study names {name}, which does not stand in its folder or below it: a pod sees that folder alone; put the file \
                 there, or the whole on a volume with --study-claim"
            )));
        }
        let bytes = std::fs::read(&beside)
            .map_err(|error| Failure::input(format!("cannot read {}: {error}", beside.display())))?;
        found.push((named.to_owned(), bytes));
    }
    Ok(found)
}

fn put(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let folder = path.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(path, bytes))
        .map_err(|error| unwritable(path, &error))
}

fn unwritable(path: &Path, error: &std::io::Error) -> Failure {
    Failure::input(format!("cannot write {}: {error}", path.display()))
}
