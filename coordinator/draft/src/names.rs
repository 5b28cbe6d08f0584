//! Names of a file as names of a study: letters, digits and `_`, each once, and none that means something in expressions.

use std::collections::HashSet;

use starlings_models::equations::has_meaning;

/// The names given so far.
#[derive(Debug, Default)]
pub(crate) struct Names(HashSet<String>);

impl Names {
    /// The name in the study of something that a file calls `wanted`; with a number behind it where it is taken.
    pub(crate) fn take(&mut self, wanted: &str) -> String {
        let mut name: String =
            wanted.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
        if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || has_meaning(&name) {
            name.insert_str(0, "n_");
        }
        let mut free = name.clone();
        for number in 2.. {
            if self.0.insert(free.clone()) {
                break;
            }
            free = format!("{name}_{number}");
        }
        free
    }
}

#[cfg(test)]
mod tests {
    use super::Names;

    #[test]
    fn a_name_is_an_identifier_and_given_once() {
        let mut names = Names::default();
        let taken = ["a b", "a_b", "1-Ascending", "J0:v"].map(|wanted| names.take(wanted));
        assert_eq!(taken, ["a_b", "a_b_2", "n_1_Ascending", "J0_v"]);
    }

    #[test]
    fn a_column_that_is_called_like_a_function_has_a_name_that_expressions_take() {
        let mut names = Names::default();
        let taken = ["max", "t", "pi", "mean", "max"].map(|wanted| names.take(wanted));
        assert_eq!(taken, ["n_max", "n_t", "n_pi", "mean", "n_max_2"]);
    }
}
