//! From a label to a [`Unit`].
//!
//! A product is written with `*`, `·` or a space, a quotient with `/`, a power as `cm^5`, `cm⁵` or `cm5`; `mmHg s/mL`,
//! `kg/(m s)`, `1/s`. A factor behind a quotient without parentheses is refused, since people read it both ways. Powers of
//! ten are counted, not multiplied, so that factors come out exactly. Next file to read: [`super::table`].

use super::{EXPONENT, Unit, table};

/// Nested deeper than this is no unit.
const MAX_DEPTH: usize = 8;

/// Reads a label.
pub(super) fn parse(label: &str) -> Option<Unit> {
    let chars: Vec<char> = label.trim().chars().collect();
    let mut parser = Parser { chars, at: 0, depth: 0 };
    let value = parser.product()?;
    (parser.at == parser.chars.len()).then(|| value.unit()).filter(|u| u.factor.is_normal())
}

/// A unit in the making: `mantissa` · 10^`decade`.
#[derive(Clone, Copy)]
struct Value {
    mantissa: f64,
    decade: f64,
    exponents: [f64; 7],
}

impl Value {
    fn number(mantissa: f64) -> Self {
        Self { mantissa, decade: 0.0, exponents: [0.0; 7] }
    }

    fn times(self, other: Self) -> Self {
        Self {
            mantissa: self.mantissa * other.mantissa,
            decade: self.decade + other.decade,
            exponents: std::array::from_fn(|i| self.exponents[i] + other.exponents[i]),
        }
    }

    fn power(self, n: f64) -> Self {
        Self {
            mantissa: self.mantissa.powf(n),
            decade: self.decade * n,
            exponents: self.exponents.map(|e| e * n),
        }
    }

    fn unit(self) -> Unit {
        let whole = self.decade.round();
        let factor = if (self.decade - whole).abs() > EXPONENT {
            self.mantissa * 10f64.powf(self.decade)
        } else if whole < 0.0 {
            self.mantissa / 10f64.powi(-whole as i32)
        } else {
            self.mantissa * 10f64.powi(whole as i32)
        };
        Unit { factor, exponents: self.exponents }
    }
}

struct Parser {
    chars: Vec<char>,
    at: usize,
    depth: usize,
}

impl Parser {
    fn peek(&self) -> Option<char> {
        self.chars.get(self.at).copied()
    }

    fn spaces(&mut self) {
        while self.peek().is_some_and(char::is_whitespace) {
            self.at += 1;
        }
    }

    /// Factors up to the end or a closing parenthesis.
    fn product(&mut self) -> Option<Value> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return None;
        }
        let mut value = self.factor()?;
        let mut divided = false;
        loop {
            self.spaces();
            match self.peek() {
                None | Some(')') => break,
                Some('/') => {
                    self.at += 1;
                    divided = true;
                    value = value.times(self.factor()?.power(-1.0));
                }
                // `a/b c` is read in two ways.
                Some(_) if divided => return None,
                Some('*' | '·' | '⋅') => {
                    self.at += 1;
                    value = value.times(self.factor()?);
                }
                Some(_) => value = value.times(self.factor()?),
            }
        }
        self.depth -= 1;
        Some(value)
    }

    /// A number, a symbol or a parenthesis, with its power.
    fn factor(&mut self) -> Option<Value> {
        self.spaces();
        let base = match self.peek()? {
            '(' => {
                self.at += 1;
                let inside = self.product()?;
                (self.peek() == Some(')')).then_some(())?;
                self.at += 1;
                inside
            }
            c if c.is_ascii_digit() => self.number()?,
            _ => self.symbol()?,
        };
        Some(base.power(self.exponent()?))
    }

    fn number(&mut self) -> Option<Value> {
        let text = self.taken(|c| c.is_ascii_digit() || c == '.');
        text.parse::<f64>().ok().filter(|v| *v > 0.0).map(Value::number)
    }

    /// The longest symbol, with digits that belong to it (`cmH2O`) or are its power (`m3`, `s-1`).
    fn symbol(&mut self) -> Option<Value> {
        let word = self.taken(|c| c.is_alphabetic() || c.is_ascii_digit() || "%°₂".contains(c));
        if let Some(found) = value(&word) {
            let follows = self.chars.get(self.at + 1).is_some_and(char::is_ascii_digit);
            if self.peek() == Some('-') && follows {
                self.at += 1;
                let power = self.taken(|c| c.is_ascii_digit()).parse::<f64>().ok()?;
                return Some(found.power(-power));
            }
            return Some(found);
        }
        let stem = word.trim_end_matches(|c: char| c.is_ascii_digit());
        let power = word[stem.len()..].parse::<f64>().ok()?;
        Some(value(stem)?.power(power))
    }

    /// `^2`, `^-1`, `^0.5`, `^(1/2)`, `²`, `⁻¹`, or nothing, which is 1.
    fn exponent(&mut self) -> Option<f64> {
        let mut raised = self.taken(|c| superscript(c).is_some());
        if !raised.is_empty() {
            raised = raised.chars().filter_map(superscript).collect();
            return raised.parse().ok();
        }
        if self.peek() != Some('^') {
            return Some(1.0);
        }
        self.at += 1;
        if self.peek() != Some('(') {
            return self.taken(|c| c.is_ascii_digit() || "+-.".contains(c)).parse().ok();
        }
        self.at += 1;
        let inside = self.taken(|c| c != ')');
        self.at += 1;
        let (above, below) = inside.split_once('/').unwrap_or((&inside, "1"));
        let (above, below) = (above.trim().parse::<f64>().ok()?, below.trim().parse::<f64>().ok()?);
        (below > 0.0 && self.at <= self.chars.len()).then_some(above / below)
    }

    /// The characters from here on that belong together.
    fn taken(&mut self, belongs: impl Fn(char) -> bool) -> String {
        let text: String = self.chars[self.at..].iter().take_while(|c| belongs(**c)).collect();
        self.at += text.chars().count();
        text
    }
}

fn value(symbol: &str) -> Option<Value> {
    let found = table::symbol(symbol)?;
    Some(Value {
        mantissa: found.mantissa,
        decade: f64::from(found.decade),
        exponents: found.exponents.map(f64::from),
    })
}

/// The plain character of a superscript one.
fn superscript(c: char) -> Option<char> {
    let at = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻".chars().position(|s| s == c)?;
    "0123456789-".chars().nth(at)
}
