//! What is known when a forecast begins: the posterior of a finished inference, or of one that is followed.
//!
//! Next file to read: `last_row.rs`.

use std::path::Path;

use nalgebra::{DMatrix, DVector};
use starlings_estimators::Gaussian;
use starlings_estimators::inference::{Diffusion, Draws, NoiseCheck, Verdict, noise_checks};
use starlings_study::Study;
use starlings_study::infer_choice::{DiffusionChoice, InferChoice, MeasuredChoice};

use crate::error::InferError;
use crate::follow::state::{self, Saved};
use crate::result::Inference;
use crate::run::{Asked, asked, choice};

/// What members are drawn from.
#[derive(Debug, Clone)]
pub struct Known {
    /// Names of the coefficients with a value, in the order of the draws.
    pub(super) names: Vec<String>,
    pub(super) draws: Draws,
    /// Sampling step.
    pub(super) step: f64,
    /// Standard deviation of the measurement of every state; zero where there is none.
    pub(super) measured: Vec<f64>,
    /// Time and values of the last row, where it is known without the recording.
    pub(super) last: Option<(f64, Vec<f64>)>,
    /// What is doubtful.
    pub(super) warnings: Vec<String>,
}

impl Known {
    /// Of a finished inference of this study.
    ///
    /// # Errors
    /// When the inference is of another study, or has no covariance.
    pub fn of_result(study: &Study, found: &Inference) -> Result<Self, InferError> {
        let choice = choice(study)?;
        let asked = asked(study, choice, found.step)?;
        let other = || {
            InferError::Setting(
                "the result is of another study, whose coefficients or equations differ".to_owned(),
            )
        };
        let structure = &asked.question.structure;
        let same = found.equations == structure.equations()
            && found
                .coefficients
                .iter()
                .map(|c| &c.name)
                .eq(structure.coefficients().iter().map(|c| &c.name));
        if !same {
            return Err(other());
        }
        let values = found.coefficients.iter().filter_map(|c| Some((c.name.clone(), c.estimate?)));
        let (names, means): (Vec<String>, Vec<f64>) = values.unzip();
        if found.covariance.len() != means.len() {
            let message =
                "the result has no covariance of its coefficients, as those of earlier versions: infer again";
            return Err(InferError::Setting(message.to_owned()));
        }
        let covariance = square(&found.covariance).ok_or_else(other)?;
        let diffusion = square(&found.diffusion.matrix).ok_or_else(other)?;
        let gaussian = Gaussian { mean: DVector::from_vec(means), covariance };
        let draws = Draws::new(gaussian, &diffusion, found.diffusion.degrees, form(choice))?;
        let measured =
            errors(choice, &found.noise_checks, found.diffusion.lag_corrected, structure.equations().len());
        let mut warnings = absent(structure.coefficients().iter().map(|c| &c.name), &names);
        let named: Vec<&str> =
            found.missing.iter().flat_map(|m| &m.named).map(|term| term.name.as_str()).collect();
        if !named.is_empty() {
            warnings.push(format!(
                "the inference found that the drift lacks {}, which members have not: write it into the study",
                named.join(", ")
            ));
        }
        let varies: Vec<&str> = found.noise_varies.iter().map(|of| of.equation.as_str()).collect();
        if !varies.is_empty() {
            warnings.push(format!(
                "the inference found that the noise of {} is not constant, which that of members is: they spread too little where it is \
                 larger than its mean",
                varies.join(", ")
            ));
        }
        Ok(Self { names, draws, step: found.step, measured, last: None, warnings })
    }

    /// Of the state file of an inference that is followed.
    ///
    /// # Errors
    /// When the file cannot be read, is that of another study, or has no estimate yet.
    pub fn of_state(study: &Study, file: &Path) -> Result<Self, InferError> {
        let choice = choice(study)?;
        let told = |message: String| InferError::State { file: file.to_owned(), message };
        let Some(saved) = state::read(file)? else {
            return Err(InferError::Setting(format!("there is no state file {}", file.display())));
        };
        let asked = asked(study, choice, saved.step)?;
        if saved.asked != state::fingerprint(&asked)? {
            let message = "it is the state of another study, whose model, step, columns or [infer] differ";
            return Err(InferError::Setting(message.to_owned()));
        }
        let Saved { step, stream, window, posterior, .. } = saved;
        let Some(posterior) = posterior else {
            let message = format!("{} has no estimate yet: follow the recording for longer", file.display());
            return Err(InferError::Setting(message));
        };
        let Asked { question, .. } = &asked;
        let structure = &question.structure;
        window
            .check(&question.basis)
            .and_then(|()| posterior.check(structure))
            .map_err(|e| told(e.to_string()))?;
        let checks = match window.sums() {
            Some(sums) if sums.n_pair() > 0 => noise_checks(&sums, structure, &posterior)?,
            _ => Vec::new(),
        };
        let matters = checks.iter().any(|check| check.verdict == Verdict::Matters);
        let corrected = matters && choice.measured == MeasuredChoice::Auto;
        let (time, values) = stream.last.ok_or_else(|| told("it has no row".to_owned()))?;
        if values.len() != question.basis.n_channel() || !values.iter().all(|v| v.is_finite()) {
            return Err(told("its last row does not fit".to_owned()));
        }
        let active = posterior.active().iter().map(|p| posterior.estimates[*p].name.clone());
        let names: Vec<String> = active.collect();
        let gaussian =
            Gaussian { mean: posterior.mean().clone(), covariance: posterior.covariance().clone() };
        Ok(Self {
            draws: Draws::new(gaussian, &posterior.diffusion, posterior.least_degrees(), form(choice))?,
            step,
            measured: errors(choice, &checks, corrected, structure.equations().len()),
            last: Some((time, values)),
            warnings: absent(structure.coefficients().iter().map(|c| &c.name), &names),
            names,
        })
    }
}

fn form(choice: &InferChoice) -> Diffusion {
    match choice.diffusion {
        DiffusionChoice::Full => Diffusion::Full,
        DiffusionChoice::Diagonal => Diffusion::Diagonal,
        DiffusionChoice::Isotropic => Diffusion::Isotropic,
    }
}

/// Standard deviations of the measurement by equation: given, or where errors were taken out of the noise what residuals of
/// neighbouring steps share.
fn errors(choice: &InferChoice, checks: &[NoiseCheck], corrected: bool, n: usize) -> Vec<f64> {
    if let MeasuredChoice::Known(sd) = choice.measured {
        return vec![sd; n];
    }
    // Interpolated rows share what lies between them, which is no error of the measurement.
    if !corrected || choice.resample || checks.len() != n {
        return vec![0.0; n];
    }
    checks.iter().map(|check| check.measured.max(0.0).sqrt()).collect()
}

/// A warning of coefficients that have no value.
fn absent<'a>(all: impl Iterator<Item = &'a String>, known: &[String]) -> Vec<String> {
    let absent: Vec<&str> = all.filter(|name| !known.contains(name)).map(String::as_str).collect();
    if absent.is_empty() {
        return Vec::new();
    }
    vec![format!("not observed, and zero in all members: {}", absent.join(", "))]
}

/// A square matrix from its rows.
fn square(rows: &[Vec<f64>]) -> Option<DMatrix<f64>> {
    let n = rows.len();
    rows.iter().all(|row| row.len() == n).then(|| DMatrix::from_fn(n, n, |i, j| rows[i][j]))
}
