//! Priors of parameters of which nothing is known but what the model says: default, range, unit.
//!
//! Next file to read: [`super::text`].

use starlings_models::units::Unit;
use starlings_models::{Quantity, Role};

use super::recording::Recording;

/// A prior, as the value of the key of that name.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Prior {
    /// The inline table.
    pub(super) table: String,
    /// Where the median comes from, for a comment.
    pub(super) from: &'static str,
}

/// The prior of a parameter. `scale` is its size as the recording suggests it.
pub(super) fn prior(quantity: &Quantity, scale: Option<f64>) -> Prior {
    let [lo, hi] = quantity.range;
    let (median, from, factor) = match (quantity.default, scale) {
        (Some(value), _) => (Some(value), "the model's default", 2.0),
        (None, Some(value)) => (Some(value), "TODO: the size that the units of the recording suggest", 10.0),
        (None, None) => (None, "TODO: a guess without any ground", 10.0),
    };
    let table = if lo.is_finite() && hi.is_finite() {
        let inside = median.filter(|value| lo < *value && *value < hi).unwrap_or(f64::midpoint(lo, hi));
        format!("{{ transform = \"logit\", lo = {lo:?}, hi = {hi:?}, median = {inside:?}, factor = 3.0 }}")
    } else if lo >= 0.0 || (is_positive(quantity.role) && median.is_none_or(|value| value > 0.0)) {
        let above = median.filter(|value| *value > lo.max(0.0)).unwrap_or_else(|| lo.max(1.0));
        format!("{{ transform = \"log\", median = {above:?}, factor = {factor:?} }}")
    } else {
        // Zero would be the one value at which many models are none.
        let middle = median.unwrap_or(1.0);
        let sd = match (quantity.default, middle.abs() > 0.0) {
            (_, false) => 1.0,
            (Some(_), true) => 0.5 * middle.abs(),
            (None, true) => middle.abs(),
        };
        format!("{{ transform = \"linear\", median = {middle:?}, sd = {sd:?} }}")
    };
    Prior { table, from }
}

/// Whether a quantity of this meaning is above zero.
fn is_positive(role: Role) -> bool {
    use Role::{BurnArea, BurnRate, Compliance, Damping, Inertia, Resistance, Stiffness, ThroatArea};
    matches!(role, Resistance | Compliance | Inertia | Stiffness | Damping | ThroatArea | BurnRate | BurnArea)
}

/// The size of a quantity with this unit, put together from columns and the span of the recording: `mmHg s/mL` is a pressure over a
/// flow. Nothing where no such product has the unit.
pub(super) fn scale(unit: &str, recording: &Recording) -> Option<f64> {
    let wanted = Unit::parse(unit)?;
    let sized = |label: &str, values: &[f64]| {
        let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let square: f64 = finite.iter().map(|v| v * v).sum();
        Some((Unit::parse(label)?, (square / finite.len().max(1) as f64).sqrt()))
            .filter(|(_, size)| *size > 0.0)
    };
    let time = recording.time_unit.as_deref().unwrap_or("s");
    let span = recording.times[recording.times.len() - 1] - recording.times[0];
    let time = sized(time, &[span / 10.0]);
    let columns: Vec<(Unit, f64)> =
        recording.columns.iter().filter_map(|c| sized(&c.unit, &c.values)).collect();
    let one = (Unit { factor: 1.0, exponents: [0.0; 7] }, 1.0);
    let times = [Some(one), time, time.map(|t| over(one, t)), time.map(|t| by(t, t))];
    let singles = columns.iter().copied();
    let pairs = columns.iter().flat_map(|a| columns.iter().map(|b| over(*a, *b)));
    let products: Vec<(Unit, f64)> = std::iter::once(one).chain(singles).chain(pairs).collect();
    let found = times.into_iter().flatten().flat_map(|t| products.iter().map(move |p| by(*p, t)));
    found.filter(|(unit, _)| unit.same(&wanted)).map(|(_, size)| crate::files::rounded(size)).next()
}

fn by(a: (Unit, f64), b: (Unit, f64)) -> (Unit, f64) {
    let exponents = std::array::from_fn(|i| a.0.exponents[i] + b.0.exponents[i]);
    (Unit { factor: a.0.factor * b.0.factor, exponents }, a.1 * b.1)
}

fn over(a: (Unit, f64), b: (Unit, f64)) -> (Unit, f64) {
    let exponents = std::array::from_fn(|i| a.0.exponents[i] - b.0.exponents[i]);
    (Unit { factor: a.0.factor / b.0.factor, exponents }, a.1 / b.1)
}

#[cfg(test)]
mod tests {
    use super::super::recording::Column;
    use super::*;

    #[test]
    fn the_form_of_a_prior_follows_the_range() {
        let table = |quantity: Quantity| prior(&quantity, None).table;
        let q = || Quantity::new("a", "");
        assert_eq!(table(q().positive().default(3.0)), "{ transform = \"log\", median = 3.0, factor = 2.0 }");
        assert_eq!(table(q().positive()), "{ transform = \"log\", median = 1.0, factor = 10.0 }");
        assert!(table(q().range(0.0, 1.0)).contains("lo = 0.0, hi = 1.0, median = 0.5"));
        assert_eq!(table(q().default(-4.0)), "{ transform = \"linear\", median = -4.0, sd = 2.0 }");
        assert_eq!(table(q()), "{ transform = \"linear\", median = 1.0, sd = 1.0 }");
        assert!(table(q().role(Role::Stiffness)).contains("log"));
    }

    #[test]
    fn sizes_follow_from_the_units_of_what_was_measured() {
        let column = |name: &str, unit: &str, value: f64| Column {
            heading: name.to_owned(),
            name: name.to_owned(),
            unit: unit.to_owned(),
            values: vec![value; 3],
        };
        let recording = Recording {
            file: "a.csv".into(),
            time: "t".to_owned(),
            time_unit: Some("s".to_owned()),
            times: vec![0.0, 10.0, 20.0],
            columns: vec![column("p", "mmHg", 100.0), column("q", "mL/s", 50.0)],
            notes: Vec::new(),
            as_it_is: true,
        };
        let close = |unit: &str, wanted: f64| {
            let found = scale(unit, &recording).unwrap_or(f64::NAN);
            assert!((found / wanted - 1.0).abs() < 1e-9, "{unit}: {found}");
        };
        close("mmHg s/mL", 2.0);
        close("mL/mmHg", 1.0);
        close("mmHg", 100.0);
        close("1/s", 0.5);
        assert_eq!(scale("kg", &recording), None);
        assert_eq!(scale("", &recording), None);
    }
}
