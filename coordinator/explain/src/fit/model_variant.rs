//! A variant of the study's model: effects added, terms left out, and the units in which its parameters are fitted.
//!
//! [`starlings_study::Study::with_model`] makes a study of it, so that whatever runs a study runs a variant.
//!
//! A fit works in z: own parameters and parameters inside a term in prior standard deviations from their prior mean,
//! amplitudes in a unit of their size without prior. Next file to read: [`super::drive`].

use nalgebra::DVector;
use starlings_estimators::{Scaled, Transform};
use starlings_models::SetupError;
use starlings_study::Study;

use super::candidate::Candidate;

/// An effect that a variant adds, and the unit of its amplitude.
#[derive(Clone, Debug)]
pub(crate) struct AddedEffect<'c> {
    /// The effect.
    pub candidate: &'c Candidate,
    /// Its position among the candidates.
    pub index: usize,
    /// Size of its amplitude, in the amplitude's unit, above zero.
    pub unit: f64,
}

/// Growth of the logarithm of every entry per unit of its z, where the rates of the equations are linear in the parameter and z is its
/// logarithm; zero for all others, and for parameters of effects.
fn growth(base: &Study, study: &Study, n_own: usize) -> DVector<f64> {
    let mut growth = DVector::zeros(study.theta.len());
    let Some(equations) = &base.setup.model.equations else { return growth };
    let per_unit = |transform: Transform| match transform {
        Transform::Log => 1.0,
        Transform::Log2 => std::f64::consts::LN_2,
        Transform::Linear | Transform::Logit { .. } => 0.0,
    };
    let names: Vec<&str> = study.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    let linear = equations.linear_in(&names);
    for (growth, entry) in growth.iter_mut().zip(&study.theta[..n_own]) {
        if linear.contains(&names[entry.parameter]) {
            *growth = per_unit(entry.transform) * entry.prior_sd;
        }
    }
    growth
}

/// The study's model with effects added and terms left out.
#[derive(Clone, Debug)]
pub(crate) struct ModelVariant<'c> {
    /// The study as it is.
    pub base: &'c Study,
    /// The study with this model.
    pub study: Study,
    /// The effects that were added.
    pub effects: Vec<AddedEffect<'c>>,
    /// The terms that were left out.
    pub left_out: Vec<String>,
    /// Entries of the estimated vector that are the model's own.
    pub n_own: usize,
    centre: DVector<f64>,
    unit: DVector<f64>,
    /// Prior and bounds in z.
    pub scaled: Scaled,
}

impl<'c> ModelVariant<'c> {
    /// The variant of `base` with these effects and without these terms.
    ///
    /// # Errors
    /// When an effect does not fit the model.
    pub(crate) fn new(
        base: &'c Study,
        effects: Vec<AddedEffect<'c>>,
        left_out: &[String],
    ) -> Result<Self, SetupError> {
        let added: Vec<_> = effects.iter().map(|m| (m.candidate.def.clone(), m.candidate.priors())).collect();
        let study = base.with_model(&added, left_out)?;
        let n_effect: usize = added.iter().map(|(def, _)| def.parameters.len()).sum();
        let n_own = study.theta.len() - n_effect;
        let n = study.theta.len();
        let mut centre = DVector::from_iterator(n, study.theta.iter().map(|t| t.prior_mean));
        let mut unit = DVector::from_iterator(n, study.theta.iter().map(|t| t.prior_sd));
        let mut precision = DVector::from_element(n, 1.0);
        let mut bounds = vec![[f64::NEG_INFINITY, f64::INFINITY]; n];
        let mut at = n_own;
        for effect in &effects {
            centre[at] = 0.0;
            unit[at] = effect.unit;
            precision[at] = 0.0;
            bounds[at] = effect.candidate.def.parameters[0].range.map(|v| v / effect.unit);
            at += effect.candidate.def.parameters.len();
        }
        let growth = growth(base, &study, n_own);
        let scaled = Scaled { mean: DVector::zeros(n), precision, bounds, growth };
        Ok(Self { base, study, effects, left_out: left_out.to_vec(), n_own, centre, unit, scaled })
    }

    /// Transformed parameters from z.
    pub(crate) fn theta(&self, z: &DVector<f64>) -> DVector<f64> {
        &self.centre + self.unit.component_mul(z)
    }

    /// The units of z, in transformed units.
    pub(crate) fn unit(&self) -> &DVector<f64> {
        &self.unit
    }

    /// Whether its effects are those of these candidates, in any order.
    pub(crate) fn has_just(&self, candidates: &[usize]) -> bool {
        self.effects.len() == candidates.len()
            && candidates.iter().all(|index| self.effects.iter().any(|effect| effect.index == *index))
    }

    /// Number of estimated values.
    pub(crate) fn n_param(&self) -> usize {
        self.study.theta.len()
    }

    /// Number of values inside the terms of its effects, but for widths that round a corner and starts of states of its own.
    pub(crate) fn n_inner(&self) -> usize {
        self.effects.iter().map(|effect| effect.candidate.n_inner()).sum()
    }

    /// Position in the estimated vector of the first parameter of an added effect.
    pub(crate) fn first_entry_of(&self, effect: usize) -> usize {
        self.n_own + self.effects[..effect].iter().map(|m| m.candidate.def.parameters.len()).sum::<usize>()
    }

    /// The entries that are instants of added effects, and how far they are moved at least for a difference, in their unit.
    pub(crate) fn instants(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        (0..self.effects.len()).flat_map(|m| {
            let first = self.first_entry_of(m);
            self.effects[m].candidate.instants.iter().map(move |(k, apart)| (first + k, *apart))
        })
    }

    /// The z of this variant that corresponds to `from` of another: values are taken by name, an amplitude that is new is zero,
    /// and the other parameters of a new effect stand at `point`.
    pub(crate) fn continue_from(
        &self,
        other: &ModelVariant<'_>,
        from: &DVector<f64>,
        point: &[f64],
    ) -> DVector<f64> {
        let theta = other.theta(from);
        let mut z = DVector::zeros(self.n_param());
        let mut inner = point.iter();
        for (j, entry) in self.study.theta.iter().enumerate() {
            let value = match other.study.theta.iter().position(|e| e.name == entry.name) {
                Some(i) => theta[i],
                None if j >= self.n_own && !self.is_amplitude(j) => {
                    inner.next().map_or(self.centre[j], |v| entry.transform.to_transformed(*v))
                }
                None => self.centre[j],
            };
            z[j] = (value - self.centre[j]) / self.unit[j];
        }
        z
    }

    /// Whether an entry of the estimated vector is the amplitude of an added effect.
    pub(crate) fn is_amplitude(&self, entry: usize) -> bool {
        (0..self.effects.len()).any(|m| self.first_entry_of(m) == entry)
    }

    /// Names of its effects joined by ` + `, or of what it leaves out.
    pub(crate) fn name(&self) -> String {
        let names: Vec<&str> = self.effects.iter().map(|m| m.candidate.name()).collect();
        let added = names.join(" + ");
        match self.left_out.as_slice() {
            [] if added.is_empty() => "the model as it is".to_owned(),
            [] => added,
            terms => format!("{added} instead of {}", terms.join(" and ")),
        }
    }
}
