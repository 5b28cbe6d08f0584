//! `starlings simulate`: a twin experiment, data whose truth is known.

use std::collections::BTreeSet;
use std::path::PathBuf;

use clap::Parser;
use starlings_coordinator::study::Study;
use starlings_coordinator::study::field::{component_of, components, quantity_of};
use starlings_coordinator::study::twin::{Recording, Twin, simulate};
use starlings_models::effect::library::library_in;
use starlings_models::effect::{EffectDef, library};
use starlings_models::{Spec, catalogue, meant, nearest};

use crate::console::note;
use crate::csv_file::{self, StudyLocation};
use crate::failure::Failure;
use crate::load::{self, load};

/// Run the study's model forward with chosen values and noise, and write the outputs as CSV. Noise of the model's states is drawn from
/// the same seed.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study file.
    study: PathBuf,
    /// A parameter, constant or initial:STATE value; may be repeated. The rest stands at its prior median.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    set: Vec<(String, f64)>,
    /// Amplitude of an effect of the study or of the built-in list; may be repeated.
    #[arg(long = "effect", value_name = "NAME=VALUE", value_parser = assignment)]
    effect: Vec<(String, f64)>,
    /// Standard deviation of Gaussian noise: added to every output, in the output's unit; or as `10%` of the largest
    /// amplitude, to the outputs that the study observes.
    #[arg(long, default_value = "0", value_name = "SD", value_parser = noise, allow_negative_numbers = true)]
    noise: Noise,
    /// Seed of the noise; the study's own without it.
    #[arg(long)]
    seed: Option<u64>,
    /// Record whose times and inputs are used; the first without it.
    #[arg(long)]
    record: Option<String>,
    /// End of a regular time grid from the record's start, together with --step.
    #[arg(long, requires = "step", allow_negative_numbers = true)]
    until: Option<f64>,
    /// Spacing of that grid.
    #[arg(long, requires = "until", allow_negative_numbers = true)]
    step: Option<f64>,
    /// Start from the periodic state of the record's first period of this length; inputs that end earlier than --until go
    /// on periodically.
    #[arg(long, value_name = "PERIOD", allow_negative_numbers = true)]
    periodic: Option<f64>,
    /// Where to write the state at the record's start, for `[model] initial` of another study.
    #[arg(long, value_name = "FILE")]
    state_out: Option<PathBuf>,
    /// Where to write the CSV; standard output without it.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Rows of a regular grid at most: beyond that a slip is likelier than a wish.
const MOST_ROWS: f64 = 1e8;

/// How much noise is added.
#[derive(Clone, Copy)]
enum Noise {
    /// In the unit of every output.
    Absolute(f64),
    /// As a share of the largest amplitude of an observed output.
    Share(f64),
}

/// `0.5` or `10%`.
fn noise(text: &str) -> Result<Noise, String> {
    let (number, share) = text.strip_suffix('%').map_or((text, false), |number| (number, true));
    let value: f64 =
        number.trim().parse().map_err(|_| format!("`{text}` is neither a number nor a percentage"))?;
    if !(value >= 0.0 && value.is_finite()) {
        return Err("--noise must be zero or a positive number".to_owned());
    }
    Ok(if share { Noise::Share(value / 100.0) } else { Noise::Absolute(value) })
}

/// `NAME=VALUE` with a finite value.
pub(crate) fn assignment(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let value: f64 = value.trim().parse().map_err(|_| format!("`{value}` is not a number"))?;
    if value.is_finite() {
        Ok((name.trim().to_owned(), value))
    } else {
        Err("the value must be finite".to_owned())
    }
}

/// Simulates and writes.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if args.periodic.is_some_and(|period| !(period > 0.0 && period.is_finite())) {
        return Err(Failure::input("--periodic must be a positive number"));
    }
    let study = load(&args.study)?;
    let outputs = [("-o", &args.output), ("--state-out", &args.state_out)];
    csv_file::check_outputs(&outputs, &study.text, &StudyLocation::Known(&study.file))?;
    check_names(args, &study)?;
    let record = load::record(&study, args.record.as_deref())?;
    let twin = Twin {
        record,
        values: args.set.clone(),
        effects: args.effect.clone(),
        noise: if let Noise::Absolute(sd) = args.noise { sd } else { 0.0 },
        noise_share: if let Noise::Share(share) = args.noise { share } else { 0.0 },
        seed: args.seed.unwrap_or(study.seed),
        times: grid(args, &study, record)?,
        period: args.periodic,
    };
    let recording = simulate(&study, &twin).map_err(Failure::input)?;
    if matches!(args.noise, Noise::Share(_)) {
        tell_noise(&recording, &study);
    }
    if let Some(n) = recording.n_period {
        note(format_args!("the periodic state was found in {n} periods"));
    }
    if let Some(file) = &args.state_out {
        if recording.start.is_empty() {
            let message =
                "--state-out: the model cannot restart from a state, so its state at the start is not known";
            return Err(Failure::input(message));
        }
        let heading = ["state", "value"].map(str::to_owned);
        let rows = recording.start.iter().map(|(state, value)| [state.clone(), format!("{value:?}")]);
        csv_file::write(Some(file), std::iter::once(heading).chain(rows))?;
    }
    write(&recording, args)
}

/// Says on standard error what a percentage came to: a study of these data states it.
fn tell_noise(recording: &Recording, study: &Study) {
    for (output, sd) in recording.noise.iter().filter(|(_, sd)| *sd > 0.0) {
        let unit = quantity_of(&study.spec.outputs, output).map_or("", |q| q.unit.as_str());
        note(format_args!("noise of {output}: standard deviation {sd:?} {unit}"));
    }
}

/// The regular grid that was asked for; empty takes the record's own times.
fn grid(args: &Args, study: &Study, record: usize) -> Result<Vec<f64>, Failure> {
    let (Some(until), Some(step)) = (args.until, args.step) else { return Ok(Vec::new()) };
    let start = study.records[record].start;
    if !(step > 0.0 && until > start) {
        return Err(Failure::input(format!(
            "--step must be positive and --until after the record's start at {start}"
        )));
    }
    let n = (until - start) / step + 1e-9;
    if n >= MOST_ROWS {
        return Err(Failure::input(format!(
            "--until {until} with --step {step} makes {n:.1e} rows, more than {MOST_ROWS:e}: give a larger step or an earlier end"
        )));
    }
    let n = n.floor() as usize;
    Ok((0..=n).map(|k| step.mul_add(k as f64, start)).collect())
}

/// Refuses a name that neither the model nor an effect of the twin has.
fn check_names(args: &Args, study: &Study) -> Result<(), Failure> {
    let built_in = library_in(&study.spec, &study.time_unit);
    let asked = |e: &&EffectDef| args.effect.iter().any(|(name, _)| *name == e.name);
    let effects = study.candidates.iter().chain(&built_in).filter(asked);
    let mut names: Vec<String> = study.setup.parameters.clone();
    names.extend(study.spec.parameters.iter().map(|q| q.name.clone()));
    names.extend(study.setup.model.constants.keys().cloned());
    names.extend(effects.flat_map(|e| e.parameters.iter().map(|p| p.name.clone())));
    names.extend(components(&study.spec.states).iter().map(|state| format!("initial:{state}")));
    let mut seen = BTreeSet::new();
    names.retain(|name| seen.insert(name.clone()));
    for (name, _) in &args.set {
        if !names.contains(name) {
            let hint = meant(nearest(name, &names));
            let names = listed(&names).join(", ");
            return Err(Failure::input(format!(
                "--set {name}: the study has no parameter, constant or initial value of that name{hint} (it has: {names})"
            )));
        }
    }
    args.effect.iter().try_for_each(|(name, _)| check_host(name, study, &built_in))
}

/// The names with every field once, as `initial:wall[0..79]`.
fn listed(names: &[String]) -> Vec<String> {
    let mut fields: Vec<(&str, Option<(usize, usize)>)> = Vec::new();
    for name in names {
        let Some((field, i)) = component_of(name) else {
            fields.push((name, None));
            continue;
        };
        match fields.iter_mut().find(|(known, _)| *known == field) {
            Some((_, Some((start, end)))) => (*start, *end) = (i.min(*start), i.max(*end)),
            _ => fields.push((field, Some((i, i)))),
        }
    }
    let text = |(field, span): (&str, Option<(usize, usize)>)| match span {
        None => field.to_owned(),
        Some((start, end)) if start == end => format!("{field}[{start}]"),
        Some((start, end)) => format!("{field}[{start}..{end}]"),
    };
    fields.into_iter().map(text).collect()
}

/// Refuses an effect that exists, but not for this model.
fn check_host(name: &str, study: &Study, built_in: &[EffectDef]) -> Result<(), Failure> {
    let mut known = study.setup.effects.iter().chain(study.candidates.iter()).chain(built_in);
    if known.any(|e| e.name == name) {
        return Ok(());
    }
    let hosts = |spec: &Spec| library(spec).iter().any(|e| e.name == name);
    let kinds: Vec<String> = catalogue::specs().into_iter().filter(hosts).map(|spec| spec.kind).collect();
    if kinds.is_empty() {
        return Ok(());
    }
    let (model, kinds) = (&study.setup.model.kind, kinds.join(", "));
    Err(Failure::input(format!(
        "--effect {name}: the model `{model}` cannot host this effect, it lacks the quantities that the effect joins (models \
         that can: {kinds})"
    )))
}

fn write(recording: &Recording, args: &Args) -> Result<(), Failure> {
    let heading = std::iter::once("time".to_owned()).chain(recording.columns.iter().cloned()).collect();
    let rows = recording.times.iter().enumerate().map(|(k, time)| {
        let row = std::iter::once(*time).chain(recording.values.iter().map(|column| column[k]));
        row.map(|v| format!("{v:?}")).collect::<Vec<_>>()
    });
    csv_file::write(args.output.as_deref(), std::iter::once(heading).chain(rows))
}
