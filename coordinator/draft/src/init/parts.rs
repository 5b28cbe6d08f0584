//! The parts of a study before it is text: unknowns, constants, records.
//!
//! Next files to read: [`super::unknowns`], then [`super::text`].

use starlings_models::Quantity;

use super::model::{Model, stem};
use super::predicted::{Prediction, channels_of, unit_course};
use super::prior::Prior;
use super::recording::Recording;
use super::roles::Roles;
use super::unknowns::{initial_values, unknowns};
use super::{Ask, Question, Wishes, equations};
use crate::files::part_of_range;
use crate::names::Names;

/// Noise of a channel as a part of its range, where data do not tell.
pub(super) const NOISE: f64 = 0.02;
/// Rows from which on the last fifth is held out.
const HOLD_OUT_FROM: usize = 20;

/// A study.
#[derive(Debug)]
pub(super) struct Parts {
    pub(super) name: String,
    pub(super) time_unit: String,
    pub(super) model: Model,
    /// Equations that are written for the columns.
    pub(super) equations: Option<String>,
    pub(super) unknown: Vec<Unknown>,
    /// Parameters that are not estimated, with the value that they keep.
    pub(super) fixed: Vec<Quantity>,
    pub(super) records: Vec<Part>,
    /// Whether whole records are fitted.
    pub(super) batch: bool,
    pub(super) notes: Vec<String>,
}

/// A parameter with a prior.
#[derive(Debug)]
pub(super) struct Unknown {
    pub(super) name: String,
    pub(super) unit: String,
    pub(super) says: String,
    pub(super) prior: Prior,
}

/// A record and where its numbers come from.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) name: String,
    /// Name of the file in the study's folder.
    pub(super) file: String,
    pub(super) time: String,
    /// Input and column, or `FILE:COLUMN`.
    pub(super) inputs: Vec<(String, String)>,
    pub(super) channels: Vec<ChannelPart>,
    pub(super) train: Option<[f64; 2]>,
    pub(super) numbers: Numbers,
}

/// A channel.
#[derive(Debug)]
pub(super) struct ChannelPart {
    pub(super) column: String,
    pub(super) output: String,
    pub(super) unit: String,
    /// As the user says it.
    pub(super) noise: Option<f64>,
    /// A part of the range.
    pub(super) share: f64,
}

/// The numbers of a record.
#[derive(Debug)]
pub(super) enum Numbers {
    /// As they were measured; the columns that are inputs must be complete.
    Measured(Recording, Vec<String>),
    /// As the model predicts them.
    Predicted(Prediction),
}

impl Parts {
    /// A study of recordings.
    pub(super) fn measured(
        wishes: &Wishes,
        model: Model,
        recordings: Vec<Recording>,
        roles: &Roles,
        ask: Ask<'_>,
    ) -> Result<Self, String> {
        let first = &recordings[0];
        let mut notes = roles.notes.clone();
        let name = stem(&first.file);
        let time_unit = time_unit(wishes, first, ask, &mut notes);
        let noise = noise(wishes, first, roles, ask)?;
        let (unknown, fixed, written) = if let Some(spec) = &model.spec {
            let (mut unknown, fixed) = unknowns(spec, &model.constants, wishes, Some(first))?;
            unknown.extend(initial_values(spec, first, roles));
            (unknown, fixed, None)
        } else {
            let (unknown, text) = equations::response(first, roles, &time_unit);
            (unknown, Vec::new(), Some(text))
        };
        let named = roles.inputs.iter().map(|(at, name)| (name.clone(), first.columns[*at].name.clone()));
        let named: Vec<(String, String)> = named.collect();
        let mut names = Names::default();
        let mut records = Vec::new();
        for recording in recordings {
            for note in &recording.notes {
                notes.push(format!("{}: {note}", recording.file.display()));
            }
            let file = names.take(&stem(&recording.file));
            records.push(measured_part(recording, &file, &named, roles, &recordings_noise(&noise))?);
        }
        let batch = model.spec.as_ref().is_some_and(|spec| !spec.restart);
        Ok(Self { name, time_unit, model, equations: written, unknown, fixed, records, batch, notes })
    }

    /// A study of a model alone, with its predictions in the place of a recording.
    pub(super) fn predicted(wishes: &Wishes, model: Model) -> Result<Self, String> {
        let Some(spec) = &model.spec else {
            return Err("`equations` are written for the columns of a recording: give one".to_owned());
        };
        let (unknown, fixed) = unknowns(spec, &model.constants, wishes, None)?;
        let times = if wishes.times.is_empty() {
            (0..=100).map(|k| 0.01 * f64::from(k)).collect()
        } else {
            wishes.times.clone()
        };
        let inputs: Vec<(String, Vec<f64>)> =
            spec.inputs.iter().map(|input| (input.name.clone(), unit_course(input, &times))).collect();
        let part = Part {
            name: "predicted".to_owned(),
            file: "predicted.csv".to_owned(),
            time: "time".to_owned(),
            inputs: inputs.iter().map(|(name, _)| (name.clone(), format!("inputs.csv:{name}"))).collect(),
            channels: channels_of(spec),
            train: None,
            numbers: Numbers::Predicted(Prediction { times, inputs }),
        };
        let notes = vec![
            "predictions of the model stand for a recording, and made-up courses for its inputs".to_owned(),
        ];
        Ok(Self {
            name: model.name.clone(),
            time_unit: wishes.time_unit.clone().unwrap_or_else(|| "s".to_owned()),
            batch: !spec.restart,
            model,
            equations: None,
            unknown,
            fixed,
            records: vec![part],
            notes,
        })
    }
}

/// Noise by name of a column.
type Noise = Vec<(String, Option<f64>)>;

fn recordings_noise(noise: &Noise) -> impl Fn(&str) -> Option<f64> + '_ {
    |name| noise.iter().find(|(column, _)| column == name).and_then(|(_, sd)| *sd)
}

fn measured_part(
    recording: Recording,
    file: &str,
    named: &[(String, String)],
    roles: &Roles,
    noise: &dyn Fn(&str) -> Option<f64>,
) -> Result<Part, String> {
    let find = |wanted: &str| {
        let found = recording.columns.iter().find(|c| c.heading == wanted || c.name == wanted);
        let field =
            || recording.columns.iter().find(|c| super::recording::component_of(&c.heading) == Some(wanted));
        found.or_else(field).ok_or_else(|| {
            format!("{} has no column `{wanted}`, which the first file has", recording.file.display())
        })
    };
    let mut inputs = Vec::new();
    let mut complete = Vec::new();
    for (input, name) in named {
        let column = find(name)?;
        inputs.push((input.clone(), column.heading.clone()));
        complete.push(column.heading.clone());
    }
    let mut channels = Vec::new();
    for (heading, output, _) in &roles.outputs {
        let column = find(heading)?;
        let field = super::recording::component_of(&column.heading).filter(|field| field == heading);
        channels.push(ChannelPart {
            column: field.unwrap_or(&column.heading).to_owned(),
            output: output.clone(),
            unit: column.unit.clone(),
            noise: noise(&column.name),
            share: part_of_range(&column.values, NOISE),
        });
    }
    let times = &recording.times;
    let train = (times.len() >= HOLD_OUT_FROM).then(|| [times[0], times[4 * times.len() / 5]]);
    Ok(Part {
        name: file.to_owned(),
        file: format!("{file}.csv"),
        time: recording.time.clone(),
        inputs,
        channels,
        train,
        numbers: Numbers::Measured(recording, complete),
    })
}

/// The unit of the times: as it is said, as the file says it, or seconds.
fn time_unit(wishes: &Wishes, first: &Recording, ask: Ask<'_>, notes: &mut Vec<String>) -> String {
    if let Some(unit) = wishes.time_unit.clone().or_else(|| first.time_unit.clone()) {
        return unit;
    }
    let question = Question {
        text: "What is the unit of the times?".to_owned(),
        choices: Vec::new(),
        default: Some("s".to_owned()),
        option: "--time-unit UNIT".to_owned(),
    };
    ask(&question).unwrap_or_else(|| {
        notes
            .push("the file does not say the unit of its times: seconds were taken (--time-unit)".to_owned());
        "s".to_owned()
    })
}

/// The noise of every channel, where it is known.
fn noise(wishes: &Wishes, first: &Recording, roles: &Roles, ask: Ask<'_>) -> Result<Noise, String> {
    let column = |wanted: &str| first.columns.iter().find(|c| c.heading == wanted || c.name == wanted);
    if let Some((other, _)) = wishes.noise.iter().find(|(name, _)| column(name).is_none()) {
        return Err(format!("--noise names the column `{other}`, which is not there"));
    }
    let mut noise = Noise::new();
    for (_, _, at) in &roles.outputs {
        let channel = &first.columns[*at];
        let said = wishes.noise.iter().find(|(name, _)| *name == channel.heading || *name == channel.name);
        let sd = if let Some((_, sd)) = said {
            Some(*sd)
        } else {
            let unit = if channel.unit.is_empty() { String::new() } else { format!(" in {}", channel.unit) };
            let question = Question {
                text: format!("What is the standard deviation of the errors of `{}`{unit}?", channel.heading),
                choices: Vec::new(),
                default: Some("auto".to_owned()),
                option: format!("--noise {}=SD", channel.name),
            };
            ask(&question).and_then(|answer| answer.trim().parse().ok())
        };
        if sd.is_some_and(|sd: f64| !(sd > 0.0 && sd.is_finite())) {
            return Err(format!("the noise of `{}` must be above zero", channel.heading));
        }
        noise.push((channel.name.clone(), sd));
    }
    Ok(noise)
}
