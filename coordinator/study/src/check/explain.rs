//! Settings of `explain`: what is held out must leave something to fit, what is named must exist.
//!
//! Whether any candidate is left to try is checked by the command `explain`: other commands run such a study. Next file to
//! read: [`super::settings`].

use starlings_models::effect::library::{FAMILIES, library};
use starlings_models::{BuildSetup, ModelDef, Setup};
use toml::Spanned;

use super::settings::counted;
use crate::checked::{ExplainChoice, Library, PROPOSALS, Record};
use crate::file::table::choose;
use crate::file::{ChannelSection, StudyFile};
use crate::problem::Source;

/// Effects at most that one explanation may add.
const MAX_EFFECTS: u64 = 3;

/// `[explain]`.
pub(crate) fn explain(source: &Source, file: &StudyFile) -> ExplainChoice {
    let section = &file.explain;
    let libraries = [("all", Library::All), ("study", Library::Study), ("built-in", Library::BuiltIn)];
    let names = |list: &[Spanned<String>]| list.iter().map(|name| name.get_ref().clone()).collect();
    ExplainChoice {
        hold_out_channels: names(&section.hold_out_channels),
        budget: counted(source, section.budget.as_ref(), "budget", u64::MAX).map(|n| n as u64),
        library: choose(source, section.library.as_ref(), "library", &libraries).unwrap_or_default(),
        without: names(&section.without),
        only: names(&section.only),
        max_effects: counted(source, section.max_effects.as_ref(), "max_effects", MAX_EFFECTS),
    }
}

/// What is named must be an effect described in the study, a built-in effect for its model or a family of these.
pub(crate) fn check_names(source: &Source, file: &StudyFile, model: &ModelDef) {
    let section = &file.explain;
    if section.without.is_empty() && section.only.is_empty() {
        return;
    }
    let bare = Setup { model: model.clone(), ..Setup::default() };
    // A model that does not build is reported elsewhere.
    let Ok(spec) = bare.spec() else { return };
    let mut known: Vec<String> = library(&spec).into_iter().map(|effect| effect.name).collect();
    known.extend(file.effects.iter().map(|effect| effect.name.get_ref().clone()));
    known.extend(FAMILIES.iter().map(|family| family.name.to_owned()));
    known.push(PROPOSALS.to_owned());
    known.sort();
    known.dedup();
    for name in section.without.iter().chain(&section.only).filter(|name| !known.contains(name.get_ref())) {
        source.report_unknown(name.span(), format!("no effect is named `{}`", name.get_ref()), &known);
    }
    for name in
        section.only.iter().filter(|name| section.without.iter().any(|w| w.get_ref() == name.get_ref()))
    {
        let message = format!("`{}` is both in `only` and in `without`", name.get_ref());
        source.report_with(name.span(), message, "remove it from one of them");
    }
}

/// A column that is held out must not be fitted under another name.
pub(crate) fn check_held_out(source: &Source, file: &StudyFile, records: &[Record]) {
    for (section, record) in file.records.iter().zip(records) {
        let held_out = |channel: &ChannelSection| {
            record.channels.iter().any(|c| c.held_out && c.output == *channel.output.get_ref())
        };
        for channel in section.channels.iter().filter(|c| c.surface.is_none() && held_out(c)) {
            let same = |other: &&ChannelSection| {
                other.surface.is_none()
                    && !held_out(other)
                    && other.column.get_ref() == channel.column.get_ref()
            };
            if let Some(other) = section.channels.iter().find(same) {
                let (held_out, fitted) = (channel.output.get_ref(), other.output.get_ref());
                let message = format!(
                    "column `{}` is held out as `{held_out}` and fitted as `{fitted}`",
                    channel.column.get_ref()
                );
                source.report_with(
                    other.column.span(),
                    message,
                    "what is held out must not be seen by the fit: keep one",
                );
            }
        }
    }
}
