//! The list of recordings: none, all held out, two of one name, held-out channels that nothing measures.
//!
//! What stands in a recording is checked where it is read. Next file to read: `record.rs` beside the folder of this file.

use super::built::CheckedModel;
use crate::checked::Record;
use crate::expand::INITIAL;
use crate::field::field_of;
use crate::file::{RecordSection, StudyFile};
use crate::problem::Source;
use crate::record::{Context, Recordings, found_noise, pool_short_records};

/// Reads all records; their outputs become those of the setup.
pub(super) fn records(
    source: &Source,
    file: &StudyFile,
    model: &mut CheckedModel,
    hold_out: &[String],
    warnings: &mut Vec<String>,
) -> Vec<Record> {
    check_record_list(source, file);
    let mut files = Recordings::new(source);
    let mut context =
        Context { outputs: &mut model.setup.outputs, hold_out, warnings, found_noise: Vec::new() };
    let read = |section: &RecordSection| files.record(section, &model.spec, &mut context);
    let mut records: Vec<Record> = file.records.iter().filter_map(read).collect();
    pool_short_records(&mut records, &mut context.found_noise);
    context.warnings.extend(found_noise::warnings(&context.found_noise));
    check_held_out_components(source, file, &records);
    records
}

fn check_record_list(source: &Source, file: &StudyFile) {
    let end = source.text.len();
    if file.records.is_empty() {
        source.report_with(
            end..end,
            "the study has no record",
            "add `[[records]]` with `name`, `file` and `channels`",
        );
    } else if file.records.iter().all(|r| r.held_out) {
        let help = "remove `use = \"held-out\"` from at least one";
        source.report_with(
            file.records[0].span.clone(),
            "every record is held out: nothing is left to fit",
            help,
        );
    }
    for (i, record) in file.records.iter().enumerate() {
        if file.records[..i].iter().any(|r| r.name.get_ref() == record.name.get_ref()) {
            let message = format!("two records are named `{}`", record.name.get_ref());
            source.report_with(record.name.span(), message, "names of records are unique in a study");
        }
    }
    let has_initial = file.parameters.iter().any(|p| p.name.get_ref().starts_with(INITIAL));
    for rows in file.records.iter().filter_map(|record| record.start_rows.as_ref()).filter(|_| !has_initial) {
        let help = format!("add `[[parameters]]` with `name = \"{INITIAL}<state>\"`, or remove `start_rows`");
        source.report_with(rows.span(), "no initial value is estimated that these rows could tell", help);
    }
    // A held-out name that no channel measures is refused: with a typing error the channel that is meant would be fitted.
    let measured: Vec<String> =
        file.records.iter().flat_map(|r| &r.channels).map(|c| c.output.get_ref().clone()).collect();
    let found = |name: &str| measured.iter().any(|m| field_of(m) == field_of(name));
    report_unmeasured(source, file, &measured, &found);
}

/// Checks held-out components of fields: whether their channel has a column for them is known only after the files are read.
fn check_held_out_components(source: &Source, file: &StudyFile, records: &[Record]) {
    let measured: Vec<String> = records.iter().flat_map(|r| &r.channels).map(|c| c.output.clone()).collect();
    let found = |name: &str| measured.iter().any(|m| m == name || field_of(m) == name);
    if records.len() == file.records.len() {
        report_unmeasured(source, file, &measured, &found);
    }
}

fn report_unmeasured(source: &Source, file: &StudyFile, measured: &[String], found: &dyn Fn(&str) -> bool) {
    for name in file.explain.hold_out_channels.iter().filter(|n| !found(n.get_ref())) {
        let message = format!("no channel measures `{}`, so it cannot be held out", name.get_ref());
        source.report_unknown(name.span(), message, &unique(measured));
    }
}

fn unique(names: &[String]) -> Vec<String> {
    let mut list: Vec<String> = Vec::new();
    for name in names {
        if !list.contains(name) {
            list.push(name.clone());
        }
    }
    list
}
