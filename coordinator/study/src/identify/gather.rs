//! From sensitivities to named figures.
//!
//! Every figure is computed in `starlings-estimators`; here it gets its name and its unit. Next file to read:
//! [`super::advice`].

use nalgebra::DMatrix;
use starlings_estimators::{Collinearity, Direction, Fisher, Sensitivities, Subset};

use super::ensemble::{Response, Row};
use super::result::{
    CollinearityInfo, DirectionInfo, Identification, ParameterInfo, RecordSteps, SubsetInfo,
};
use super::series::Series;
use super::words::{combination, members};
use super::{At, IdentifyError};
use crate::constants::HangsOn;
use crate::posterior::{Estimate, estimates, independent, standard_deviations};
use crate::{Study, ThetaEntry};

/// Puts the figures together; workers, spread, warnings and advice are left to the caller.
///
/// # Errors
/// When the information cannot be decomposed.
pub(super) fn make(
    study: &Study,
    at: &At,
    centre: &[f64],
    response: Response,
    sensitivities: &Sensitivities,
) -> Result<Identification, IdentifyError> {
    let fisher = sensitivities.fisher()?;
    let step: Vec<usize> = response.rows.iter().map(|row| row.step).collect();
    let names: Vec<&str> = study.theta.iter().map(|t| t.name.as_str()).collect();
    let named = |places: &[usize]| places.iter().map(|j| names[*j].to_owned()).collect::<Vec<_>>();
    let n_step = step.last().map_or(0, |last| last + 1);
    let functions = sensitivities.generalised(&fisher, &step)?;
    let curves = |of: Vec<Option<Vec<f64>>>| Series {
        time: times(&response.rows, n_step),
        curves: named(&(0..names.len()).collect::<Vec<_>>()).into_iter().zip(of).collect(),
    };
    let covariance = fisher.posterior_covariance();
    Ok(Identification {
        study: study.name.clone(),
        model: study.setup.model.kind.clone(),
        at: at.to_string(),
        parameters: parameters(study, centre, sensitivities, &fisher),
        correlation: rows_of(&fisher.correlation()),
        posterior_correlation: rows_of(&starlings_estimators::correlation(&covariance)),
        information: rows_of(&fisher.information()),
        collinearity: collinearity(&sensitivities.collinearity(), &named),
        directions: fisher.directions().iter().map(|d| direction(study, &names, d)).collect(),
        gsf: curves(functions),
        sensitivity: curves(magnitudes(study, &response, n_step)),
        records: record_steps(study, &response.rows),
        silent: named(&sensitivities.silent()),
        hangs_on: HangsOn::default(),
        n_obs: response.rows.len(),
        runs: response.runs,
        workers: 0,
        spread: 0.0,
        time_unit: study.time_unit.clone(),
        conditional_on: conditional_on(study, at),
        advice: String::new(),
        warnings: Vec::new(),
        rows: response.rows,
        whitened: response.whitened,
        outputs: study.setup.outputs.clone(),
    })
}

fn parameters(study: &Study, centre: &[f64], s: &Sensitivities, fisher: &Fisher) -> Vec<ParameterInfo> {
    let mut expected = independent(centre, &vec![1.0; centre.len()]);
    expected.covariance = fisher.posterior_covariance();
    let sd = standard_deviations(&expected);
    let norms = s.norms();
    let errors = fisher.standard_errors();
    let info = |(j, (e, entry)): (usize, (Estimate, &ThetaEntry))| {
        // Rounding must not make the expected sd larger than the prior sd.
        let expected_sd = sd[j].min(entry.prior_sd);
        ParameterInfo {
            name: e.name,
            unit: e.unit,
            transform: entry.transform.name(),
            value: e.estimate,
            sensitivity_norm: norms[j],
            expected_sd,
            prior_sd: entry.prior_sd,
            standard_error: errors[j],
            informed: 1.0 - expected_sd / entry.prior_sd,
            information_bits: (entry.prior_sd / expected_sd).log2(),
            expected_sd_physical: e.sd,
            prior_sd_physical: entry.transform.derivative(entry.prior_mean).abs() * entry.prior_sd,
            expected_interval95: e.interval95,
            prior_interval95: e.prior_interval95,
            prior_median: e.prior_median,
        }
    };
    estimates(study, &expected).into_iter().zip(&study.theta).enumerate().map(info).collect()
}

fn rows_of<T: nalgebra::Scalar + Copy>(m: &DMatrix<T>) -> Vec<Vec<T>> {
    m.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn collinearity(found: &Collinearity, named: &dyn Fn(&[usize]) -> Vec<String>) -> CollinearityInfo {
    let info = |subset: &Subset| SubsetInfo { parameters: named(&subset.parameters), index: subset.index };
    CollinearityInfo {
        index: found.all.index,
        parameters: named(&found.all.parameters),
        subsets: found.subsets.iter().map(info).collect(),
        growing: found.growing.iter().map(info).collect(),
    }
}

fn direction(study: &Study, names: &[&str], direction: &Direction) -> DirectionInfo {
    let members = members(direction);
    let first = members.first().map(|j| &study.theta[*j]);
    let alike = |entry: &ThetaEntry| {
        let sd = |e: &ThetaEntry| e.prior_sd;
        first.is_some_and(|f| {
            f.transform.name() == entry.transform.name() && (sd(f) / sd(entry) - 1.0).abs() < 1e-9
        })
    };
    let unit = match first.map(|f| f.transform.name()) {
        Some("log2") if members.iter().all(|j| alike(&study.theta[*j])) => "octaves",
        Some("log") if members.iter().all(|j| alike(&study.theta[*j])) => "ln",
        _ => "prior sd",
    };
    let size = direction.coefficients.iter().map(|c| c * c).sum::<f64>().sqrt();
    let scale = if unit == "prior sd" { 1.0 } else { first.map_or(1.0, |f| size * f.prior_sd) };
    DirectionInfo {
        combination: combination(names, direction),
        coefficients: direction.coefficients.clone(),
        parameters: members.iter().map(|j| names[*j].to_owned()).collect(),
        share: direction.share,
        standard_error: direction.standard_error.map(|sd| sd * scale),
        unit,
    }
}

/// The time of every step; each has a row, as a training time has a value.
fn times(rows: &[Row], n_step: usize) -> Vec<f64> {
    let mut times = vec![0.0; n_step];
    for row in rows {
        times[row.step] = row.time;
    }
    times
}

/// Length of the sensitivities of each time's rows, in noise sd per prior sd, one curve per parameter.
fn magnitudes(study: &Study, response: &Response, n_step: usize) -> Vec<Option<Vec<f64>>> {
    let curve = |(j, entry): (usize, &ThetaEntry)| {
        let mut sums = vec![0.0; n_step];
        for (i, row) in response.rows.iter().enumerate() {
            sums[row.step] += (response.whitened[(i, j)] * entry.prior_sd).powi(2);
        }
        Some(sums.into_iter().map(f64::sqrt).collect())
    };
    study.theta.iter().enumerate().map(curve).collect()
}

fn record_steps(study: &Study, rows: &[Row]) -> Vec<RecordSteps> {
    let mut found: Vec<(usize, RecordSteps)> = Vec::new();
    for row in rows {
        match found.last_mut() {
            Some((record, steps)) if *record == row.record => steps.n = row.step - steps.first + 1,
            _ => {
                let record = study.records[row.record].name.clone();
                found.push((row.record, RecordSteps { record, first: row.step, n: 1 }));
            }
        }
    }
    found.into_iter().map(|(_, steps)| steps).collect()
}

fn conditional_on(study: &Study, at: &At) -> String {
    let observer = if study.observer_is_off() { "" } else { "; the study's observer is off in these runs" };
    let drift = if study.drifts() { " Parameters that drift are held at one value." } else { "" };
    format!(
        "A local analysis at {at}: it holds for a model that is close to linear within the expected intervals, and for \
         independent Gaussian noise of the stated standard deviations. Every record runs freely from its start{observer}.{drift}"
    )
}
