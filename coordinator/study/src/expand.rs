//! From parameters and records to the estimated vector, and from that vector to the values of one record's job.
//!
//! Next file to read: [`super::plan`].

use super::checked::{Record, Study, StudyParameter, ThetaEntry};

/// The prefix of a parameter that is a state's initial value.
pub(super) const INITIAL: &str = "initial:";

/// The estimated vector: a shared parameter once, any other once per trained record; of a held-out record whose first rows tell its
/// start, its initial values alone. In a study of one record the names need no record.
pub(super) fn theta(parameters: &[StudyParameter], records: &[Record]) -> Vec<ThetaEntry> {
    let mut entries = Vec::new();
    for (index, parameter) in parameters.iter().enumerate() {
        let entry = |name: String, record: Option<usize>| ThetaEntry {
            name,
            parameter: index,
            record,
            prior_mean: parameter.prior_mean.get(record.unwrap_or(0)).copied().unwrap_or(f64::NAN),
            prior_sd: parameter.prior_sd,
            transform: parameter.transform,
            drift: parameter.drift,
        };
        if parameter.per_record && records.len() > 1 {
            let has_own = |r: &Record| r.is_trained() && (parameter.is_initial() || !r.only_start);
            let trained = records.iter().enumerate().filter(|(_, r)| has_own(r));
            entries.extend(trained.map(|(i, r)| entry(format!("{}[{}]", parameter.name, r.name), Some(i))));
        } else {
            entries.push(entry(parameter.name.clone(), None));
        }
    }
    entries
}

impl StudyParameter {
    /// Whether it is the initial value of a state.
    pub fn is_initial(&self) -> bool {
        self.name.starts_with(INITIAL)
    }
}

impl Study {
    /// Whether the estimated vector holds the value of a parameter for this record, be it shared or its own.
    pub fn estimates(&self, record: usize, parameter: usize) -> bool {
        self.theta.iter().any(|e| e.parameter == parameter && e.record.is_none_or(|own| own == record))
    }

    /// Physical values in the order of [`starlings_models::Setup::parameters`] for one record, from the estimated vector in
    /// transformed units.
    ///
    /// A held-out record has no entries of its own, but for initial values that its first rows tell: it takes the mean of the fitted records (in transformed units), and for
    /// an initial value its own prior median.
    pub fn theta_for(&self, record: usize, transformed: &[f64]) -> Vec<f64> {
        let value = |(index, parameter): (usize, &StudyParameter)| {
            let mean = mean_of(&self.entries_for(record, index), transformed);
            parameter.transform.to_physical(mean.unwrap_or_else(|| parameter.prior_mean[record]))
        };
        self.parameters.iter().enumerate().map(value).collect()
    }

    /// How the values of [`Study::theta_for`] move with the estimated vector: value, entry and derivative, where there is one.
    pub(crate) fn theta_slopes(&self, record: usize, transformed: &[f64]) -> Vec<(usize, usize, f64)> {
        let mut slopes = Vec::new();
        for (index, parameter) in self.parameters.iter().enumerate() {
            let entries = self.entries_for(record, index);
            let Some(mean) = mean_of(&entries, transformed) else { continue };
            let slope = parameter.transform.derivative(mean) / entries.len() as f64;
            slopes.extend(entries.into_iter().map(|entry| (index, entry, slope)));
        }
        slopes
    }

    /// The entries of the estimated vector of which a parameter's value for this record is the mean: its own, all of them where it has
    /// none, or none where it takes the prior median.
    fn entries_for(&self, record: usize, parameter: usize) -> Vec<usize> {
        let of_parameter = self.theta.iter().enumerate().filter(|(_, e)| e.parameter == parameter);
        let own = of_parameter.clone().find(|(_, e)| e.record.is_none_or(|own| own == record));
        match own {
            Some((entry, _)) => vec![entry],
            None if self.parameters[parameter].is_initial() => Vec::new(),
            None => of_parameter.map(|(entry, _)| entry).collect(),
        }
    }
}

/// The mean of some entries; `None` of none.
fn mean_of(entries: &[usize], transformed: &[f64]) -> Option<f64> {
    let sum: f64 = entries.iter().map(|entry| transformed[*entry]).sum();
    (!entries.is_empty()).then(|| sum / entries.len() as f64)
}
