//! The nearest valid name for a mistyped one, for error messages.
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

#[cfg(test)]
mod tests {
    use super::*;

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
