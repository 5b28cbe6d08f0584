//! Labels of coefficients, made from the labels of what they join.
//!
//! A label that cannot be read, or is empty, gives an empty one: nothing is guessed. Next file to read: [`super::place`].

use crate::units::Unit;

/// Symbols with their powers, in the order in which they are written.
type Factors = Vec<(String, i32)>;

/// The label of a quotient: `mmHg` over `mL/s` is `mmHg s/mL`; empty for a plain number.
pub(super) fn over(unit: &str, per: &str) -> String {
    product(unit, per, -1)
}

/// The label of a product.
pub(super) fn times(unit: &str, by: &str) -> String {
    product(unit, by, 1)
}

/// The label of a rate.
pub(super) fn per_time(unit: &str, time: &str) -> String {
    if unit.is_empty() { over("1", time) } else { over(unit, time) }
}

/// The label of a power: `m/s` raised to 2 is `m^2/s^2`.
pub(super) fn power(unit: &str, exponent: i32) -> String {
    let Some(base) = Unit::parse(unit) else { return String::new() };
    let raised =
        factors(unit).map(|list| list.into_iter().map(|(symbol, n)| (symbol, n * exponent)).collect());
    label(base.power(f64::from(exponent)), raised)
}

/// The label of a unit times another raised to `sign`.
fn product(unit: &str, other: &str, sign: i32) -> String {
    let Some((a, b)) = Unit::parse(unit).zip(Unit::parse(other)) else { return String::new() };
    let joined = factors(unit).zip(factors(other)).map(|(mut list, others)| {
        for (symbol, n) in others {
            match list.iter_mut().find(|(known, _)| *known == symbol) {
                Some((_, power)) => *power += sign * n,
                None => list.push((symbol, sign * n)),
            }
        }
        list
    });
    label(a.times(b.power(f64::from(sign))), joined)
}

/// The factors of a label that is written plainly, such as `mmHg s/mL` or `kg/(m s^2)`.
fn factors(label: &str) -> Option<Factors> {
    let (above, below) = label.split_once('/').unwrap_or((label, ""));
    let below = below.strip_prefix('(').and_then(|text| text.strip_suffix(')')).unwrap_or(below);
    let signed =
        above.split(' ').map(|factor| (factor, 1)).chain(below.split(' ').map(|factor| (factor, -1)));
    let mut list = Factors::new();
    for (factor, sign) in signed.filter(|(factor, _)| !factor.is_empty() && *factor != "1") {
        let (symbol, exponent) = factor.split_once('^').unwrap_or((factor, "1"));
        list.push((symbol.to_owned(), sign * exponent.parse::<i32>().ok()?));
    }
    Some(list)
}

/// The factors as a label, where they stand for the unit; else its label in base units.
fn label(unit: Unit, factors: Option<Factors>) -> String {
    if unit.same(&Unit::ONE) {
        return String::new();
    }
    let text = factors.map(|list| written(&list)).unwrap_or_default();
    let fits = Unit::parse(&text).is_some_and(|read| read.same(&unit));
    if fits { text } else { unit.text() }
}

fn written(factors: &[(String, i32)]) -> String {
    let part = |sign: i32| -> Vec<String> {
        let raised = |(symbol, n): &(String, i32)| match sign * n {
            1 => Some(symbol.clone()),
            n if n > 1 => Some(format!("{symbol}^{n}")),
            _ => None,
        };
        factors.iter().filter_map(raised).collect()
    };
    let (above, below) = (part(1), part(-1));
    let above = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
    match below.as_slice() {
        [] => above,
        [one] => format!("{above}/{one}"),
        many => format!("{above}/({})", many.join(" ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_written_as_people_write_them() {
        assert_eq!(over("mmHg", "mL/s"), "mmHg s/mL");
        assert_eq!(over("m/s", "m"), "1/s");
        assert_eq!(over("V", "m"), "V/m");
        assert_eq!(over("m/s^2", "m/s"), "1/s");
        assert_eq!(over("m", "m"), "");
        assert_eq!(per_time("m/s", "s"), "m/s^2");
        assert_eq!(per_time("mmHg", "s"), "mmHg/s");
        assert_eq!(per_time("", "s"), "1/s");
        assert_eq!(per_time("K", "h"), "K/h");
        assert_eq!(power("m/s", 2), "m^2/s^2");
        assert_eq!(times("m/s", "s"), "m");
        assert_eq!(times("mmHg s/mL", "s"), "mmHg s^2/mL");
        assert_eq!(over("mmHg", &power("mL/s", 2)), "mmHg s^2/mL^2");
        assert_eq!(over(&per_time("mL/s", "s"), &power("mL/s", 2)), "1/mL");
        assert_eq!(over("N", "kg/(m s^2)"), "N m s^2/kg");
        assert_eq!(times("K", "h"), "K h");
    }

    #[test]
    fn every_label_made_stands_for_the_unit_that_it_should() {
        let labels = ["mmHg", "mL/s", "m/s^2", "kg/(m s)", "bar", "°C", "L/min", "V", "1/h", "%"];
        for a in labels {
            for b in labels {
                let (one, other) = (Unit::parse(a).unwrap(), Unit::parse(b).unwrap());
                let read = |text: &str| if text.is_empty() { Unit::ONE } else { Unit::parse(text).unwrap() };
                assert!(
                    read(&over(a, b)).same(&one.times(other.power(-1.0))),
                    "{a} over {b}: {}",
                    over(a, b)
                );
                assert!(read(&times(a, b)).same(&one.times(other)), "{a} times {b}: {}", times(a, b));
            }
        }
    }

    #[test]
    fn an_unknown_label_gives_none() {
        assert_eq!(over("volts", "m"), "");
        assert_eq!(times("", "m"), "");
        assert_eq!(per_time("PRU", "s"), "");
    }
}
