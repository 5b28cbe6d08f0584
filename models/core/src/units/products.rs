//! The label of a product in the symbols of its factors, as people who wrote these would write it: `L/(mol min)`, and not in base units.
//!
//! Next file to read: [`super::parse`].

use super::{EXPONENT, Unit};

/// The label of a product of powers of labelled units; empty for a plain number, and where a label cannot be read.
pub fn product(factors: &[(&str, f64)]) -> String {
    let mut unit = Unit::ONE;
    for (label, power) in factors.iter().filter(|(_, power)| power.abs() > 0.0) {
        let Some(of) = Unit::parse(label) else { return String::new() };
        unit = unit.times(of.power(*power));
    }
    if unit.same(&Unit::ONE) {
        return String::new();
    }
    let own = || symbols(factors).map(|merged| written(&merged));
    let is_right = |text: &String| Unit::parse(text).is_some_and(|of| of.same(&unit));
    unit.familiar().map(str::to_owned).or_else(|| own().filter(is_right)).unwrap_or_else(|| unit.text())
}

/// The symbols of all labels with their powers, each once and those that cancel left out; nothing where a label is not so simple.
fn symbols(factors: &[(&str, f64)]) -> Option<Vec<(String, f64)>> {
    let mut merged: Vec<(String, f64)> = Vec::new();
    for (label, power) in factors {
        let (above, below) = label.split_once('/').unwrap_or((label, ""));
        let below = below.trim().trim_start_matches('(').trim_end_matches(')');
        for (side, sign) in [(above, *power), (below, -power)] {
            for word in side.split([' ', '*', '·']).filter(|word| !word.is_empty() && *word != "1") {
                let (symbol, raised) = word.split_once('^').unwrap_or((word, "1"));
                let by = sign * raised.parse::<f64>().ok()?;
                match merged.iter_mut().find(|(known, _)| known == symbol) {
                    Some((_, sum)) => *sum += by,
                    None => merged.push((symbol.to_owned(), by)),
                }
            }
        }
    }
    merged.retain(|(_, power)| power.abs() > EXPONENT);
    Some(merged)
}

fn written(symbols: &[(String, f64)]) -> String {
    let side = |sign: f64| -> Vec<String> {
        let raised = |(symbol, power): &(String, f64)| {
            let power = sign * power;
            (power > 0.0).then(|| {
                if (power - 1.0).abs() < EXPONENT { symbol.clone() } else { format!("{symbol}^{power}") }
            })
        };
        symbols.iter().filter_map(raised).collect()
    };
    super::quotient(&side(1.0), &side(-1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_is_told_in_the_symbols_of_its_factors() {
        // The rate of a concentration over its square, over itself, over a temperature.
        assert_eq!(product(&[("mol/L", 1.0), ("min", -1.0), ("mol/L", -2.0)]), "L/(mol min)");
        assert_eq!(product(&[("mol/L", 1.0), ("min", -1.0), ("mol/L", -1.0)]), "1/min");
        assert_eq!(product(&[("mol/L", 1.0), ("h", -1.0), ("K", -1.0)]), "mol/(L h K)");
        assert_eq!(product(&[("kg/(m^2 day)", 1.0), ("kg", -0.5)]), "kg^0.5/(m^2 day)");
    }

    #[test]
    fn a_familiar_unit_is_told_by_its_name_and_a_plain_number_by_none() {
        assert_eq!(product(&[("kg", 1.0), ("m", 1.0), ("s", -2.0)]), "N");
        assert_eq!(product(&[("m", 1.0), ("m", -1.0)]), "");
        assert_eq!(product(&[("m", 1.0), ("what", -1.0)]), "");
    }

    #[test]
    fn symbols_that_are_one_unit_cancel_by_what_they_stand_for() {
        // In base units where the symbols alone would read oddly or wrongly.
        assert_eq!(product(&[("L", 1.0), ("dm^3", -1.0)]), "");
        for factors in [[("km2", 1.0), ("s", -1.0)], [("mmHg s/mL", 1.0), ("mL", -1.0)]] {
            let unit = Unit::parse(factors[0].0).unwrap();
            let wanted = unit.times(Unit::parse(factors[1].0).unwrap().power(-1.0));
            assert!(Unit::parse(&product(&factors)).unwrap().same(&wanted), "{}", product(&factors));
        }
    }
}
