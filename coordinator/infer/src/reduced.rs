//! A model with fewer unknowns than coefficients: its coefficients as expressions, fitted to the posterior.
//!
//! χ² says whether the recording allows it. Next file to read: `answer.rs`.

use nalgebra::DVector;
use starlings_estimators::inference::{InferenceError, Posterior, Structure, reduce};
use starlings_estimators::quantiles::normal;
use starlings_models::equations::{At, Expression, Program, Slot};
use starlings_models::{Drive, did_you_mean, nearest};
use starlings_study::infer_choice::ReducedChoice;

use crate::error::InferError;
use crate::result::{LEVEL, ReducedFound, UnknownFound};
use crate::words::plural;

/// Probability of χ² below which a reduced model counts as refuted.
const REFUTED: f64 = 0.01;

/// The coefficients as functions of the unknowns.
struct Reduced {
    define: Vec<Program>,
    /// One per coefficient of the structure; `None` is zero.
    coefficients: Vec<Option<Program>>,
}

/// Fits the reduced model to the `means` of the coefficients that have a value, under the precision of their posterior.
///
/// # Errors
/// For a coefficient that is not there, and where the fit fails.
pub fn fit_reduced(
    choice: &ReducedChoice,
    structure: &Structure,
    posterior: &Posterior,
    means: &DVector<f64>,
) -> Result<ReducedFound, InferError> {
    let reduced = Reduced::new(choice, structure)?;
    let start = DVector::from_iterator(choice.start.len(), choice.start.iter().map(|(_, value)| *value));
    // The posterior has its own means: c + shift − g(θ) = c − (g(θ) − shift).
    let shift = means - posterior.mean();
    let map = |theta: &DVector<f64>| reduced.at(theta, posterior.active()) - &shift;
    let found = reduce(posterior, &start, map).map_err(|error| named(&error, choice))?;
    let half = normal(0.5 + 0.5 * LEVEL);
    let unknown = |(k, (name, _)): (usize, &(String, f64))| {
        let (estimate, sd) = (found.mean[k], found.covariance[(k, k)].max(0.0).sqrt());
        UnknownFound {
            name: name.clone(),
            estimate,
            sd,
            interval90: [estimate - half * sd, estimate + half * sd],
        }
    };
    Ok(ReducedFound {
        unknowns: choice.start.iter().enumerate().map(unknown).collect(),
        chi_squared: found.chi_squared,
        degrees: found.degrees,
        probability: found.probability,
        consistent: found.probability > REFUTED,
    })
}

/// Whether a reduced model names coefficients that are there, in expressions that compile.
///
/// # Errors
/// When it does not.
pub fn check_reduced(choice: &ReducedChoice, structure: &Structure) -> Result<(), InferError> {
    Reduced::new(choice, structure).map(drop)
}

/// An error with the unknowns by their names instead of numbers.
fn named(error: &InferenceError, choice: &ReducedChoice) -> InferError {
    let columns = match error {
        InferenceError::Collinear { columns } => columns,
        InferenceError::TooFew { n_step, n_unknown, .. } => {
            let (these, unknowns) = (plural(*n_step as usize, "coefficient"), plural(*n_unknown, "unknown"));
            let message =
                format!("{these} cannot determine {unknowns}: fix some of these, or infer more coefficients");
            return InferError::Reduced(message);
        }
        other => return InferError::Reduced(other.to_string()),
    };
    let name = |column: &String| {
        let number = column.strip_prefix("unknown ").and_then(|n| n.parse::<usize>().ok());
        number.and_then(|n| choice.start.get(n)).map_or_else(|| column.clone(), |(name, _)| name.clone())
    };
    let names: Vec<String> = columns.iter().map(name).collect();
    InferError::Reduced(format!(
        "the coefficients do not determine its unknowns {}: fix one of them",
        names.join(", ")
    ))
}

impl Reduced {
    fn new(choice: &ReducedChoice, structure: &Structure) -> Result<Self, InferError> {
        let resolve = |name: &str| {
            let unknown = || choice.start.iter().position(|(known, _)| known == name).map(Slot::Parameter);
            let defined = || choice.define.iter().position(|(known, _)| known == name).map(Slot::Output);
            defined().or_else(unknown)
        };
        let compile = |text: &str| {
            let parsed = Expression::parse(text).and_then(|e| e.compile(&resolve, &|_| None));
            parsed.map_err(|error| InferError::Reduced(format!("in `{text}`: {error}")))
        };
        let names: Vec<&str> = structure.coefficients().iter().map(|c| c.name.as_str()).collect();
        let mut coefficients: Vec<Option<Program>> = names.iter().map(|_| None).collect();
        for (name, text) in &choice.coefficients {
            let Some(at) = names.iter().position(|known| known == name) else {
                let near = nearest(name, &names)
                    .map_or_else(|| format!("there are {}", names.join(", ")), did_you_mean);
                return Err(InferError::Reduced(format!("there is no coefficient `{name}` ({near})")));
            };
            coefficients[at] = Some(compile(text)?);
        }
        let define = choice.define.iter().map(|(_, text)| compile(text)).collect::<Result<_, _>>()?;
        Ok(Self { define, coefficients })
    }

    /// The coefficients that have a value, for unknowns θ.
    fn at(&self, theta: &DVector<f64>, active: &[usize]) -> DVector<f64> {
        let theta = theta.as_slice();
        let mut defined = vec![f64::NAN; self.define.len()];
        for (k, program) in self.define.iter().enumerate() {
            defined[k] = program.eval(&At { t: 0.0, x: &[], theta, u: Drive::NONE, y: &defined });
        }
        let at = At { t: 0.0, x: &[], theta, u: Drive::NONE, y: &defined };
        let value = |p: &usize| self.coefficients[*p].as_ref().map_or(0.0, |program| program.eval(&at));
        DVector::from_iterator(active.len(), active.iter().map(value))
    }
}
