//! The gate of ranges: an estimate at the end of what physics allows, or of the range in which it is sought.
//!
//! Next file to read: [`super::gates`].

use starlings_models::effect::EffectParameter;
use starlings_models::units::spaced;

use super::gates::Refusal;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::model_variant::AddedEffect;
use crate::number::three;

/// Distance from the end of a range, as a share of its width, of one that begins above zero in the logarithm, within which an estimate counts as
/// at the end.
const EDGE: f64 = 0.005;

/// The refusal for a coefficient at the end of its range.
pub(super) fn at_edge(fit: &FittedVariant<'_>) -> Option<Refusal> {
    let variant = &fit.variant;
    let theta = fit.theta();
    for (m, effect) in variant.effects.iter().enumerate() {
        for (k, parameter) in effect.candidate.def.parameters.iter().enumerate() {
            let j = variant.first_entry_of(m) + k;
            let value = variant.study.theta[j].transform.to_physical(theta[j]);
            let Some(end) = end_at(effect, k, value) else { continue };
            return Some(refusal(parameter, k == 0, end));
        }
    }
    None
}

/// The refusal for a parameter at an end of its range: of an amplitude at zero, the sign.
fn refusal(parameter: &EffectParameter, is_amplitude: bool, end: f64) -> Refusal {
    let (gate, of, what) = if is_amplitude && end.abs() < f64::MIN_POSITIVE {
        ("sign", "what physics allows", "physics")
    } else {
        ("range", "its range", "value")
    };
    let reason = format!(
        "the best value of {} lies at the end of {of} ({}{}): the shape fits, the {what} does not",
        parameter.name,
        three(end),
        spaced(&parameter.unit)
    );
    Refusal { gate, reason }
}

/// The end of the range of an effect's parameter `k` at which a value lies. Where the range is open at one side, the unit of the
/// amplitude takes the place of its width, or the value at which an inner parameter was screened. A corner that is not rounded is none.
fn end_at(effect: &AddedEffect<'_>, k: usize, value: f64) -> Option<f64> {
    let candidate = effect.candidate;
    let parameter = &candidate.def.parameters[k];
    let [lo, hi] = parameter.range;
    let ends = if parameter.is_rounding { [hi, hi] } else { [lo, hi] };
    // A range from a hundredth to twenty spans factors: what is ten times its lower end is not at that end.
    if lo > 0.0 && hi.is_finite() {
        return ends.into_iter().find(|end| (value / end).ln().abs() <= EDGE * (hi / lo).ln());
    }
    let size = if k == 0 { effect.unit } else { candidate.points[0][k - 1].abs() };
    let width = if lo.is_finite() && hi.is_finite() { hi - lo } else { size };
    // The upper end of an amplitude may be far above any that the data could show: that says nothing of how close to zero one is.
    let near = |end: f64| if k == 0 && end.abs() < f64::MIN_POSITIVE { width.min(size) } else { width };
    ends.into_iter().find(|end| end.is_finite() && (value - end).abs() <= EDGE * near(*end))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::candidate::Candidate;
    use starlings_models::EffectDef;

    #[test]
    fn an_amplitude_at_zero_lacks_its_sign_and_any_other_end_is_one_of_a_range() {
        let parameter =
            EffectParameter { name: "tau".to_owned(), unit: "min".to_owned(), ..EffectParameter::default() };
        let of = |is_amplitude, end| {
            let Refusal { gate, reason } = refusal(&parameter, is_amplitude, end);
            format!("{gate}: {reason}")
        };
        let begin = "the best value of tau lies at the end of";
        assert_eq!(
            of(true, 0.0),
            format!("sign: {begin} what physics allows (0 min): the shape fits, the physics does not")
        );
        assert_eq!(
            of(false, 0.0),
            format!("range: {begin} its range (0 min): the shape fits, the value does not")
        );
        assert_eq!(
            of(true, 300.0),
            format!("range: {begin} its range (300 min): the shape fits, the value does not")
        );
    }

    #[test]
    fn closeness_to_the_end_of_an_open_range_is_measured_in_the_parameters_own_size() {
        let with = |range, grid| EffectParameter { range, grid, ..EffectParameter::default() };
        let (open, wide) = ([0.0, f64::INFINITY], [0.0, 10.0]);
        let parameters = vec![
            with(open, vec![]),
            with([2.0, f64::INFINITY], vec![3.0]),
            with(wide, vec![]),
            EffectParameter { is_rounding: true, ..with(wide, vec![]) },
            with([0.01, 20.0], vec![1.0]),
        ];
        let candidate = Candidate::new(EffectDef { parameters, ..EffectDef::default() });
        let with_end = [4e6, 4.0].map(|end| {
            let parameters = vec![with([0.0, end], vec![])];
            Candidate::new(EffectDef { parameters, ..EffectDef::default() })
        });
        let bounded =
            |unit: f64| AddedEffect { candidate: &with_end[usize::from(unit < 1.0)], index: 0, unit };
        // The amplitude's unit is not that of the threshold inside the term: thousands against ones, or thousandths.
        for unit in [4000.0, 4e-3] {
            let effect = AddedEffect { candidate: &candidate, index: 0, unit };
            assert_eq!(end_at(&effect, 0, 0.004 * unit), Some(0.0));
            assert_eq!(end_at(&effect, 0, 0.006 * unit), None);
            assert_eq!(end_at(&bounded(unit), 0, 0.006 * unit), None, "whatever its upper end");
            assert_eq!(end_at(&bounded(unit), 0, 0.004 * unit), Some(0.0));
            assert_eq!(end_at(&bounded(unit), 0, 0.997e3 * unit), Some(1e3 * unit));
            assert_eq!(end_at(&effect, 1, 2.6), None, "a fifth of its size away, unit {unit}");
            assert_eq!(end_at(&effect, 1, 2.01), Some(2.0), "a three hundredth of it away, unit {unit}");
            assert_eq!(end_at(&effect, 2, 9.96), Some(10.0));
            assert_eq!(end_at(&effect, 2, 9.9), None);
            assert_eq!(
                (end_at(&effect, 2, 0.04), end_at(&effect, 3, 0.04)),
                (Some(0.0), None),
                "a sharp corner"
            );
            assert_eq!(end_at(&effect, 3, 9.96), Some(10.0));
            assert_eq!(
                (end_at(&effect, 4, 0.0102), end_at(&effect, 4, 0.091)),
                (Some(0.01), None),
                "factors"
            );
        }
    }
}
