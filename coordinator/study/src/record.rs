//! From `[[records]]` and its CSV files to a [`Record`].
//!
//! Next files to read: [`crate::record::channel`] for what was measured, [`crate::record::input`] for what drives the model.

mod channel;
mod csv;
mod derived;
pub(super) mod found_noise;
#[cfg(fuzzing)]
pub(crate) mod fuzzing;
mod input;
mod left_out;
mod mesh;
mod noise;
mod part;
mod pooled_noise;
mod reader;
mod separator;
mod shapes;
mod start;
mod surface;
mod surface_files;
mod surface_place;
mod training;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use starlings_models::{Spec, did_you_mean, nearest};
use toml::Spanned;

use super::checked::Record;
use super::field::field_of;
use super::file::RecordSection;
use super::problem::Source;
pub(super) use crate::record::csv::Csv;
use crate::record::found_noise::FoundNoise;
use crate::record::input::inputs;
pub(super) use crate::record::pooled_noise::pool_short_records;
use crate::record::reader::ChannelReader;

/// Reads the CSV files of a study, each once.
pub(super) struct Recordings<'a> {
    pub(super) source: &'a Source,
    folder: PathBuf,
    files: BTreeMap<PathBuf, Option<Rc<Csv>>>,
}

/// A record's file with its times.
pub(super) struct Table {
    pub(super) csv: Rc<Csv>,
    pub(super) times: Vec<f64>,
    pub(super) time_column: usize,
}

impl<'a> Recordings<'a> {
    /// Files are looked for beside the study.
    pub(super) fn new(source: &'a Source) -> Self {
        let folder = source.file.parent().unwrap_or(Path::new("")).to_owned();
        Self { source, folder, files: BTreeMap::new() }
    }

    /// The file of this name with the times in the named column; `None` when a problem was reported. `at` is where the study names it.
    pub(super) fn table(
        &mut self,
        name: &str,
        at: &Spanned<String>,
        time: &Spanned<String>,
    ) -> Option<Table> {
        let csv = self.open(name, at)?;
        let time_column = match csv.index(time.get_ref()) {
            Ok(column) => column,
            Err((message, help)) => {
                self.source.report_with(
                    time.span(),
                    message,
                    format!("name the time column by `time = ...`; {help}"),
                );
                return None;
            }
        };
        match csv.times(time_column) {
            Ok(times) => Some(Table { csv, times, time_column }),
            Err(problem) => {
                self.source.adopt(problem);
                None
            }
        }
    }

    /// The file of this name cut into cells; `None` when a problem was reported. `at` is where the study names it.
    pub(super) fn open(&mut self, name: &str, at: &Spanned<String>) -> Option<Rc<Csv>> {
        let path = self.folder.join(name);
        if let Some(known) = self.files.get(&path) {
            return known.clone();
        }
        let csv = self.read(&path, name, at).map(Rc::new);
        self.files.insert(path, csv.clone());
        csv
    }

    fn read(&self, path: &Path, name: &str, at: &Spanned<String>) -> Option<Csv> {
        let bytes = match std::fs::read(path) {
            Ok(bytes) => bytes,
            Err(error) => {
                let message = format!("cannot read `{}`: {}", path.display(), plain(&error));
                self.source.report_with(at.span(), message, self.near_files(name));
                return None;
            }
        };
        let text = match String::from_utf8(bytes) {
            Ok(text) => text,
            Err(error) => {
                let (what, help) = separator::of_bytes(error.as_bytes());
                self.source.report_with(at.span(), format!("`{name}` {what}"), help);
                return None;
            }
        };
        Csv::new(path, text)
            .map_err(|error| error.problems.into_iter().for_each(|p| self.source.adopt(p)))
            .ok()
    }

    /// The nearest file name, or where files are looked for.
    fn near_files(&self, name: &str) -> String {
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        let mut present: Vec<String> = std::fs::read_dir(folder)
            .into_iter()
            .flatten()
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .filter(|n| Path::new(n).extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")))
            .collect();
        present.sort();
        let relative = || "paths are relative to the study file".to_owned();
        nearest(name, &present).map_or_else(relative, did_you_mean)
    }

    /// Reads and checks one record. `outputs` are the study's outputs so far, extended by this record's.
    pub(super) fn record(
        &mut self,
        section: &RecordSection,
        spec: &Spec,
        context: &mut Context<'_>,
    ) -> Option<Record> {
        if *section.every.get_ref() == 0 {
            self.source.report_with(
                section.every.span(),
                "`every` must be at least 1",
                "1 makes a window per row",
            );
        }
        let Some(table) = self.table(section.file.get_ref(), &section.file, &section.time) else {
            // Names can be checked without the file.
            for channel in &section.channels {
                part::quantity(self.source, channel, spec);
            }
            input::unknown_names(self.source, section, spec);
            return None;
        };
        let train = training::span(self.source, section, &table.times);
        let surfaces = self.surfaces(section)?;
        let reader = ChannelReader {
            source: self.source,
            section,
            table: &table,
            train: train.as_ref().ok().copied().flatten(),
            spec,
            surfaces: &surfaces,
        };
        let Some(mut channels) = reader.channels(context) else {
            inputs(self, section, &table, &[], spec);
            return None;
        };
        let rows: Vec<usize> = (0..table.times.len())
            .filter(|row| channels.iter().any(|c| c.values[*row].is_finite()))
            .collect();
        for channel in &mut channels {
            channel.values = rows.iter().map(|row| channel.values[*row]).collect();
        }
        let times: Vec<f64> = rows.iter().map(|row| table.times[*row]).collect();
        let inputs = inputs(self, section, &table, &times, spec)?;
        context.warnings.extend(training::reaches_beyond(section, &times));
        context.warnings.extend(start::rows_before(section, &table, &times, &inputs, spec));
        let start = start::of_run(self.source, section, &times);
        let first_rows = start::first_rows(self.source, section, &times, &channels);
        Some(Record {
            name: section.name.get_ref().clone(),
            start: start?,
            train: train.ok()?.or(first_rows),
            only_start: section.start_rows.is_some(),
            times,
            channels,
            inputs,
            every: usize::try_from(*section.every.get_ref()).unwrap_or(usize::MAX).max(1),
        })
    }
}

impl Recordings<'_> {
    /// Reports what is wrong with the files of a record, whatever the model: missing files and columns, cells that are no
    /// numbers.
    pub(super) fn survey(&mut self, section: &RecordSection) {
        if section.file.get_ref().is_empty() {
            return;
        }
        let Some(table) = self.table(section.file.get_ref(), &section.file, &section.time) else { return };
        for channel in section.channels.iter().filter(|c| c.surface.is_none()) {
            let column = channel.column.get_ref();
            // Of a field the file has one column per component.
            let is_field = table
                .csv
                .headers
                .iter()
                .any(|h| h.strip_prefix(column.as_str()).is_some_and(|r| r.starts_with('[')));
            if column.is_empty() || is_field {
                continue;
            }
            match table.csv.index(column) {
                Ok(index) => {
                    if let Err(problem) = table.csv.numbers(index) {
                        self.source.adopt(problem);
                    }
                }
                Err((message, help)) => self.source.report_with(channel.column.span(), message, help),
            }
        }
        for (_, column) in &section.inputs {
            input::signal(self, section, &table, column);
        }
    }
}

/// What the records of a study share while they are read.
pub(super) struct Context<'a> {
    /// Outputs of all channels, first seen first.
    pub(super) outputs: &'a mut Vec<String>,
    /// Outputs that are never fitted.
    pub(super) hold_out: &'a [String],
    /// What is doubtful but no error.
    pub(super) warnings: &'a mut Vec<String>,
    /// Noise that the study left to be found.
    pub(super) found_noise: Vec<FoundNoise>,
}

impl Context<'_> {
    /// Position of an output among the study's, at the end if it is new.
    fn row(&mut self, output: &str) -> usize {
        self.outputs.iter().position(|o| o == output).unwrap_or_else(|| {
            self.outputs.push(output.to_owned());
            self.outputs.len() - 1
        })
    }

    /// Whether an output, or the field that it belongs to, is never fitted.
    fn is_held_out(&self, output: &str) -> bool {
        self.hold_out.iter().any(|name| name == output || name == field_of(output))
    }
}

/// A training span that was refused and reported.
struct Refused;

/// The message of an input/output error without its number.
fn plain(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
        std::io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        std::io::ErrorKind::IsADirectory => "it is a folder".to_owned(),
        _ => error.to_string(),
    }
}
