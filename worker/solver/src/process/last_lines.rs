//! The last lines of what a program says, kept while it runs.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read};
use std::sync::{Mutex, PoisonError};

/// Lines of the end of a program's output that travel with a failure, and the longest of them.
const TAIL_LINES: usize = 12;
const TAIL_WIDTH: usize = 240;

/// Keeps the last lines of a stream, and of a long line its beginning.
pub(super) fn remember(stream: impl Read, tail: &Mutex<VecDeque<String>>) {
    let mut stream = BufReader::new(stream);
    let mut line = Vec::new();
    loop {
        let piece = match stream.fill_buf() {
            Ok(piece) if !piece.is_empty() => piece,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            _ => break,
        };
        let end = piece.iter().position(|byte| *byte == b'\n');
        let own = &piece[..end.unwrap_or(piece.len())];
        // A character has at most four bytes.
        let room = (4 * TAIL_WIDTH).saturating_sub(line.len());
        line.extend_from_slice(&own[..own.len().min(room)]);
        let read = end.map_or(piece.len(), |end| end + 1);
        stream.consume(read);
        if end.is_some() {
            keep_line(&line, tail);
            line.clear();
        }
    }
    keep_line(&line, tail);
}

fn keep_line(line: &[u8], tail: &Mutex<VecDeque<String>>) {
    // Bytes that would steer a terminal are shown as what they are: no text.
    let shown = |c: char| if c.is_control() && c != '\t' { char::REPLACEMENT_CHARACTER } else { c };
    let text = String::from_utf8_lossy(line.trim_ascii_end());
    let text: String = text.chars().take(TAIL_WIDTH).map(shown).collect();
    if text.is_empty() {
        return;
    }
    let mut tail = tail.lock().unwrap_or_else(PoisonError::into_inner);
    if tail.len() == TAIL_LINES {
        tail.pop_front();
    }
    tail.push_back(text);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn remembered(bytes: &[u8]) -> Vec<String> {
        let tail = Mutex::default();
        remember(bytes, &tail);
        tail.into_inner().expect("nobody panicked").into()
    }

    #[test]
    fn of_what_a_program_says_the_last_lines_are_kept_and_of_a_long_line_the_beginning() {
        let many = (0..50).map(|i| format!("line {i}\r\n\n")).collect::<Vec<_>>().concat();
        let kept = remembered(many.as_bytes());
        assert_eq!((kept.len(), kept[0].as_str(), kept[11].as_str()), (TAIL_LINES, "line 38", "line 49"));
        let long = [vec![b'x'; 10_000_000], b"\nend".to_vec()].concat();
        assert_eq!(remembered(&long), ["x".repeat(TAIL_WIDTH), "end".to_owned()]);
    }

    #[test]
    fn garbage_is_shown_as_no_text_and_steers_no_terminal() {
        assert_eq!(
            remembered(b"\x1b[2Jcleared \xff\n\0\0"),
            ["\u{fffd}[2Jcleared \u{fffd}", "\u{fffd}\u{fffd}"]
        );
    }
}
