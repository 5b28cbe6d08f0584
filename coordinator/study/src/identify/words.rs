//! Combinations of parameters in words: `E3 − 0.9 k_s`.

use starlings_estimators::Direction;

/// Coefficients below this share of the largest are not named.
const NAMED: f64 = 0.1;
/// So many terms are written; a longer combination ends in `…`.
const TERMS: usize = 6;

/// The parameters (positions) that take part in a direction, the largest first; those that are written alike in order.
pub fn members(direction: &Direction) -> Vec<usize> {
    let size = |j: &usize| direction.coefficients[*j].abs();
    let mut members: Vec<usize> = (0..direction.coefficients.len()).filter(|j| size(j) >= NAMED).collect();
    members.sort_by_key(|j| std::cmp::Reverse((100.0 * size(j)).round() as i64));
    members
}

/// A direction as a sum, the largest term first; coefficients are per prior sd of each parameter.
pub fn combination(names: &[&str], direction: &Direction) -> String {
    let members = members(direction);
    let mut text = String::new();
    for (k, j) in members.iter().take(TERMS).enumerate() {
        let coefficient = direction.coefficients[*j];
        let sign = match (k, coefficient < 0.0) {
            (0, false) => "",
            (0, true) => "−",
            (_, false) => " + ",
            (_, true) => " − ",
        };
        let size = format!("{:.2}", coefficient.abs());
        let size = size.trim_end_matches('0').trim_end_matches('.');
        text.push_str(sign);
        if size != "1" {
            text.push_str(size);
            text.push(' ');
        }
        text.push_str(names[*j]);
    }
    if members.len() > TERMS {
        text.push_str(" + …");
    }
    text
}

/// `a`, `a and b`, `a, b and c`.
pub fn listed<S: AsRef<str>>(names: &[S]) -> String {
    let text = |names: &[S]| names.iter().map(AsRef::as_ref).collect::<Vec<_>>().join(", ");
    match names {
        [first @ .., last] if !first.is_empty() => format!("{} and {}", text(first), last.as_ref()),
        _ => text(names),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn direction(coefficients: &[f64]) -> Direction {
        Direction { coefficients: coefficients.to_vec(), share: 1.0, standard_error: None }
    }

    #[test]
    fn a_combination_names_its_largest_terms_first_and_leaves_out_the_smallest() {
        let names = ["E1", "E3", "k_s"];
        assert_eq!(combination(&names, &direction(&[0.02, 1.0, -0.9])), "E3 − 0.9 k_s");
        assert_eq!(combination(&names, &direction(&[-0.994, 1.0, 0.25])), "E3 − 0.99 E1 + 0.25 k_s");
        assert_eq!(combination(&names, &direction(&[0.3004, -0.3, 1.0])), "k_s + 0.3 E1 − 0.3 E3");
        assert_eq!(combination(&names, &direction(&[0.0, 0.0, 1.0])), "k_s");
    }

    #[test]
    fn a_long_combination_ends_in_an_ellipsis() {
        let names = ["a", "b", "c", "d", "e", "f", "g"];
        assert_eq!(combination(&names, &direction(&[1.0; 7])), "a + b + c + d + e + f + …");
    }
}
