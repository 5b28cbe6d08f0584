//! The nearest valid name for a mistyped one, for error messages.
//!
//! Next file to read: [`crate::setup`], which reports names.

/// The candidate with the smallest edit distance to `name` (insertions, deletions, substitutions and swaps of neighbours,
/// letter case ignored), or none when even that is further than a third of the longer word.
pub fn nearest<I, S>(name: &str, candidates: I) -> Option<String>
where
    I: IntoIterator<Item = S>,
    S: AsRef<str>,
{
    let wanted: Vec<char> = name.to_lowercase().chars().collect();
    let mut best: Option<(usize, String)> = None;
    for candidate in candidates {
        let candidate = candidate.as_ref();
        let letters: Vec<char> = candidate.to_lowercase().chars().collect();
        let distance = edit_distance(&wanted, &letters);
        let allowed = (wanted.len().max(letters.len()) / 3).max(1);
        let one_letter = wanted.len() <= 1 && distance > 0;
        if distance <= allowed && !one_letter && best.as_ref().is_none_or(|(d, _)| distance < *d) {
            best = Some((distance, candidate.to_owned()));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// Optimal string alignment distance.
fn edit_distance(a: &[char], b: &[char]) -> usize {
    let mut before: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let change = usize::from(a[i - 1] != b[j - 1]);
            row[j] = (last[j] + 1).min(row[j - 1] + 1).min(last[j - 1] + change);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = std::mem::replace(&mut last, row);
    }
    last[b.len()]
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
        let letters = |s: &str| s.chars().collect::<Vec<_>>();
        assert_eq!(edit_distance(&letters("flwo"), &letters("flow")), 1);
        assert_eq!(edit_distance(&letters(""), &letters("abc")), 3);
    }
}
