//! Kubernetes: a kustomize base of a coordinator, its workers, and what they need. It is written and not applied: what runs in a cluster is
//! asked and removed with the cluster's own tools.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::error::DeployError;
use crate::order::check_path;
use crate::script::script;

/// The port on which the coordinator listens.
pub const PORT: u16 = 7000;

/// The largest content of a ConfigMap, bytes (the limit of the Kubernetes API).
const LARGEST: usize = 1024 * 1024;

/// The longest part of a name that is taken from a study.
const LONGEST: usize = 24;

/// What is to run in a cluster.
#[derive(Clone, Debug)]
pub struct KubernetesOrder {
    /// Name of everything, of lower-case letters, digits and `-`.
    pub name: String,
    /// The image with this program.
    pub image: String,
    /// Number of workers, at least one; where they are scaled, the least.
    pub workers: usize,
    /// The most workers, where they are scaled.
    pub max_workers: Option<usize>,
    /// External metric by which they are scaled instead of their use of processors.
    pub queue_metric: Option<String>,
    /// Runs of one worker at a time, and cores that it asks for.
    pub slots: usize,
    /// Memory of one worker, such as `2Gi`.
    pub memory: String,
    /// Room for the run folder, such as `10Gi`.
    pub storage: String,
    /// Claim of a volume with the folder of the study; where there is none, `files` go into a ConfigMap.
    pub claim: Option<String>,
    /// Name of the study file in that folder.
    pub study: String,
    /// Files of the study, by their paths in its folder.
    pub files: Vec<(PathBuf, Vec<u8>)>,
    /// Whether the model of the study is a program of its own, which must be in the image.
    pub is_solver: bool,
}

#[derive(Serialize)]
struct File {
    key: String,
    path: String,
}

#[derive(Serialize)]
struct Values<'a> {
    name: &'a str,
    image: &'a str,
    workers: usize,
    max_workers: Option<usize>,
    queue_metric: Option<&'a str>,
    slots: usize,
    memory: &'a str,
    storage: &'a str,
    claim: Option<&'a str>,
    study_path: String,
    is_solver: bool,
    port: u16,
    files: Vec<File>,
}

/// The manifests, in the order of the templates.
const MANIFESTS: [(&str, &str); 7] = [
    ("kustomization.yaml", "kubernetes/kustomization.yaml"),
    ("coordinator.yaml", "kubernetes/coordinator.yaml"),
    ("workers.yaml", "kubernetes/workers.yaml"),
    ("run-folder.yaml", "kubernetes/run-folder.yaml"),
    ("disruption.yaml", "kubernetes/disruption.yaml"),
    ("network.yaml", "kubernetes/network.yaml"),
    ("scale.yaml", "kubernetes/scale.yaml"),
];

impl KubernetesOrder {
    /// A name for a deployment of a study that Kubernetes takes: `stamp` tells it from others. With the longest ending it has no more
    /// than the 63 letters of a label.
    pub fn name_of(study: &str, stamp: u64) -> String {
        let stamp = base_36(stamp);
        let lower = study.to_lowercase();
        let plain: String =
            lower.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).take(LONGEST).collect();
        let plain = plain.trim_matches('-');
        if plain.is_empty() { format!("starlings-{stamp}") } else { format!("starlings-{plain}-{stamp}") }
    }

    /// Where workers dial the coordinator.
    pub fn address(&self) -> String {
        format!("{}-coordinator:{PORT}", self.name)
    }

    /// The manifests, name and text of each.
    ///
    /// # Errors
    /// When a manifest cannot name a file of the study, or all are too large for a ConfigMap and no claim is given.
    pub fn manifests(&self) -> Result<Vec<(String, String)>, DeployError> {
        check_path(Path::new(&self.study))?;
        self.files.iter().try_for_each(|(path, _)| check_path(path))?;
        let bytes = self.files.iter().map(|(path, bytes)| path.as_os_str().len() + bytes.len()).sum();
        if self.claim.is_none() && bytes > LARGEST {
            return Err(DeployError::TooLarge { bytes, most: LARGEST });
        }
        let is_wanted = |name: &&(&str, &str)| name.0 != "scale.yaml" || self.max_workers.is_some();
        let made = |(name, template): &(&'static str, &'static str)| {
            Ok(((*name).to_owned(), script(template, self.values())?))
        };
        MANIFESTS.iter().filter(is_wanted).map(made).collect()
    }

    fn values(&self) -> Values<'_> {
        let key = |(i, (path, _)): (usize, &(PathBuf, Vec<u8>))| File {
            key: format!("file-{i}"),
            path: path.to_string_lossy().into_owned(),
        };
        Values {
            name: &self.name,
            image: &self.image,
            workers: self.workers,
            max_workers: self.max_workers,
            queue_metric: self.queue_metric.as_deref(),
            slots: self.slots,
            memory: &self.memory,
            storage: &self.storage,
            claim: self.claim.as_deref(),
            study_path: format!("/study/{}", self.study),
            is_solver: self.is_solver,
            port: PORT,
            files: self.files.iter().enumerate().map(key).collect(),
        }
    }
}

/// Digits and lower-case letters.
fn base_36(mut number: u64) -> String {
    let mut digits = Vec::new();
    loop {
        digits.extend(char::from_digit((number % 36) as u32, 36));
        number /= 36;
        if number == 0 {
            return digits.into_iter().rev().collect();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(bytes: usize) -> KubernetesOrder {
        KubernetesOrder {
            name: "starlings-a".to_owned(),
            image: "a:1".to_owned(),
            workers: 2,
            max_workers: None,
            queue_metric: None,
            slots: 1,
            memory: "1Gi".to_owned(),
            storage: "1Gi".to_owned(),
            claim: None,
            study: "study.toml".to_owned(),
            files: vec![("study.toml".into(), vec![0; bytes])],
            is_solver: false,
        }
    }

    #[test]
    fn a_name_is_one_that_kubernetes_takes() {
        let name = KubernetesOrder::name_of;
        assert_eq!(
            (name("Pig Aorta_2", 35), name("\u{e9}", 36)),
            ("starlings-pig-aorta-2-z".into(), "starlings-10".into())
        );
        let longest = format!("{}-coordinator", name(&"a".repeat(99), u64::MAX));
        assert!(longest.len() < 64, "{longest}");
    }

    #[test]
    fn a_study_that_is_larger_than_a_config_map_needs_a_claim() {
        let refused = order(LARGEST).manifests();
        assert!(matches!(refused, Err(DeployError::TooLarge { .. })));
        assert_eq!(order(LARGEST - 99).manifests().unwrap().len(), 6);
        let claimed = KubernetesOrder { claim: Some("data".to_owned()), ..order(LARGEST) };
        let manifests = claimed.manifests().unwrap();
        assert!(manifests.iter().any(|(_, text)| text.contains("claimName: \"data\"")));
        assert!(manifests.iter().all(|(_, text)| !text.contains("configMap")));
    }
}
