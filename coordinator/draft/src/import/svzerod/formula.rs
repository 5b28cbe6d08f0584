//! Expressions that a file has in place of the values of a boundary condition (`fn`), in the language of ExprTk.
//!
//! They are evaluated by the expressions of studies; functions that those lack are replaced by their values first. Next file to
//! read: [`super::signal`].

use starlings_models::Drive;
use starlings_models::equations::{At, Expression};

use super::super::plan::Samples;

/// Intervals of a period: lines between the samples of a sine are off by 5·10⁻⁶ of it.
const INTERVALS: usize = 1000;
/// Characters of an expression at most.
const LONGEST: usize = 1000;
/// Change of an expression after a period, in parts of its largest value, that is rounding.
const ROUNDING: f64 = 1e-6;

/// An expression of the time `t`.
#[derive(Clone, Debug)]
pub(super) struct Formula {
    text: String,
}

impl Formula {
    /// Reads an expression; capitals are small letters there.
    pub(super) fn new(text: &str) -> Result<Self, String> {
        if text.len() > LONGEST {
            return Err(format!("{} characters are more than an expression has ({LONGEST})", text.len()));
        }
        let formula = Self { text: text.to_lowercase() };
        value(&formula.text, 0.0)?;
        Ok(formula)
    }

    /// One period of an input.
    pub(super) fn samples(&self, name: &str, period: f64) -> Result<Samples, String> {
        let times: Vec<f64> = (0..=INTERVALS).map(|k| period * k as f64 / INTERVALS as f64).collect();
        let at =
            |shift: f64| times.iter().map(|t| value(&self.text, t + shift)).collect::<Result<Vec<_>, _>>();
        let (mut values, next) = (at(0.0)?, at(period)?);
        let size = values.iter().fold(0.0, |size: f64, v| size.max(v.abs()));
        let change = values.iter().zip(&next).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        if change > ROUNDING * size {
            return Err(format!(
                "`{}` does not repeat after the period of {period} (simulation_parameters.cardiac_period): it changes by {change:.3e}",
                self.text
            ));
        }
        // The end is the start of the next period.
        values[INTERVALS] = values[0];
        Ok(Samples { name: name.to_owned(), times, values })
    }
}

/// A function of its arguments.
type Function = fn(&[f64]) -> f64;

/// Functions of ExprTk that the expressions of a study lack, with how many arguments they have.
const OTHERS: [(&str, usize, Function); 13] = [
    ("asin", 1, |v| v[0].asin()),
    ("acos", 1, |v| v[0].acos()),
    ("atan", 1, |v| v[0].atan()),
    ("atan2", 2, |v| v[0].atan2(v[1])),
    ("sinh", 1, |v| v[0].sinh()),
    ("cosh", 1, |v| v[0].cosh()),
    ("log10", 1, |v| v[0].log10()),
    ("log2", 1, |v| v[0].log2()),
    ("pow", 2, |v| v[0].powf(v[1])),
    ("floor", 1, |v| v[0].floor()),
    ("ceil", 1, |v| v[0].ceil()),
    ("round", 1, |v| v[0].round()),
    ("sgn", 1, |v| if v[0] == 0.0 { 0.0 } else { v[0].signum() }),
];

/// The value of an expression at a time.
fn value(text: &str, t: f64) -> Result<f64, String> {
    let mut text = text.to_owned();
    while let Some(call) = Call::first(&text) {
        let values = call.arguments.iter().map(|part| value(part, t)).collect::<Result<Vec<_>, _>>()?;
        if values.len() != call.count {
            return Err(format!("`{}` has {} argument(s), not {}", call.name, call.count, values.len()));
        }
        text.replace_range(call.place, &format!("({:?})", (call.function)(&values)));
    }
    let told = |error: starlings_models::equations::ExpressionError| format!("`{text}` {error}");
    let program = Expression::parse(&text).map_err(told)?.compile(&|_| None, &|_| None).map_err(told)?;
    let value = program.eval(&At { t, x: &[], theta: &[], u: Drive::NONE, y: &[] });
    if value.is_finite() { Ok(value) } else { Err(format!("`{text}` is {value} at t = {t}")) }
}

/// A call of one of the others.
struct Call {
    name: &'static str,
    count: usize,
    function: Function,
    arguments: Vec<String>,
    place: std::ops::Range<usize>,
}

impl Call {
    /// The first in a text, if its parentheses close.
    fn first(text: &str) -> Option<Self> {
        let mut from = 0;
        for word in text.split_inclusive(|c: char| !(c.is_ascii_alphanumeric() || c == '_')) {
            let (name, start) =
                (word.trim_end_matches(|c: char| !(c.is_ascii_alphanumeric() || c == '_')), from);
            from += word.len();
            let Some((name, count, function)) = OTHERS.into_iter().find(|(other, ..)| *other == name) else {
                continue;
            };
            let open = start + text[start..].find('(')?;
            if !text[start + name.len()..open].trim().is_empty() {
                continue;
            }
            let (arguments, end) = arguments(text, open)?;
            return Some(Self { name, count, function, arguments, place: start..end });
        }
        None
    }
}

/// What stands between the commas of a call from its opening parenthesis on, and where the call ends.
fn arguments(text: &str, open: usize) -> Option<(Vec<String>, usize)> {
    let (mut depth, mut list, mut start) = (0_usize, Vec::new(), open + 1);
    for (at, c) in text.char_indices().skip_while(|(at, _)| *at < open) {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        if depth == 0 || depth == 1 && c == ',' {
            list.push(text[start..at].to_owned());
            start = at + 1;
        }
        if depth == 0 {
            return Some((list, at + 1));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_expression_is_that_of_the_other_program() {
        let cases = [
            (
                "2*(4*ATAN(1.))*COS(2*(4*ATAN(1.))*t)",
                2.0 * std::f64::consts::PI * (0.25 * 2.0 * std::f64::consts::PI).cos(),
            ),
            ("pow(t, 2) + atan2(t, floor(1.5))", 0.0625 + 0.25_f64.atan()),
            ("if(t < 0.5, sinh(t), 7)", 0.25_f64.sinh()),
            ("-2^2 + atan (atan(t))", -4.0 + 0.25_f64.atan().atan()),
        ];
        for (text, wanted) in cases {
            let found = value(&text.to_lowercase(), 0.25).unwrap();
            assert!((found - wanted).abs() < 1e-12, "{text}: {found}");
        }
    }

    #[test]
    fn an_expression_that_is_none_is_told() {
        for (text, words) in [
            ("2*", "at column"),
            ("flow(t)", "flow"),
            ("1/t", "is inf"),
            ("pow(t)", "2 argument"),
            ("atan(t", "atan"),
        ] {
            let fault = Formula::new(text).unwrap_err();
            assert!(fault.contains(words), "{text}: {fault}");
        }
        assert!(Formula::new(&"1+".repeat(600)).unwrap_err().contains("characters"));
    }

    #[test]
    fn an_expression_has_to_repeat_with_the_period() {
        let formula = Formula::new("sin(2*pi*t/0.8)").unwrap();
        let samples = formula.samples("q", 0.8).unwrap();
        assert!((samples.values[INTERVALS / 4] - 1.0).abs() < 1e-12);
        assert!(formula.samples("q", 1.0).unwrap_err().contains("does not repeat"));
    }
}
