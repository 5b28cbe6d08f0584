//! Equations for a recording of which no model is known: every output follows its inputs with a time of its own.
//!
//! It is a first-order lag, `dy/dt = (level + Σ gain·u − y)/tau`: the least that can be fitted to any course, for the user to replace.
//! Next file to read: [`super::text`].

use std::fmt::Write;

use starlings_models::quoted_list;

use super::parts::{NOISE, Unknown};
use super::prior::Prior;
use super::recording::{Column, Recording};
use super::roles::Roles;
use super::{Ask, Question};
use crate::files::{part_of_range, quoted, rounded};

/// Outputs at most where nobody chose them: each is two parameters.
const MOST_OUTPUTS: usize = 6;

/// Values at most of a column that switches, and rows at least that it stays at one, on average.
const FEW: usize = 3;
const STAYS: usize = 4;

/// The roles of columns for which equations are written: what is no input is an output.
pub(super) fn roles(
    recording: &Recording,
    inputs: &[(usize, Option<String>)],
    outputs: &[(usize, Option<String>)],
    ask: Ask<'_>,
    place: &dyn Fn(&str) -> Result<usize, String>,
) -> Result<Roles, String> {
    let columns = &recording.columns;
    let mut driving: Vec<usize> = inputs.iter().map(|(at, _)| *at).collect();
    let mut roles = Roles::default();
    if inputs.is_empty() && outputs.is_empty() && columns.len() > 1 {
        let question = Question {
            text: "Which columns drive the system and are not predicted (several with commas between them)?"
                .to_owned(),
            choices: Vec::new(),
            default: Some("none".to_owned()),
            option: "--input COLUMN".to_owned(),
        };
        let answer = ask(&question).unwrap_or_else(|| {
            roles.notes.push(unasked(columns));
            String::new()
        });
        let named = answer.split(',').map(str::trim).filter(|name| !name.is_empty() && *name != "none");
        driving = named.map(place).collect::<Result<_, _>>()?;
    }
    let varies = |column: &Column| {
        let mut finite = column.values.iter().filter(|v| v.is_finite());
        let first = finite.next();
        finite.any(|v| Some(v) != first)
    };
    let rest = (0..columns.len()).filter(|at| !driving.contains(at));
    let mut measured: Vec<usize> = if outputs.is_empty() {
        rest.filter(|at| varies(&columns[*at])).collect()
    } else {
        outputs.iter().map(|(at, _)| *at).collect()
    };
    if outputs.is_empty() && measured.len() > MOST_OUTPUTS {
        let left: Vec<&str> =
            measured.split_off(MOST_OUTPUTS).into_iter().map(|at| columns[at].heading.as_str()).collect();
        roles.notes.push(format!(
            "only the first {MOST_OUTPUTS} columns are in the study, without {}: choose by --output",
            left.join(", ")
        ));
    }
    if measured.is_empty() {
        return Err("no column is left that could be predicted: name one by --output COLUMN".to_owned());
    }
    roles.inputs = driving.iter().map(|at| (*at, columns[*at].name.clone())).collect();
    roles.outputs =
        measured.iter().map(|at| (columns[*at].heading.clone(), columns[*at].name.clone(), *at)).collect();
    Ok(roles)
}

/// That nobody said which columns drive the system, with those that look as if they did.
fn unasked(columns: &[Column]) -> String {
    let switching: Vec<&Column> = columns.iter().filter(|column| switches(&column.values)).collect();
    if switching.is_empty() || switching.len() == columns.len() {
        return "every column was taken for an output; --input COLUMN names what drives the system"
            .to_owned();
    }
    let names = quoted_list(switching.iter().map(|column| &column.heading));
    let options: Vec<String> = switching.iter().map(|column| format!("--input {}", column.name)).collect();
    let (switches, it) = if switching.len() == 1 { ("switches", "it does") } else { ("switch", "they do") };
    format!(
        "{names} {switches} between a few values, as what drives a system does, and every column was taken for an output: \
         if {it} drive it, write {}",
        options.join(" ")
    )
}

/// Whether a column stays at one of a few values and jumps to another.
fn switches(values: &[f64]) -> bool {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let mut levels = finite.clone();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let changes = finite.windows(2).filter(|pair| pair[0].to_bits() != pair[1].to_bits()).count();
    (2..=FEW).contains(&levels.len()) && STAYS * changes <= finite.len()
}

/// Unknowns and lines of `[model]`.
pub(super) fn response(recording: &Recording, roles: &Roles, time_unit: &str) -> (Vec<Unknown>, String) {
    let span = recording.times[recording.times.len() - 1] - recording.times[0];
    let (mut unknown, mut text) = (Vec::new(), String::new());
    // Writing to a text cannot fail.
    let _ = outputs(&mut text, recording, roles);
    for (_, name, at) in &roles.outputs {
        let column = &recording.columns[*at];
        let (unit, range) = (column.unit.as_str(), part_of_range(&column.values, 1.0));
        let mean = mean(&column.values);
        let mut rate = format!("level_{name}");
        let linear = |name: String, unit: String, says: String, median: f64, sd: f64| Unknown {
            name,
            unit,
            says,
            prior: Prior {
                table: format!("{{ transform = \"linear\", median = {median:?}, sd = {sd:?} }}"),
                from: "the recording",
            },
        };
        unknown.push(linear(
            format!("level_{name}"),
            unit.to_owned(),
            format!("where {name} goes without inputs"),
            rounded(mean),
            range,
        ));
        for (input, signal) in &roles.inputs {
            let driving = &recording.columns[*input];
            let gain = rounded(range / part_of_range(&driving.values, 1.0));
            let _ = write!(rate, " + gain_{name}_{signal}*{signal}");
            let says = format!("what {name} gains per {signal}");
            unknown.push(linear(
                format!("gain_{name}_{signal}"),
                ratio(unit, &driving.unit),
                says,
                0.0,
                gain,
            ));
        }
        unknown.push(Unknown {
            name: format!("tau_{name}"),
            unit: time_unit.to_owned(),
            says: format!("the time in which {name} follows"),
            prior: Prior {
                table: format!(
                    "{{ transform = \"log\", median = {:?}, factor = 3.0 }}",
                    rounded(span / 10.0)
                ),
                from: "a tenth of the recording",
            },
        });
        unknown.push(start(name, unit, column.values.iter().copied()));
        let _ = write!(
            text,
            "\n[[model.states]]\nname = {}\nunit = {}\nrate = \"({rate} - {name})/tau_{name}\"\n",
            quoted(name),
            quoted(unit)
        );
    }
    (unknown, text)
}

fn outputs(text: &mut String, recording: &Recording, roles: &Roles) -> std::fmt::Result {
    let quantity = |at: usize, name: &str, value: &str| {
        let unit = quoted(&recording.columns[at].unit);
        format!("{{ name = {}, unit = {unit}{value} }}", quoted(name))
    };
    let outputs =
        roles.outputs.iter().map(|(_, name, at)| quantity(*at, name, &format!(", value = {}", quoted(name))));
    writeln!(text, "outputs = [{}]", outputs.collect::<Vec<_>>().join(", "))?;
    if !roles.inputs.is_empty() {
        let inputs = roles.inputs.iter().map(|(at, name)| quantity(*at, name, ""));
        writeln!(text, "inputs = [{}]", inputs.collect::<Vec<_>>().join(", "))?;
    }
    Ok(())
}

fn start(name: &str, unit: &str, values: impl Iterator<Item = f64>) -> Unknown {
    let values: Vec<f64> = values.collect();
    Unknown {
        name: format!("initial:{name}"),
        unit: unit.to_owned(),
        says: "the state at the start".to_owned(),
        prior: Prior {
            table: format!(
                "{{ transform = \"linear\", median_from = {}, sd = {:?} }}",
                quoted(name),
                part_of_range(&values, 5.0 * NOISE)
            ),
            from: "the first value that was measured",
        },
    }
}

fn mean(values: &[f64]) -> f64 {
    let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    finite.iter().sum::<f64>() / finite.len().max(1) as f64
}

/// The label of a quotient; none where one of the two is unknown.
fn ratio(above: &str, below: &str) -> String {
    if above.is_empty() || below.is_empty() { String::new() } else { format!("({above})/({below})") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stays_at_one_of_a_few_values_and_jumps_switches() {
        let of = |value: fn(usize) -> f64| switches(&(0..40).map(value).collect::<Vec<_>>());
        assert!(of(|k| if k / 8 % 2 == 0 { 5.0 } else { 0.0 }));
        assert!(!of(|k| k as f64) && !of(|_| 5.0));
        // A sensor that counts coarsely scatters between its counts.
        assert!(!of(|k| if k % 3 == 0 { 20.5 } else { 20.0 }));
    }

    #[test]
    fn only_what_looks_like_an_input_beside_an_output_is_named() {
        let column = |name: &str, value: fn(usize) -> f64| Column {
            heading: name.to_owned(),
            name: name.to_owned(),
            unit: String::new(),
            values: (0..40).map(value).collect(),
        };
        let jumps = |k: usize| if k < 20 { 1.0 } else { 2.0 };
        let (fan, heater) = (column("fan", jumps), column("heater", jumps));
        let air = column("air", |k| (k * k) as f64);
        let all = "every column was taken for an output; --input COLUMN names what drives the system";
        assert_eq!(unasked(&[air.clone(), air.clone()]), all);
        assert_eq!(unasked(&[fan.clone(), heater.clone()]), all);
        let both = unasked(&[fan, air, heater]);
        assert!(both.starts_with("`fan`, `heater` switch between"), "{both}");
        assert!(both.ends_with("if they do drive it, write --input fan --input heater"), "{both}");
    }
}
