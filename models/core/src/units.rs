//! Unit labels that travel with numbers: what a label such as `mmHg s/mL` stands for, so that labels can be compared.
//!
//! No number is ever converted: a study's numbers are taken as they stand, and a label that cannot be read is only a label.
//! A plane angle counts as a number and a temperature in °C as one in K, since only differences are compared. Next file to
//! read: [`self::parse`] for what is understood, [`self::table`] for the symbols, [`self::labels`] for equations.

mod labels;
mod parse;
mod products;
mod system;
mod table;

pub use labels::{Labels, Mismatch};
pub use products::product;
pub use system::consistent;

/// Symbols of the base units, in the order of [`Unit::exponents`].
const BASE: [&str; 7] = ["m", "kg", "s", "A", "K", "mol", "cd"];

/// Exponents closer than this are the same; they are sums of a few small fractions.
const EXPONENT: f64 = 1e-9;

/// Factors closer than this, relatively, are the same: the definitions of mmHg and Torr agree to 1.5e-7.
const FACTOR: f64 = 1e-6;

/// Labels that a computed unit is told by, where one of them fits.
const FAMILIAR: [&str; 28] = [
    "m/s",
    "m/s^2",
    "N",
    "N/m",
    "N s/m",
    "Pa",
    "J",
    "W",
    "V",
    "A",
    "ohm",
    "C",
    "m^3",
    "m^3/s",
    "Pa s",
    "Pa s/m^3",
    "m^3/Pa",
    "mm",
    "mm/s",
    "mmHg",
    "mL",
    "mL/s",
    "mmHg/s",
    "mmHg s/mL",
    "mL/mmHg",
    "dyn/cm^2",
    "dyn s/cm^5",
    "cm^5/dyn",
];

/// What a unit label stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// The unit in the SI unit of its dimension: 1e-6 for mL.
    pub factor: f64,
    /// Exponents of m, kg, s, A, K, mol and cd.
    pub exponents: [f64; 7],
}

impl Unit {
    /// The unit of a plain number.
    pub(crate) const ONE: Self = Self { factor: 1.0, exponents: [0.0; 7] };

    /// Reads a label; nothing for one that is empty, unknown or ambiguous (`J/kg K`: write `J/(kg K)`).
    pub fn parse(label: &str) -> Option<Self> {
        parse::parse(label)
    }

    /// The unit of a product.
    #[must_use]
    pub(crate) fn times(self, other: Self) -> Self {
        let exponents = std::array::from_fn(|i| self.exponents[i] + other.exponents[i]);
        Self { factor: self.factor * other.factor, exponents }
    }

    /// The unit of a power.
    #[must_use]
    pub(crate) fn power(self, exponent: f64) -> Self {
        Self { factor: self.factor.powf(exponent), exponents: self.exponents.map(|e| e * exponent) }
    }

    /// Whether both measure the same kind of quantity.
    pub fn same_dimension(&self, other: &Self) -> bool {
        self.exponents.iter().zip(&other.exponents).all(|(a, b)| (a - b).abs() < EXPONENT)
    }

    /// Whether both are the same unit, however they are written.
    pub fn same(&self, other: &Self) -> bool {
        self.same_dimension(other) && (self.factor / other.factor - 1.0).abs() < FACTOR
    }

    /// A label for the unit: a familiar one where there is one, else base units behind the factor.
    pub fn text(&self) -> String {
        if let Some(label) = self.familiar() {
            return label.to_owned();
        }
        let part = |sign: f64| -> Vec<String> {
            let raised = |(symbol, e): (&&str, &f64)| {
                let e = sign * e;
                (e > EXPONENT).then(|| {
                    if (e - 1.0).abs() < EXPONENT { (*symbol).to_owned() } else { format!("{symbol}^{e}") }
                })
            };
            BASE.iter().zip(&self.exponents).filter_map(raised).collect()
        };
        let (mut above, below) = (part(1.0), part(-1.0));
        let scaled = (self.factor - 1.0).abs() >= FACTOR;
        if scaled {
            above.insert(0, rounded(self.factor, 6).to_string());
        }
        quotient(&above, &below)
    }

    /// The familiar label that fits.
    fn familiar(&self) -> Option<&'static str> {
        let fits = |label: &&&str| Self::parse(label).is_some_and(|unit| unit.same(self));
        FAMILIAR.iter().find(fits).copied()
    }
}

/// Factors over factors as a label that can be read again.
fn quotient(above: &[String], below: &[String]) -> String {
    let above = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
    match below {
        [] if above == "1" => "a plain number".to_owned(),
        [] => above,
        [one] => format!("{above}/{one}"),
        many => format!("{above}/({})", many.join(" ")),
    }
}

/// A label as it follows a number, behind a blank; nothing for a plain number, whose label is empty or `1`.
pub fn spaced(label: &str) -> String {
    if matches!(label, "" | "1") { String::new() } else { format!(" {label}") }
}

/// `value` to so many significant digits, at least one: what is then written has no more of them.
pub fn rounded(value: f64, digits: usize) -> f64 {
    // Written and read again, so that 0.30000000000000004 is 0.3.
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}
