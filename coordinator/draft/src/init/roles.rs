//! Which column is what: an input or an output of the model, by name, by unit, or as it is said.
//!
//! Next file to read: [`super::text`].

use starlings_models::units::Unit;
use starlings_models::{Quantity, Spec};

use super::recording::{Column, Recording, component_of};
use super::{Ask, Question, Wishes};

/// Columns by their headings, with names of the model.
#[derive(Debug, Default)]
pub(super) struct Roles {
    /// What drives the model: place of the column, name of the input.
    pub(super) inputs: Vec<(usize, String)>,
    /// What was measured: heading without a component's index, name of the output, place of its first column.
    pub(super) outputs: Vec<(String, String, usize)>,
    /// One sentence each.
    pub(super) notes: Vec<String>,
}

/// Finds the roles of the columns.
///
/// # Errors
/// When one is not known, with the option that says it.
pub(super) fn roles(
    spec: Option<&Spec>,
    recording: &Recording,
    wishes: &Wishes,
    ask: Ask<'_>,
) -> Result<Roles, String> {
    if recording.columns.is_empty() {
        return Err(format!("{} has no column of numbers beside the time", recording.file.display()));
    }
    let place = |wanted: &str| {
        let found = recording.columns.iter().position(|c| c.heading == wanted || c.name == wanted);
        let names: Vec<&str> = recording.columns.iter().map(|c| c.heading.as_str()).collect();
        found.ok_or_else(|| format!("there is no column `{wanted}` (columns: {})", names.join(", ")))
    };
    let said = |list: &[(String, Option<String>)]| -> Result<Vec<(usize, Option<String>)>, String> {
        list.iter().map(|(column, name)| Ok((place(column)?, name.clone()))).collect()
    };
    let (inputs, outputs) = (said(&wishes.inputs)?, said(&wishes.outputs)?);
    match spec {
        None => super::equations::roles(recording, &inputs, &outputs, ask, &place),
        Some(spec) => {
            let mut search = Search { spec, recording, roles: Roles::default() };
            search.said(&inputs, &outputs)?;
            search.by_name();
            search.by_unit();
            search.asked(ask, &place)?;
            search.leftovers();
            Ok(search.roles)
        }
    }
}

struct Search<'a> {
    spec: &'a Spec,
    recording: &'a Recording,
    roles: Roles,
}

impl Search<'_> {
    fn columns(&self) -> &[Column] {
        &self.recording.columns
    }

    fn is_free(&self, at: usize) -> bool {
        let heading = &self.columns()[at].heading;
        let base = component_of(heading).unwrap_or(heading);
        !self.roles.inputs.iter().any(|(column, _)| *column == at)
            && !self.roles.outputs.iter().any(|(column, ..)| column == base || column == heading)
    }

    fn needs(&self) -> Vec<&Quantity> {
        self.spec
            .inputs
            .iter()
            .filter(|input| !self.roles.inputs.iter().any(|(_, name)| *name == input.name))
            .collect()
    }

    fn has_output(&self, name: &str) -> bool {
        self.roles.outputs.iter().any(|(_, output, _)| output == name)
    }

    fn take_output(&mut self, at: usize, name: &str) {
        let heading = &self.columns()[at].heading;
        // `wall[3]` of a study's own field brings all its components.
        let base = if name.contains('[') { heading } else { component_of(heading).unwrap_or(heading) };
        let row = (base.to_owned(), name.to_owned(), at);
        self.roles.outputs.push(row);
    }

    /// What the user says.
    fn said(
        &mut self,
        inputs: &[(usize, Option<String>)],
        outputs: &[(usize, Option<String>)],
    ) -> Result<(), String> {
        for (list, given, what) in
            [(&self.spec.inputs, inputs, "input"), (&self.spec.outputs, outputs, "output")]
        {
            for (at, name) in given {
                let column = &self.recording.columns[*at];
                let name = name.as_deref().unwrap_or(&column.name);
                let known = list.iter().any(|q| q.name == name || component_of(name) == Some(&q.name));
                if !known {
                    let names: Vec<&str> = list.iter().map(|q| q.name.as_str()).collect();
                    return Err(format!(
                        "the model has no {what} `{name}` (it has: {}): write --{what} '{}=NAME'",
                        if names.is_empty() { "none".to_owned() } else { names.join(", ") },
                        column.heading
                    ));
                }
            }
        }
        for (at, name) in inputs {
            let name = name.clone().unwrap_or_else(|| self.columns()[*at].name.clone());
            self.roles.inputs.push((*at, name));
        }
        for (at, name) in outputs {
            let name = name.clone().unwrap_or_else(|| self.columns()[*at].name.clone());
            self.take_output(*at, &name);
        }
        Ok(())
    }

    /// Equal names, but for case and signs.
    fn by_name(&mut self) {
        let named = |column: &Column, quantity: &Quantity| {
            let bare = |text: &str| -> String {
                text.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_lowercase()
            };
            match component_of(&column.heading) {
                Some(field) => quantity.size > 1 && field == quantity.name,
                None => bare(&column.name) == bare(&quantity.name) && quantity.size == 1,
            }
        };
        for at in 0..self.columns().len() {
            if !self.is_free(at) {
                continue;
            }
            let column = &self.recording.columns[at];
            let input = self.needs().into_iter().find(|q| named(column, q)).map(|q| q.name.clone());
            let output = self.spec.outputs.iter().find(|q| named(column, q) && !self.has_output(&q.name));
            match (input, output.map(|q| q.name.clone())) {
                (Some(name), _) => self.roles.inputs.push((at, name)),
                (None, Some(name)) => self.take_output(at, &name),
                (None, None) => {}
            }
        }
    }

    /// Units of one dimension, where only one column and only one quantity have it.
    fn by_unit(&mut self) {
        let alike = |column: &Column, quantity: &Quantity| {
            let units = Unit::parse(&column.unit).zip(Unit::parse(&quantity.unit));
            units.is_some_and(|(a, b)| a.same_dimension(&b)) && quantity.size == 1
        };
        let free: Vec<usize> = (0..self.columns().len()).filter(|at| self.is_free(*at)).collect();
        let inputs: Vec<&Quantity> = self.needs();
        let outputs: Vec<&Quantity> =
            self.spec.outputs.iter().filter(|q| !self.has_output(&q.name)).collect();
        let only_one = |list: &[&Quantity], at: usize| {
            let column = &self.recording.columns[at];
            let mut found = list.iter().filter(|q| alike(column, q));
            let first = found.next().filter(|_| found.next().is_none())?;
            let columns = free.iter().filter(|other| alike(&self.recording.columns[**other], first)).count();
            (columns == 1).then(|| first.name.clone())
        };
        let taken: Vec<(usize, Option<String>, Option<String>)> =
            free.iter().map(|at| (*at, only_one(&inputs, *at), only_one(&outputs, *at))).collect();
        let wants_output = self.roles.outputs.is_empty();
        for (at, input, output) in taken {
            match (input, output.filter(|_| wants_output)) {
                (Some(name), None) => self.roles.inputs.push((at, name)),
                (None, Some(name)) => self.take_output(at, &name),
                // Both would fit: that is for the user to say.
                _ => {}
            }
        }
    }

    /// What is still needed: a column per input, and one output.
    fn asked(&mut self, ask: Ask<'_>, place: &dyn Fn(&str) -> Result<usize, String>) -> Result<(), String> {
        let needs: Vec<Quantity> = self.needs().into_iter().cloned().collect();
        for input in needs {
            let (free, names) = self.free();
            // With an output found, a single column that is left can be nothing else.
            let only = (!self.roles.outputs.is_empty() && free.len() == 1 && self.needs().len() == 1)
                .then(|| free[0]);
            let at = if let Some(at) = only {
                at
            } else {
                let question = Question {
                    text: format!("Which column is the input `{}` of the model{}?", input.name, unit(&input)),
                    choices: names,
                    default: None,
                    option: format!("--input COLUMN={}", input.name),
                };
                let why = format!("no column is plainly the input `{}` of the model", input.name);
                place(&ask(&question).ok_or_else(|| question.unanswered(&why))?)?
            };
            self.roles.inputs.push((at, input.name));
        }
        if !self.roles.outputs.is_empty() {
            return Ok(());
        }
        let (free, names) = self.free();
        let outputs: Vec<String> = self.spec.outputs.iter().map(|q| q.name.clone()).collect();
        if let ([at], [output]) = (&free[..], &self.spec.outputs[..]) {
            self.take_output(*at, &output.name);
            return Ok(());
        }
        let question = Question {
            text: format!(
                "What was measured? COLUMN=OUTPUT, of the columns {} and the outputs {}",
                names.join(", "),
                outputs.join(", ")
            ),
            choices: Vec::new(),
            default: None,
            option: "--output COLUMN=NAME".to_owned(),
        };
        let why = format!(
            "no column ({}) is plainly an output of the model ({})",
            names.join(", "),
            outputs.join(", ")
        );
        let answer = ask(&question).ok_or_else(|| question.unanswered(&why))?;
        let (column, output) =
            answer.split_once('=').unwrap_or((&answer, outputs.first().map_or("", String::as_str)));
        self.said(&[], &[(place(column.trim())?, Some(output.trim().to_owned()))])
    }

    fn free(&self) -> (Vec<usize>, Vec<String>) {
        let free: Vec<usize> = (0..self.columns().len()).filter(|at| self.is_free(*at)).collect();
        let names = free.iter().map(|at| self.columns()[*at].heading.clone()).collect();
        (free, names)
    }

    fn leftovers(&mut self) {
        let (_, names) = self.free();
        if !names.is_empty() {
            self.roles
                .notes
                .push(format!("not used: {}; --output COLUMN=NAME takes a column in", names.join(", ")));
        }
    }
}

fn unit(quantity: &Quantity) -> String {
    if quantity.unit.is_empty() { String::new() } else { format!(" ({})", quantity.unit) }
}
