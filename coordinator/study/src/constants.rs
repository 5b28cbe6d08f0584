//! How far the estimate moves when a fixed number of the model is one per cent off: which constants the answer hangs on.
//!
//! The data do not show it: an estimate follows a wrong constant, often without a trace in the residuals. To first order it
//! moves by −(P₀⁻¹ + JᵀW⁻¹J)⁻¹ JᵀW⁻¹ ∂y/∂c (the normal equations, differentiated by the constant; Björck 1996, section 1.4). J
//! takes one ensemble, ∂y/∂c one run per constant and record. Next file to read: [`moved`], then [`super::identify::ensemble`].

pub mod moved;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use starlings_estimators::{Points, Sensitivities};

use self::moved::Moved;
use super::Study;
use super::fit::runner::{AnalysisIndex, EnsembleRunner};
use super::identify::ensemble::{self, Response, Seen};
use super::identify::error::IdentifyError;

/// How one estimate follows one constant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Follows {
    /// Name in the estimated vector.
    pub parameter: String,
    /// Move of the estimate when the constant rises by one per cent, in posterior standard deviations.
    pub sd_per_percent: f64,
}

/// A constant, and the estimates that follow it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConstantEffect {
    /// Name of the constant, `layout:KEY` for all numbers of that key in the layout, or `initial` for a given initial state.
    pub constant: String,
    /// Its value, where it has one.
    pub value: Option<f64>,
    /// Every estimate, the one that moves most first.
    pub moves: Vec<Follows>,
}

impl ConstantEffect {
    /// The largest move, in posterior standard deviations per per cent.
    pub fn largest(&self) -> f64 {
        self.moves.first().map_or(0.0, |m| m.sd_per_percent.abs())
    }

    /// `E_left moves by 4.2 posterior sd when R_d is 1 % off`.
    pub fn sentence(&self) -> String {
        let named = self.constant.strip_prefix("layout:");
        let constant = match (named, self.constant.as_str()) {
            (Some(key), _) => format!("`{key}` in the layout"),
            (None, "initial") => "the given initial state".to_owned(),
            (None, name) => name.to_owned(),
        };
        let Some(most) = self.moves.first() else { return String::new() };
        let size = in_sds(most.sd_per_percent.abs());
        format!("{} moves by {size} posterior sd when {constant} is 1 % off", most.parameter)
    }
}

/// A distance in posterior standard deviations, with the digits that it needs.
pub(crate) fn in_sds(size: f64) -> String {
    if size < 10.0 { format!("{size:.1}") } else { format!("{size:.0}") }
}

/// How far estimates follow the constants of the model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HangsOn {
    /// The constants, the one that moves an estimate most first.
    pub constants: Vec<ConstantEffect>,
    /// Constants of value zero, which cannot be one per cent off, and those at which the model fails.
    pub not_tried: Vec<String>,
    /// Runs of the model that it took.
    pub runs: u64,
}

impl HangsOn {
    /// Moves from which on a constant is named in a sentence, in posterior sd per per cent.
    const TOLD: f64 = 0.5;

    /// Sentences about the constants that matter most, at most so many.
    pub fn sentences(&self, most: usize) -> Vec<String> {
        let told = self.constants.iter().filter(|c| c.largest() >= Self::TOLD);
        told.take(most).map(ConstantEffect::sentence).collect()
    }
}

/// Moves every constant of a fitted study by one per cent, around the estimate (transformed units).
///
/// # Errors
/// When the fleet fails, or the model fails next to the estimate.
pub(crate) fn of_fit(runner: &mut EnsembleRunner<'_>, centre: &[f64]) -> Result<HangsOn, IdentifyError> {
    let study = runner.study();
    let moved = moved::all(study);
    if let Some(nothing) = none_of(&moved) {
        return Ok(nothing);
    }
    // One point more than parameters: to first order the same as pairs, at half the price.
    let response = ensemble::run_with(runner, centre, Points::Simplex, Seen::AsFitted)?;
    let sensitivities = Sensitivities::new(&response.whitened, &prior_sd(study), ensemble::spread(study))?;
    around(runner, centre, &response, &sensitivities, &moved, Seen::AsFitted)
}

/// The same with an ensemble that was run already.
///
/// # Errors
/// When the fleet fails.
pub(crate) fn of_ensemble(
    runner: &mut EnsembleRunner<'_>,
    centre: &[f64],
    response: &Response,
    sensitivities: &Sensitivities,
) -> Result<HangsOn, IdentifyError> {
    let moved = moved::all(runner.study());
    if let Some(nothing) = none_of(&moved) {
        return Ok(nothing);
    }
    let mut found = around(runner, centre, response, sensitivities, &moved, Seen::Freely)?;
    found.runs -= response.runs;
    Ok(found)
}

/// What is found without a run, where no constant can be moved.
/// Runs of a study's constants at most, cheaply: one each, and one of none.
pub(crate) fn n_run(study: &Study) -> usize {
    let n = moved::count(study);
    if n == 0 { 0 } else { n + 1 }
}

fn none_of(moved: &[Moved]) -> Option<HangsOn> {
    let not_tried = moved.iter().map(|m| m.name.clone()).collect();
    moved.iter().all(|m| m.setup.is_none()).then(|| HangsOn { not_tried, ..HangsOn::default() })
}

fn prior_sd(study: &Study) -> Vec<f64> {
    study.theta.iter().map(|t| t.prior_sd).collect()
}

fn around(
    runner: &mut EnsembleRunner<'_>,
    centre: &[f64],
    response: &Response,
    sensitivities: &Sensitivities,
    moved: &[Moved],
    seen: Seen,
) -> Result<HangsOn, IdentifyError> {
    let study = runner.study();
    let windows = ensemble::windows(study, seen);
    let theta = DMatrix::from_column_slice(centre.len(), 1, centre);
    let tried = moved.iter().filter_map(|m| m.setup.as_ref().map(|(_, setup)| setup));
    let setups: Vec<_> = std::iter::once(&study.setup).chain(tried).cloned().collect();
    let place = AnalysisIndex { pass: 0, step: 2 };
    let results = runner.run_setups(place, &setups, &theta, &windows)?;
    let answer = EstimateResponse::new(study, response, sensitivities)?;
    let mut found =
        HangsOn { runs: response.runs + (setups.len() * windows.len()) as u64, ..HangsOn::default() };
    let mut results = results.iter();
    let base = results.next().and_then(|r| ensemble::outputs(study, &windows, r, &response.rows));
    for constant in moved {
        let run = constant.setup.as_ref().and_then(|(step, _)| Some((step, results.next()?)));
        let change = run.and_then(|(step, r)| {
            let outputs = ensemble::outputs(study, &windows, r, &response.rows)?;
            Some((outputs - base.as_ref()?) * (0.01 / step))
        });
        let moves = change.and_then(|change| answer.to(&change));
        match moves {
            Some(moves) => {
                let constant =
                    ConstantEffect { constant: constant.name.clone(), value: constant.value, moves };
                found.constants.push(constant);
            }
            None => found.not_tried.push(constant.name.clone()),
        }
    }
    found.constants.sort_by(|a, b| b.largest().total_cmp(&a.largest()));
    Ok(found)
}

/// How the estimate responds to a change of the predictions.
struct EstimateResponse<'a> {
    study: &'a Study,
    response: &'a Response,
    covariance: DMatrix<f64>,
}

impl<'a> EstimateResponse<'a> {
    fn new(study: &'a Study, response: &'a Response, s: &Sensitivities) -> Result<Self, IdentifyError> {
        Ok(Self { study, response, covariance: s.fisher()?.posterior_covariance() })
    }

    /// To the change that one per cent of a constant makes; `None` when a figure is not finite.
    fn to(&self, change: &DVector<f64>) -> Option<Vec<Follows>> {
        let whitened = DVector::from_fn(change.len(), |i, _| change[i] / self.response.rows[i].noise);
        let step = -(&self.covariance * self.response.whitened.tr_mul(&whitened));
        let mut moves: Vec<Follows> = (0..step.len())
            .map(|j| Follows {
                parameter: self.study.theta[j].name.clone(),
                sd_per_percent: step[j] / self.covariance[(j, j)].sqrt(),
            })
            .collect();
        moves.sort_by(|a, b| b.sd_per_percent.abs().total_cmp(&a.sd_per_percent.abs()));
        moves.iter().all(|m| m.sd_per_percent.is_finite()).then_some(moves)
    }
}
