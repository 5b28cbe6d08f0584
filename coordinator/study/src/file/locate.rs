//! Places in a text: bytes to lines and columns, characters of a TOML string to bytes of the file.
//!
//! Next file to read: [`crate::problem`].

use std::ops::Range;

/// Line and column (both from 1, the column in characters) of a byte offset.
pub(crate) fn line_column(text: &str, offset: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..offset.min(text.len())];
    let line_start = before.iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
    let line = before.split(|b| *b == b'\n').count();
    (line, String::from_utf8_lossy(&before[line_start..]).chars().count() + 1)
}

/// Bytes of the file that hold the character at `column` (from 1) of the TOML string standing at `literal`, quotes and
/// escapes considered. Past the last character it is the closing quote.
pub(crate) fn character(text: &str, literal: &Range<usize>, column: usize) -> Range<usize> {
    let raw = text.get(literal.clone()).unwrap_or_default();
    let (open, escapes) = opening(raw);
    let mut at = open;
    for _ in 1..column {
        match decoded_character(&raw[at..], escapes) {
            Some(length) if at + length < raw.len() => at += length,
            _ => break,
        }
    }
    let length = decoded_character(&raw[at..], escapes).unwrap_or(1);
    let start = literal.start + at;
    start..(start + length).min(literal.end)
}

/// Length of the opening quotes (with the newline that TOML drops after triple quotes) and whether escapes count.
fn opening(raw: &str) -> (usize, bool) {
    for (quotes, escapes) in [("\"\"\"", true), ("'''", false)] {
        if let Some(rest) = raw.strip_prefix(quotes) {
            let newline = if rest.starts_with("\r\n") { 2 } else { usize::from(rest.starts_with('\n')) };
            return (quotes.len() + newline, escapes);
        }
    }
    match raw.chars().next() {
        Some('"') => (1, true),
        Some('\'') => (1, false),
        _ => (0, false),
    }
}

/// Bytes that make one character of the decoded string.
fn decoded_character(raw: &str, escapes: bool) -> Option<usize> {
    let first = raw.chars().next()?;
    if !escapes || first != '\\' {
        return Some(first.len_utf8());
    }
    Some(match raw[1..].chars().next() {
        Some('u') => 6,
        Some('U') => 10,
        Some('x') => 4,
        Some(next) => 1 + next.len_utf8(),
        None => 1,
    })
}

/// Bytes of field `index` of the CSV line that starts at byte `start`, quotes included.
pub(crate) fn csv_field(text: &str, start: usize, index: usize) -> Range<usize> {
    let mut field = 0;
    let mut from = start;
    let mut in_quotes = false;
    for (i, byte) in text.bytes().enumerate().skip(start) {
        match byte {
            b'"' => in_quotes = !in_quotes,
            b'\n' | b'\r' if !in_quotes => return from..i,
            b',' if !in_quotes => {
                if field == index {
                    return from..i;
                }
                field += 1;
                from = i + 1;
            }
            _ => {}
        }
    }
    from..text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_from_one_in_characters() {
        let text = "a\nµb = 1\n";
        assert_eq!(line_column(text, 0), (1, 1));
        assert_eq!(line_column(text, text.find('b').unwrap()), (2, 2));
    }

    #[test]
    fn a_character_of_a_string_is_found_behind_escapes_and_quotes() {
        let text = r#"rate = "a\tb+c""#;
        let literal = 7..text.len();
        assert_eq!(&text[character(text, &literal, 1)], "a");
        assert_eq!(&text[character(text, &literal, 2)], "\\t");
        assert_eq!(&text[character(text, &literal, 3)], "b");
        assert_eq!(&text[character(text, &literal, 6)], "\"");
        assert_eq!(&text[character(text, &literal, 99)], "\"");
    }

    #[test]
    fn a_block_string_starts_after_its_newline() {
        let text = "'''\nx*y'''";
        assert_eq!(&text[character(text, &(0..text.len()), 3)], "y");
    }

    #[test]
    fn a_csv_field_is_found_behind_quoted_commas() {
        let text = "a,b\n\"1,5\",x,3\n";
        assert_eq!(&text[csv_field(text, 4, 0)], "\"1,5\"");
        assert_eq!(&text[csv_field(text, 4, 1)], "x");
        assert_eq!(&text[csv_field(text, 4, 2)], "3");
    }
}
