//! The keys that any quantity of a model may have: its unit and its role.
//!
//! Next files to read: [`super::model`] and [`super::solver`], whose quantities have them.

use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::StrDeserializer;
use starlings_models::Role;
use toml::Spanned;

use super::table::Table;
use crate::problem::Source;

const ROLES: [&str; 18] = [
    "displacement",
    "velocity",
    "level",
    "pressure",
    "flow",
    "temperature",
    "force",
    "resistance",
    "compliance",
    "inertia",
    "stiffness",
    "damping",
    "throat-area",
    "burn-rate",
    "burn-area",
    "web",
    "thrust",
    "other",
];

pub(super) fn unit(t: &Table<'_>) -> String {
    t.text("unit").map(Spanned::into_inner).unwrap_or_default()
}

/// The role that is written.
pub(super) fn role(source: &Source, t: &Table<'_>) -> Option<Role> {
    t.text("role").map(|name| named_role(source, &name))
}

/// The role of this name; an unknown one is reported.
pub(super) fn named_role(source: &Source, name: &Spanned<String>) -> Role {
    let deserializer: StrDeserializer<'_, serde::de::value::Error> =
        name.get_ref().as_str().into_deserializer();
    Role::deserialize(deserializer).unwrap_or_else(|_| {
        let valid: Vec<String> = ROLES.iter().map(|r| (*r).to_owned()).collect();
        source.report_unknown(name.span(), format!("unknown role `{}`", name.get_ref()), &valid);
        Role::Other
    })
}
