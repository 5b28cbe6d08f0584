//! The uncertain parameters: known to the model, named once, each with a prior that fits it.
//!
//! Next file to read: [`super::prior`].

use starlings_models::{Spec, quoted_list};
use toml::Spanned;

use super::built::{CheckedModel, quantity, valid_names};
use super::median::check_median;
use super::prior::{self, Prior};
use crate::checked::{Record, StudyParameter};
use crate::expand::INITIAL;
use crate::file::{ParameterSection, StudyFile};
use crate::problem::Source;

/// The priors in the order of the file, nothing in the place of one that was refused.
pub(crate) fn priors(
    source: &Source,
    file: &StudyFile,
    model: &CheckedModel,
    warnings: &mut Vec<String>,
) -> Vec<Option<Prior>> {
    if file.parameters.is_empty() && file.needs_parameter {
        let end = source.text.len();
        let help = format!("add `[[parameters]]`; the model has {}", quoted_list(valid_names(&model.spec)));
        source.report_with(end..end, "the study has no parameter to estimate", help);
    }
    let check = |(i, parameter): (usize, &ParameterSection)| {
        let name = parameter.name.get_ref();
        if file.parameters[..i].iter().any(|p| p.name.get_ref() == name) {
            let message = format!("parameter `{name}` is given twice");
            source.report_with(parameter.name.span(), message, "remove one of the two");
            return None;
        }
        if file.model.constants.iter().any(|(constant, _)| constant.get_ref() == name) {
            let message = format!("`{name}` is both a constant and an estimated parameter");
            source.report_with(parameter.name.span(), message, "remove one of the two");
        }
        let quantity = quantity(&model.spec, name);
        if quantity.is_none() {
            let message = format!("model `{}` has no parameter `{name}`", model.spec.kind);
            source.report_unknown(parameter.name.span(), message, &model.valid_names);
        }
        let prior = prior::prior(source, parameter, quantity)?;
        warnings.extend(quantity.and_then(|q| prior::reach_warning(name, &prior, q)));
        Some(prior)
    };
    file.parameters.iter().enumerate().map(check).collect()
}

/// The parameters with their prior means per record, medians taken from recordings where the study says so.
pub(crate) fn initial_medians(
    source: &Source,
    file: &StudyFile,
    spec: &Spec,
    priors: &[Option<Prior>],
    records: &[Record],
) -> Vec<StudyParameter> {
    let mut parameters = Vec::new();
    for (section, prior) in file.parameters.iter().zip(priors) {
        let Some(prior) = prior else { continue };
        let name = section.name.get_ref();
        let quantity = quantity(spec, name);
        let per_record = section.per_record.unwrap_or_else(|| name.starts_with(INITIAL));
        if let Some(from) = section.prior.median_from.as_ref().filter(|_| !per_record && records.len() > 1) {
            let message =
                format!("`{name}` is one value for all records, so its median cannot come from each");
            source.report_with(from.span(), message, "add `per_record = true`, or give `median`");
            continue;
        }
        let mean = |record: &Record| match (&section.prior.median_from, prior.mean) {
            (Some(from), _) => first_value(source, from, record)
                .filter(|median| check_median(source, median, name, &prior.transform, quantity))
                .map_or(f64::NAN, |median| prior.transform.to_transformed(*median.get_ref())),
            (None, mean) => mean.unwrap_or(f64::NAN),
        };
        let unit = section.unit.as_ref().map(|u| u.get_ref().clone()).filter(|u| !u.is_empty());
        parameters.push(StudyParameter {
            name: name.clone(),
            unit: unit.unwrap_or_else(|| quantity.map(|q| q.unit.clone()).unwrap_or_default()),
            transform: prior.transform,
            per_record,
            prior_mean: records.iter().map(mean).collect(),
            prior_sd: prior.sd,
            drift: prior.drift,
        });
    }
    parameters
}

/// The first observed value of a channel, at the place that asks for it. In a trained record it is the first one that
/// trains: a held-out value must not reach the fit by way of its prior.
fn first_value(source: &Source, from: &Spanned<String>, record: &Record) -> Option<Spanned<f64>> {
    let Some(channel) = record.channels.iter().find(|c| c.output == *from.get_ref()) else {
        let valid: Vec<String> = record.channels.iter().map(|c| c.output.clone()).collect();
        let message = format!("record `{}` has no channel of output `{}`", record.name, from.get_ref());
        source.report_unknown(from.span(), message, &valid);
        return None;
    };
    if record.is_trained() && channel.held_out {
        let message = format!("channel `{}` of record `{}` is held out", from.get_ref(), record.name);
        source.report_with(from.span(), message, "give `median`, or take it from a channel that is fitted");
        return None;
    }
    let mut known = record.times.iter().zip(&channel.values).filter(|(_, v)| v.is_finite());
    let first = known.find(|(t, _)| !record.is_trained() || record.trains_at(**t));
    if first.is_none() {
        let message = format!("`{}` has no value in the training span of `{}`", from.get_ref(), record.name);
        source.report_with(from.span(), message, "give `median`");
    }
    Some(Spanned::new(from.span(), *first?.1))
}
