//! Texts from outside on a terminal: what a study, a solver, a worker or a recording says is shown and never obeyed.
//!
//! An escape sequence could hide lines, write titles or change what is typed next; marks of direction could turn the order of
//! letters. Both are shown as pictures of themselves. Next file to read: [`crate::note`].

use std::fmt::{self, Display, Formatter, Write};

/// A text in which every character that a terminal would obey is its picture; ends of lines and tabs stay.
pub(crate) struct Plain<D>(pub(crate) D);

impl<D: Display> Display for Plain<D> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(Filter(f), "{}", self.0)
    }
}

struct Filter<'a, 'b>(&'a mut Formatter<'b>);

impl Write for Filter<'_, '_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut shown = 0;
        for (at, c) in text.char_indices() {
            if let Some(picture) = picture(c) {
                self.0.write_str(&text[shown..at])?;
                self.0.write_char(picture)?;
                shown = at + c.len_utf8();
            }
        }
        self.0.write_str(&text[shown..])
    }
}

/// What stands for a character that a terminal would obey.
fn picture(c: char) -> Option<char> {
    match c {
        '\n' | '\t' => None,
        '\0'..='\x1f' => char::from_u32(0x2400 + u32::from(c)),
        '\x7f' => Some('\u{2421}'),
        '\u{80}'..='\u{9f}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => {
            Some(char::REPLACEMENT_CHARACTER)
        }
        _ => None,
    }
}

/// The same of a text in which places are counted in bytes: each such character becomes as many `?` as it has bytes.
pub(crate) fn of_same_length(text: &str) -> String {
    let shown = |c: char| match picture(c) {
        Some(_) => "?".repeat(c.len_utf8()),
        None => c.to_string(),
    };
    text.chars().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sequence_that_clears_a_screen_is_shown() {
        let hostile = "start\x1b[2J\x07\u{9b}31m\u{202e}dne\r\n\tnext";
        assert_eq!(Plain(hostile).to_string(), "start␛[2J␇\u{fffd}31m\u{fffd}dne␍\n\tnext");
        assert_eq!(of_same_length(hostile).len(), hostile.len());
        assert!(of_same_length(hostile).chars().all(|c| picture(c).is_none()));
    }

    #[test]
    fn what_people_write_stays() {
        let text = "Zürich: 95\u{a0}% of β ± 0.1 µs, 日本語\n";
        assert_eq!(Plain(text).to_string(), text);
        assert_eq!(of_same_length(text), text);
    }
}
