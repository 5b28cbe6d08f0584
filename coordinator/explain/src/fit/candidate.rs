//! An effect to try, with the points at which it is screened and the priors of its parameters.
//!
//! The grids of the parameters inside a term become one list of points. Nothing is run here. Next file to read:
//! [`super::model_variant`].

use std::collections::HashSet;

use starlings_estimators::Transform;
use starlings_models::effect::{EffectDef, EffectParameter};
use starlings_models::equations::Expression;
use starlings_study::variant::EffectPrior;

use super::kind::Kind;

/// Grid points of one candidate at most.
const MOST_POINTS: usize = 9;
/// Prior standard deviation of a parameter inside a term, in the logarithm of the odds over its range: nearly uniform.
const ODDS_SD: f64 = 1.5;
/// Prior standard deviation of a positive parameter without upper bound, in its logarithm.
const LOG_SD: f64 = 1.0;

/// An effect to try.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Candidate {
    /// The effect, every number in the model's units.
    pub def: EffectDef,
    /// Values of the parameters after the amplitude at which it is screened, at least one point.
    pub points: Vec<Vec<f64>>,
    /// Where it comes from.
    pub kind: Kind,
    /// The instants among its parameters, by position, and how far they are moved at least for a difference: what lies between two
    /// observations, or within a step of an integration, changes nothing.
    pub instants: Vec<(usize, f64)>,
    /// Positions of the points with an instant at which the residuals of the model as it is jump.
    pub jumps: Vec<usize>,
}

impl Candidate {
    /// A candidate with its grid.
    pub(crate) fn new(def: EffectDef) -> Self {
        let mut points: Vec<Vec<f64>> = vec![Vec::new()];
        for parameter in def.parameters.iter().skip(1) {
            let values = values(parameter);
            points = points
                .iter()
                .flat_map(|point| values.iter().map(move |v| [point.as_slice(), &[*v]].concat()))
                .collect();
        }
        Self { def, points: thinned(points), kind: Kind::default(), instants: Vec::new(), jumps: Vec::new() }
    }

    /// The same of a kind.
    pub(crate) fn of_kind(self, kind: Kind) -> Self {
        Self { kind, ..self }
    }

    /// Its name.
    pub(crate) fn name(&self) -> &str {
        &self.def.name
    }

    /// Whether its amplitude stands in the rate of a state of its own, as of a store that fills the faster the more it takes.
    pub(crate) fn moves_own_state(&self) -> bool {
        let Some(amplitude) = self.def.parameters.first() else { return false };
        let names = |rate: &str| {
            Expression::parse(rate).is_ok_and(|e| e.names().iter().any(|(name, _)| *name == amplitude.name))
        };
        self.def.states.iter().any(|state| names(&state.rate))
    }

    /// Number of values inside its terms, but for widths that round a corner and starts of states of its own.
    pub(crate) fn n_inner(&self) -> usize {
        self.def.parameters.iter().skip(1).filter(|parameter| self.is_of_its_form(parameter)).count()
    }

    /// Whether a value inside its terms is part of its form. A width that rounds a corner is none, nor is where a state of its own starts.
    pub(crate) fn is_of_its_form(&self, parameter: &EffectParameter) -> bool {
        !parameter.is_rounding && self.def.states.iter().all(|state| state.initial != parameter.name)
    }

    /// The sign that its amplitude must have; 0 when both are possible.
    pub(crate) fn sign(&self) -> f64 {
        match self.def.parameters.first().map(|p| p.range) {
            Some([lo, _]) if lo >= 0.0 => 1.0,
            Some([_, hi]) if hi <= 0.0 => -1.0,
            _ => 0.0,
        }
    }

    /// Priors of its parameters. That of the amplitude is a placeholder, since the search fits the amplitude without a prior;
    /// those of the others are wide.
    pub(crate) fn priors(&self) -> Vec<EffectPrior> {
        let amplitude = EffectPrior { transform: Transform::Linear, mean: 0.0, sd: 1.0 };
        let inner = self.def.parameters.iter().skip(1).map(inner_prior);
        std::iter::once(amplitude).chain(inner).collect()
    }
}

/// At most [`MOST_POINTS`] of the points, among them the first, which is the middle of every grid. They lie a constant stride
/// apart, modulo the length of the list. The stride is coprime to the length, because any other would visit only some values of
/// the last grids. Of the coprime strides it is the shortest with which most values of the grids occur.
fn thinned(points: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let n = points.len();
    if n <= MOST_POINTS {
        return points;
    }
    let kept = |stride: usize| (0..MOST_POINTS).map(|k| points[k * stride % n].clone()).collect::<Vec<_>>();
    let occurring = |points: &[Vec<f64>]| {
        let of = |k: usize| points.iter().map(|p| p[k].to_bits()).collect::<HashSet<_>>().len();
        (0..points[0].len()).map(of).sum::<usize>()
    };
    let strides = (n.div_ceil(MOST_POINTS)..n).filter(|stride| common(*stride, n) == 1);
    let best = strides.min_by_key(|stride| std::cmp::Reverse(occurring(&kept(*stride))));
    kept(best.unwrap_or(1))
}

/// Greatest common divisor (Euclid).
fn common(a: usize, b: usize) -> usize {
    if b == 0 { a } else { common(b, a % b) }
}

/// Values of an inner parameter to screen at, the middle of its grid first.
fn values(parameter: &EffectParameter) -> Vec<f64> {
    let grid = &parameter.grid;
    if !grid.is_empty() {
        let mut values = grid.clone();
        values.swap(0, grid.len() / 2);
        return values;
    }
    match parameter.range {
        [lo, hi] if lo.is_finite() && hi.is_finite() => vec![0.5 * (lo + hi)],
        [lo, _] if lo.is_finite() => vec![lo + 1.0],
        _ => vec![0.0],
    }
}

fn inner_prior(parameter: &EffectParameter) -> EffectPrior {
    let first = values(parameter)[0];
    match parameter.range {
        [lo, hi] if lo.is_finite() && hi.is_finite() => {
            EffectPrior { transform: Transform::Logit { lo, hi }, mean: 0.0, sd: ODDS_SD }
        }
        [lo, _] if lo >= 0.0 && first > 0.0 => {
            EffectPrior { transform: Transform::Log, mean: first.ln(), sd: LOG_SD }
        }
        _ => {
            let reach = parameter.grid.iter().map(|v| (v - first).abs()).fold(0.0, f64::max);
            let sd = if reach > 0.0 { reach } else { first.abs().max(1.0) };
            EffectPrior { transform: Transform::Linear, mean: first, sd }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use starlings_models::EffectState;

    fn effect(parameters: Vec<EffectParameter>) -> EffectDef {
        EffectDef { name: "e".to_owned(), parameters, ..EffectDef::default() }
    }

    fn with(range: [f64; 2], grid: &[f64]) -> EffectParameter {
        EffectParameter { range, grid: grid.to_vec(), ..EffectParameter::default() }
    }

    #[test]
    fn the_grids_of_the_parameters_inside_a_term_become_points_with_the_middle_first() {
        let open = [f64::NEG_INFINITY, f64::INFINITY];
        let parameters = vec![with([0.0, 1.0], &[]), with(open, &[1.0, 2.0, 3.0]), with(open, &[5.0, 6.0])];
        let candidate = Candidate::new(effect(parameters));
        assert_eq!(candidate.points[0], [2.0, 6.0]);
        assert_eq!(candidate.points.len(), 6);
        assert!((candidate.sign() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_store_that_its_amplitude_fills_moves_a_state_of_its_own() {
        let of = |rate: &str| {
            let amplitude = EffectParameter { name: "a".to_owned(), ..EffectParameter::default() };
            let state = EffectState { name: "s".to_owned(), rate: rate.to_owned(), ..EffectState::default() };
            Candidate::new(EffectDef { states: vec![state], ..effect(vec![amplitude]) }).moves_own_state()
        };
        assert!(of("r*a*(x - s)") && !of("(x - s)/tau"));
    }

    #[test]
    fn a_thinned_product_of_grids_keeps_every_value_of_every_grid() {
        let open = [f64::NEG_INFINITY, f64::INFINITY];
        for sizes in [
            &[3, 3, 3][..],
            &[4, 3],
            &[3, 4],
            &[4, 4],
            &[5, 5],
            &[5, 2],
            &[7, 4],
            &[2, 9],
            &[2, 2, 3],
            &[3, 3, 2],
        ] {
            let grids: Vec<Vec<f64>> = sizes.iter().map(|n| (0..*n).map(f64::from).collect()).collect();
            let inner = grids.iter().map(|grid| with(open, grid));
            let points =
                Candidate::new(effect(std::iter::once(with(open, &[])).chain(inner).collect())).points;
            assert!(points.len() <= MOST_POINTS, "{sizes:?}");
            for (k, grid) in grids.iter().enumerate() {
                let kept = |value: &f64| points.iter().any(|p| p[k].to_bits() == value.to_bits());
                assert!(grid.iter().all(kept), "{sizes:?}, grid {k}: {points:?}");
            }
            for (i, point) in points.iter().enumerate() {
                assert!(!points[..i].contains(point), "{sizes:?}: {point:?} twice");
            }
        }
    }

    #[test]
    fn a_parameter_with_two_bounds_stays_within_them_whatever_the_fit_tries() {
        let prior = Candidate::new(effect(vec![with([0.0, 1.0], &[]), with([2.0, 4.0], &[2.5])])).priors();
        let far = prior[1].transform.to_physical(prior[1].mean + 50.0 * prior[1].sd);
        assert!(far < 4.0 && (prior[1].transform.to_physical(prior[1].mean) - 3.0).abs() < 1e-12);
    }
}
