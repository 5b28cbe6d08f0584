//! In what the numbers of an effect's parameter are counted, and how they become numbers of the model.
//!
//! A built-in effect does not know how far a recording moves: the threshold of an overflow is a share of the level's course,
//! a delay counts sampling intervals. [`resolve`] turns them into the model's own units, given the courses of a run without
//! the effect. What a study writes itself is absolute. Next file to read: [`mod@super::library`].

use serde::{Deserialize, Serialize};

use super::{EffectDef, EffectParameter};

/// In what the range and the grid of a parameter are counted.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// In the parameter's own unit.
    #[default]
    Absolute,
    /// On the course of the named state, output or input: 0 is its smallest value, 1 its largest.
    Range(String),
    /// In half the distance between the smallest and the largest value of the named state, output or input.
    Amplitude(String),
    /// An instant of the record: 0 is its start, 1 its end.
    Record,
    /// The same, sought only where what a model leaves jumps.
    Jump,
    /// A length of time: 1 is the whole record.
    Duration,
    /// A length of time in sampling intervals.
    Sampling,
}

impl EffectParameter {
    /// Range and grid in words of a table, with what they are counted in: `0 to 1 of the range of h, tried 0.25, 0.5`.
    pub fn range_text(&self) -> String {
        let mut quantity = crate::Quantity::new(&self.name, &self.unit);
        quantity.range = self.range;
        let counted = match &self.scale {
            Scale::Absolute => String::new(),
            Scale::Range(name) => format!(" on the course of {name}"),
            Scale::Amplitude(name) => format!(" amplitudes of {name}"),
            Scale::Record | Scale::Jump => " of the way through the record".to_owned(),
            Scale::Duration => " lengths of the record".to_owned(),
            Scale::Sampling => " sampling intervals".to_owned(),
        };
        if self.range[0] >= self.range[1] {
            return format!("fixed at {}{counted}", self.range[0]);
        }
        if self.scale == Scale::Jump {
            return format!("{}{counted}, tried where what a model leaves jumps", quantity.range_text());
        }
        let tried: Vec<String> = self.grid.iter().map(f64::to_string).collect();
        let tried = if tried.is_empty() { String::new() } else { format!(", tried {}", tried.join(", ")) };
        format!("{}{counted}{tried}", quantity.range_text())
    }
}

/// What the run of a model without the effect tells of its scales.
#[derive(Clone, Copy)]
struct Course<'a> {
    of: &'a dyn Fn(&str) -> Option<[f64; 2]>,
    record: [f64; 2],
    sampling: f64,
}

impl Course<'_> {
    /// The values that the numbers 0 and 1 stand for; nothing where the course is unknown or does not move.
    fn ends(self, scale: &Scale) -> Option<[f64; 2]> {
        let [start, end] = self.record;
        let [zero, one] = match scale {
            Scale::Absolute => [0.0, 1.0],
            Scale::Range(name) => (self.of)(name)?,
            Scale::Amplitude(name) => (self.of)(name).map(|[lo, hi]| [0.0, 0.5 * (hi - lo)])?,
            Scale::Record | Scale::Jump => [start, end],
            Scale::Duration => [0.0, end - start],
            Scale::Sampling => [0.0, self.sampling],
        };
        (zero.is_finite() && one.is_finite() && one > zero).then_some([zero, one])
    }
}

/// The effect with the grids and ranges of its parameters in the model's units.
///
/// `course` gives the smallest and the largest value of a state, output or input in a run of the model without the effect,
/// `record` the first and the last time, `sampling` the interval between observations. A parameter keeps its scale where the
/// course that it counts in is unknown or constant: see [`is_resolved`].
pub fn in_units(
    def: &EffectDef,
    course: &dyn Fn(&str) -> Option<[f64; 2]>,
    record: [f64; 2],
    sampling: f64,
) -> EffectDef {
    let course = Course { of: course, record, sampling };
    let mut resolved = def.clone();
    for parameter in &mut resolved.parameters {
        if let Some([zero, one]) = course.ends(&parameter.scale) {
            let absolute = |v: f64| if v.is_finite() { (one - zero).mul_add(v, zero) } else { v };
            parameter.range = parameter.range.map(absolute);
            parameter.grid = parameter.grid.iter().map(|v| absolute(*v)).collect();
            parameter.scale = Scale::Absolute;
        }
    }
    resolved
}

/// As [`in_units`], and a parameter whose range is one point, which is no unknown, is written into the terms as a number.
pub fn resolve(
    def: &EffectDef,
    course: &dyn Fn(&str) -> Option<[f64; 2]>,
    record: [f64; 2],
    sampling: f64,
) -> EffectDef {
    let mut resolved = in_units(def, course, record, sampling);
    let known = |p: &EffectParameter| p.scale == Scale::Absolute && p.range[0] >= p.range[1];
    let (fixed, free): (Vec<_>, Vec<_>) = resolved.parameters.into_iter().partition(known);
    resolved.parameters = free;
    for parameter in fixed {
        let value = parameter.range[0];
        let text = if value < 0.0 { format!("({value:?})") } else { format!("{value:?}") };
        let write = |term: &mut String| *term = written(term, &parameter.name, &text);
        resolved.adds.iter_mut().for_each(|add| write(&mut add.term));
        resolved.states.iter_mut().for_each(|state| {
            write(&mut state.rate);
            write(&mut state.initial);
        });
    }
    resolved
}

/// Whether every parameter counts in the model's units.
pub fn is_resolved(def: &EffectDef) -> bool {
    def.parameters.iter().all(|parameter| parameter.scale == Scale::Absolute)
}

/// An expression with a name replaced by a text.
fn written(expression: &str, name: &str, text: &str) -> String {
    let mut result = String::with_capacity(expression.len());
    let inside = |c: char| c.is_alphanumeric() || c == '_';
    let mut done = 0;
    for (at, _) in expression.match_indices(name) {
        let behind = at + name.len();
        // A digit before may end a number, but then a sign or an operator stands between.
        if !expression[..at].ends_with(inside) && !expression[behind..].starts_with(inside) {
            result.push_str(&expression[done..at]);
            result.push_str(text);
            done = behind;
        }
    }
    result + &expression[done..]
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "scaling by 0, 1 and powers of two is exact")]
mod tests {
    use super::*;
    use crate::effect::Addition;

    fn parameter(name: &str, range: [f64; 2], grid: &[f64], scale: Scale) -> EffectParameter {
        let name = name.to_owned();
        EffectParameter { name, range, grid: grid.to_vec(), scale, ..EffectParameter::default() }
    }

    fn with(parameters: Vec<EffectParameter>, term: &str) -> EffectDef {
        let add = Addition { to: "h".to_owned(), term: term.to_owned() };
        EffectDef { parameters, adds: vec![add], ..EffectDef::default() }
    }

    /// `h` runs from 2 to 6, `still` stays at 3.
    fn course(name: &str) -> Option<[f64; 2]> {
        match name {
            "h" => Some([2.0, 6.0]),
            "still" => Some([3.0, 3.0]),
            _ => None,
        }
    }

    fn resolved(scale: Scale) -> EffectParameter {
        let def = with(vec![parameter("a", [0.0, 2.0], &[0.25, 0.5], scale)], "a");
        resolve(&def, &course, [10.0, 26.0], 0.5).parameters[0].clone()
    }

    #[test]
    fn every_scale_becomes_numbers_of_the_model() {
        let cases = [
            (Scale::Absolute, [0.0, 2.0], [0.25, 0.5]),
            (Scale::Range("h".to_owned()), [2.0, 10.0], [3.0, 4.0]),
            (Scale::Amplitude("h".to_owned()), [0.0, 4.0], [0.5, 1.0]),
            (Scale::Record, [10.0, 42.0], [14.0, 18.0]),
            (Scale::Duration, [0.0, 32.0], [4.0, 8.0]),
            (Scale::Sampling, [0.0, 1.0], [0.125, 0.25]),
        ];
        for (scale, range, grid) in cases {
            let found = resolved(scale.clone());
            assert_eq!((found.range, found.grid.as_slice()), (range, grid.as_slice()), "{scale:?}");
            assert_eq!(found.scale, Scale::Absolute);
        }
    }

    #[test]
    fn what_does_not_move_or_is_unknown_has_no_scale() {
        for name in ["still", "nowhere"] {
            let scale = Scale::Range(name.to_owned());
            let found = resolved(scale.clone());
            assert_eq!((found.scale, found.grid), (scale, vec![0.25, 0.5]));
        }
        let def = with(vec![parameter("a", [0.0, 1.0], &[], Scale::Range("still".to_owned()))], "a");
        assert!(!is_resolved(&resolve(&def, &course, [0.0, 1.0], 0.1)));
        assert!(is_resolved(&with(vec![parameter("a", [0.0, 1.0], &[], Scale::Absolute)], "a")));
    }

    #[test]
    fn a_name_inside_a_longer_name_is_not_replaced() {
        for (expression, want) in [
            ("aa*a + a_a - a", "aa*2 + a_a - 2"),
            ("a", "2"),
            ("aaa", "aaa"),
            ("max(a, 3)/a2", "max(2, 3)/a2"),
        ] {
            assert_eq!(written(expression, "a", "2"), want);
        }
        assert_eq!(written("ßa + a", "a", "2"), "ßa + 2");
    }

    #[test]
    fn an_open_bound_stays_open() {
        let def =
            with(vec![parameter("a", [f64::NEG_INFINITY, 1.0], &[], Scale::Range("h".to_owned()))], "a");
        assert_eq!(resolve(&def, &course, [0.0, 1.0], 0.1).parameters[0].range, [f64::NEG_INFINITY, 6.0]);
    }

    #[test]
    fn a_parameter_with_one_possible_value_is_written_into_the_terms() {
        let width = parameter("w", [0.25, 0.25], &[0.25], Scale::Amplitude("h".to_owned()));
        let amplitude = parameter("a_w", [0.0, 1.0], &[], Scale::Absolute);
        let def = with(vec![amplitude, width], "a_w*tanh(h/w) + w*w2");
        let found = resolve(&def, &course, [0.0, 1.0], 0.1);
        assert_eq!(found.adds[0].term, "a_w*tanh(h/0.5) + 0.5*w2");
        assert_eq!(found.parameters.len(), 1);
    }
}
