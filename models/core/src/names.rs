//! Names in error messages: the nearest valid one for a mistyped one, the question for it, and lists.
//!
//! Next file to read: [`crate::setup`], which reports names.

use strsim::osa_distance;

/// The candidate with the smallest edit distance to `name` (insertions, deletions, substitutions and swaps of neighbours,
/// letter case ignored), or none when even that is further than a third of the longer word.
pub fn nearest<I, S>(name: &str, candidates: I) -> Option<String>
where
    I: IntoIterator<Item = S>,
    S: AsRef<str>,
{
    let wanted = name.to_lowercase();
    let n_wanted = wanted.chars().count();
    let mut best: Option<(usize, String)> = None;
    for candidate in candidates {
        let candidate = candidate.as_ref();
        let letters = candidate.to_lowercase();
        let distance = osa_distance(&wanted, &letters);
        let allowed = (n_wanted.max(letters.chars().count()) / 3).max(1);
        let one_letter = n_wanted <= 1 && distance > 0;
        if distance <= allowed && !one_letter && best.as_ref().is_none_or(|(d, _)| distance < *d) {
            best = Some((distance, candidate.to_owned()));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// The question whether a near name was meant.
pub fn did_you_mean(near: impl AsRef<str>) -> String {
    format!("did you mean `{}`?", near.as_ref())
}

/// The same as the end of a message, which is empty where no name is near.
pub fn meant(near: Option<impl AsRef<str>>) -> String {
    near.map(|near| format!("; {}", did_you_mean(near))).unwrap_or_default()
}

/// Names in backticks, separated by commas.
pub fn quoted_list<I, S>(names: I) -> String
where
    I: IntoIterator<Item = S>,
    S: AsRef<str>,
{
    names.into_iter().map(|name| format!("`{}`", name.as_ref())).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_ends_in_a_question_where_a_name_is_near() {
        assert_eq!(meant(nearest("flwo", ["flow"])), "; did you mean `flow`?");
        assert_eq!(meant(nearest("flwo", ["pressure"])), "");
    }

    #[test]
    fn a_list_has_each_name_in_backticks() {
        assert_eq!(quoted_list(["R", "C"]), "`R`, `C`");
        assert_eq!(quoted_list::<[&str; 0], _>([]), "");
    }

    #[test]
    fn a_slip_of_the_finger_finds_its_name() {
        let names = ["windkessel-2", "windkessel-3", "oscillator", "Zc"];
        assert_eq!(nearest("windkesel-3", names).as_deref(), Some("windkessel-3"));
        assert_eq!(nearest("osicllator", names).as_deref(), Some("oscillator"));
        assert_eq!(nearest("zc", names).as_deref(), Some("Zc"));
    }

    #[test]
    fn a_different_word_finds_none() {
        assert_eq!(nearest("temperature", ["R", "C", "pressure"]), None);
        assert_eq!(nearest("Q", ["R", "C"]), None);
    }

    #[test]
    fn a_swap_of_neighbours_counts_once() {
        assert_eq!(nearest("flwo", ["flow"]).as_deref(), Some("flow"));
        assert_eq!(nearest("", ["abc"]), None);
    }
}
