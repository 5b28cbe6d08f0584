//! Texts of the other side, cut to what anybody reads.
//!
//! What a worker or a coordinator says of itself is kept, told and written; none of it may be as long as a message. Nothing is
//! escaped here: that is done where a text is shown.

/// Bytes of a reason, of the words of a program, of a setup that failed.
pub const LONGEST: usize = 8 * 1024;

/// Bytes of the name of a host.
const HOST: usize = 64;

/// The beginning of a text, with a mark of what is missing.
pub fn cut(text: String) -> String {
    if text.len() <= LONGEST {
        return text;
    }
    let end = (0..=LONGEST).rev().find(|end| text.is_char_boundary(*end)).unwrap_or(0);
    format!("{} … ({} bytes more)", &text[..end], text.len() - end)
}

/// A host name as it stands in names of workers: letters, digits and a few signs.
pub fn host(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || ".-_:".contains(c) { c } else { '?' };
    let name: String = name.chars().take(HOST).map(plain).collect();
    if name.is_empty() { "unknown-host".to_owned() } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_cut_between_letters_and_says_what_is_missing() {
        assert_eq!(cut("short".to_owned()), "short");
        let long = "ä".repeat(LONGEST);
        let cut = cut(long.clone());
        assert!(cut.len() < LONGEST + 40 && cut.ends_with("bytes more)"), "{}", &cut[cut.len() - 40..]);
        assert!(long.starts_with(cut.split(' ').next().expect("a beginning")));
    }

    #[test]
    fn a_host_is_a_short_word() {
        assert_eq!(host("node-17.cluster"), "node-17.cluster");
        assert_eq!(host("a\u{1b}[2Jb\n"), "a?[2Jb?".replace('[', "?"));
        assert_eq!(host(&"x".repeat(1_000_000)).len(), 64);
        assert_eq!(host(""), "unknown-host");
    }
}
