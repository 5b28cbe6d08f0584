//! The scripts that engines are given, made from the templates in `deploy/templates`.

use std::collections::BTreeMap;
use std::path::Path;

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, UndefinedBehavior};
use serde::Serialize;
use serde_json::{Value, json};

use crate::error::DeployError;
use crate::order::Order;

/// Every template, by its name.
const TEMPLATES: &[(&str, &str)] = &[
    ("worker.sh", include_str!("../templates/worker.sh")),
    ("worker.sbatch", include_str!("../templates/worker.sbatch")),
    ("worker.pbs", include_str!("../templates/worker.pbs")),
    ("coordinator.sbatch", include_str!("../templates/coordinator.sbatch")),
    ("hosts-start.sh", include_str!("../templates/hosts-start.sh")),
    ("hosts-ask.sh", include_str!("../templates/hosts-ask.sh")),
    ("kubernetes/container.yaml", include_str!("../templates/kubernetes/container.yaml")),
    ("kubernetes/coordinator.yaml", include_str!("../templates/kubernetes/coordinator.yaml")),
    ("kubernetes/disruption.yaml", include_str!("../templates/kubernetes/disruption.yaml")),
    ("kubernetes/kustomization.yaml", include_str!("../templates/kubernetes/kustomization.yaml")),
    ("kubernetes/network.yaml", include_str!("../templates/kubernetes/network.yaml")),
    ("kubernetes/run-folder.yaml", include_str!("../templates/kubernetes/run-folder.yaml")),
    ("kubernetes/scale.yaml", include_str!("../templates/kubernetes/scale.yaml")),
    ("kubernetes/security.yaml", include_str!("../templates/kubernetes/security.yaml")),
    ("kubernetes/study-volume.yaml", include_str!("../templates/kubernetes/study-volume.yaml")),
    ("kubernetes/workers.yaml", include_str!("../templates/kubernetes/workers.yaml")),
];

/// The script of a template with these values. A value that is missing is an error; the filter `sh` makes one word for a shell.
pub(crate) fn script(name: &'static str, values: impl Serialize) -> Result<String, DeployError> {
    let made = || {
        let mut environment = Environment::new();
        environment.set_undefined_behavior(UndefinedBehavior::Strict);
        // The templates say where a value is quoted, and how.
        environment.set_auto_escape_callback(|_| AutoEscape::None);
        environment
            .set_syntax(SyntaxConfig::builder().keep_trailing_newline(true).trim_blocks(true).build()?);
        environment.add_filter("sh", |text: String| shell_words::quote(&text).into_owned());
        for (name, text) in TEMPLATES {
            environment.add_template(name, text)?;
        }
        environment.get_template(name)?.render(Serde(values))
    };
    made().map_err(|source| DeployError::Script { name, source })
}

/// The script of a worker under an engine: the values of `worker.sh`, which its template includes, and the engine's own, which take the
/// place of those. `slots` are those of a worker where the order says none, as words of a shell.
pub(crate) fn worker_script(
    name: &'static str,
    order: &Order,
    slots: &str,
    own: impl IntoIterator<Item = (&'static str, Value)>,
) -> Result<String, DeployError> {
    let common = [
        ("name", json!(order.name)),
        ("program", json!(text(&order.program))),
        ("access", json!(text(&order.access))),
        ("scratch", json!(order.scratch.as_deref().map(text))),
        ("idle", json!(order.idle)),
        ("slots", json!(order.slots.map_or_else(|| slots.to_owned(), |slots| slots.to_string()))),
        ("is_solver", json!(order.is_solver)),
        ("study", json!(text(&order.study))),
        ("is_copied", json!(false)),
        ("keeps_code", json!(false)),
        ("processes", Value::Null),
    ];
    script(name, common.into_iter().chain(own).collect::<BTreeMap<_, _>>())
}

/// A path as a value of a template.
pub(crate) fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}
