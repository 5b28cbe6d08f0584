//! Contradictions between the unit labels of a study: each is a warning, none a refusal.
//!
//! Numbers are taken as they stand. A built-in model holds in every consistent system of units, so there only labels that fit
//! no common system are reported; equations hold in the units that the study writes them in. The column of an input has no unit
//! label. Next file to read: [`starlings_models::units`].

use starlings_models::units::{Labels, Unit, consistent};

use super::built::{CheckedModel, quantity};
use crate::checked::Record;
use crate::field::quantity_of;
use crate::file::StudyFile;

/// Time unit of the built-in models.
const MODEL_TIME: &str = "s";

/// Every warning about units.
pub(crate) fn warnings(file: &StudyFile, model: &CheckedModel, records: &[Record]) -> Vec<String> {
    // A solver may use any units: nothing converts them.
    let exact = model.setup.model.equations.is_some() || model.setup.model.solver.is_some();
    let pairs = pairs(file, model, records);
    let mut list: Vec<String> = pairs.iter().filter(|p| p.differs(exact)).map(Pair::sentence).collect();
    if !exact {
        list.extend(mixed_systems(&pairs, &file.study.time_unit));
    }
    list.extend(corrections(file, model));
    let mut labels = Labels::new(&model.spec, &file.study.time_unit, exact);
    for parameter in &file.parameters {
        if let Some(unit) = &parameter.unit {
            labels.refine(parameter.name.get_ref(), unit.get_ref());
        }
    }
    let mut mismatches: Vec<_> =
        model.setup.model.equations.iter().flat_map(|equations| labels.equations(equations)).collect();
    let effects = model.setup.effects.iter().chain(&model.candidates);
    mismatches.extend(effects.flat_map(|effect| labels.effect(effect, &model.spec)));
    list.extend(mismatches.iter().map(|m| format!("units: {m}; its numbers are taken as they stand.")));
    list
}

/// Outputs whose innovation `corrects` adds to a state in another unit. The model's own labels are compared: contradictions
/// with the study's labels have warnings of their own. It is a warning, since an output may show a state in another unit; the
/// observer then corrects by another share than its gain states, and a wrong state in `corrects` looks the same.
fn corrections(file: &StudyFile, model: &CheckedModel) -> Vec<String> {
    let warn = |(output, state): &(toml::Spanned<String>, toml::Spanned<String>)| {
        let (output, state) = (output.get_ref(), state.get_ref());
        let shown = quantity_of(&model.spec.outputs, output)?;
        let corrected = quantity_of(&model.spec.states, state)?;
        let (a, b) = Unit::parse(&shown.unit).zip(Unit::parse(&corrected.unit))?;
        let (unit, other) = (&shown.unit, &corrected.unit);
        (!a.same(&b)).then(|| {
            format!(
                "`corrects`: output `{output}` is in {unit}, state `{state}` in {other}: its innovations are added to the state \
                 as they stand; name the state that the output shows, or an output in {other}."
            )
        })
    };
    file.observer.all().flat_map(|o| &o.corrects).filter_map(warn).collect()
}

/// A label beside the model's for the same quantity.
struct Pair {
    /// Such as ``parameter `R` ``.
    what: String,
    label: String,
    model: String,
    /// Whether the study gives the label; else the model's stands for it.
    given: bool,
    /// Both as units, where both can be read.
    units: Option<(Unit, Unit)>,
}

impl Pair {
    fn new(what: String, label: &str, model: &str) -> Self {
        let given = !label.is_empty();
        let label = if given { label } else { model };
        let units = Unit::parse(label).zip(Unit::parse(model));
        Self { what, label: label.to_owned(), model: model.to_owned(), given, units }
    }

    /// Whether the labels are of different dimensions, or, for `exact` models, at all different.
    fn differs(&self, exact: bool) -> bool {
        self.units.is_some_and(|(a, b)| if exact { !a.same(&b) } else { !a.same_dimension(&b) })
    }

    /// Whether the label means the model's unit, perhaps in another spelling.
    fn is_the_models(&self) -> bool {
        self.units.is_none_or(|(a, b)| a.same(&b))
    }

    fn sentence(&self) -> String {
        let Self { what, label, model, .. } = self;
        format!(
            "{what} is given in {label}, the model has it in {model}: its numbers are taken as they stand."
        )
    }
}

fn pairs(file: &StudyFile, model: &CheckedModel, records: &[Record]) -> Vec<Pair> {
    let parameter = |section: &crate::file::ParameterSection| {
        let name = section.name.get_ref();
        let label = section.unit.as_ref().map_or("", |unit| unit.get_ref());
        Some(Pair::new(format!("parameter `{name}`"), label, &quantity(&model.spec, name)?.unit))
    };
    let mut pairs: Vec<Pair> = file.parameters.iter().filter_map(parameter).collect();
    for channel in records.iter().flat_map(|record| &record.channels) {
        let output = quantity_of(&model.spec.outputs, &channel.output);
        let what = format!("output `{}`", output.map_or(&channel.output, |q| &q.name));
        let pair = Pair::new(what, channel.unit.as_deref().unwrap_or(""), output.map_or("", |q| &q.unit));
        if !pairs.iter().any(|p| p.what == pair.what && p.label == pair.label) {
            pairs.push(pair);
        }
    }
    pairs
}

/// The label without which the others form one system of units.
fn mixed_systems(pairs: &[Pair], time: &str) -> Option<String> {
    let time = Pair::new("time".to_owned(), time, MODEL_TIME);
    let comparable = |p: &&Pair| p.units.is_some_and(|(a, b)| a.same_dimension(&b));
    let list: Vec<&Pair> = pairs.iter().chain([&time]).filter(comparable).collect();
    let without = |i: usize| -> Vec<(Unit, Unit)> {
        list.iter().enumerate().filter(|(j, _)| *j != i).filter_map(|(_, p)| p.units).collect()
    };
    if consistent(&without(list.len())) {
        return None;
    }
    let n_other = list.iter().filter(|p| !p.is_the_models()).count();
    let minority_is_the_models = 2 * n_other > list.len();
    let suspects: Vec<usize> = (0..list.len()).filter(|&i| consistent(&without(i))).collect();
    let odd =
        suspects.iter().find(|&&i| list[i].is_the_models() == minority_is_the_models).or(suspects.first());
    let rest: Vec<String> = (0..list.len())
        .filter(|i| Some(i) != odd)
        .map(|i| format!("{} in {}", list[i].what, list[i].label))
        .collect();
    let rest = rest.join(", ");
    Some(match odd.map(|&i| list[i]) {
        None => format!(
            "the units of the study belong to no one system ({rest}): its numbers are taken as they stand."
        ),
        Some(Pair { what, label, given: true, .. }) => format!(
            "{what} is given in {label}, which no one system of units joins with the others ({rest}): its numbers are \
             taken as they stand."
        ),
        Some(Pair { what, label, .. }) => format!(
            "{what} has no `unit` in the study and counts in {label} as in the model, which no one system of units joins \
             with the others ({rest}): its numbers are taken as they stand."
        ),
    })
}
