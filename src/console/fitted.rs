//! Tables that fit the terminal: cells of wide columns go on below themselves.
//!
//! What goes into a file or another program is not wrapped. Next file to read: [`super`].

use std::io::IsTerminal;

use super::table;

/// Narrowest column that is made narrower.
const NARROWEST: usize = 12;
/// Space before and between columns, as [`table`] sets it.
const SPACE: usize = 2;

/// A table of words within the width of the terminal that standard output is, if it is one.
pub(crate) fn fitted(rows: &[Vec<String>]) -> String {
    match terminal_width() {
        Some(width) => within(rows, width),
        None => table(rows, false),
    }
}

/// Columns of the terminal that standard output is.
fn terminal_width() -> Option<usize> {
    let out = std::io::stdout();
    let size = out.is_terminal().then(|| rustix::termios::tcgetwinsize(&out).ok()).flatten()?;
    (size.ws_col > 0).then_some(size.ws_col.into())
}

/// The table with lines of at most `width` characters, as long as no column has to be narrower than [`NARROWEST`].
fn within(rows: &[Vec<String>], width: usize) -> String {
    let n = rows.iter().map(Vec::len).max().unwrap_or(0);
    let longest = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(|cell| cell.chars().count()).max();
    let mut widths: Vec<usize> = (0..n).map(|c| longest(c).unwrap_or(0)).collect();
    while widths.iter().map(|w| w + SPACE).sum::<usize>() > width {
        let Some(widest) = widths.iter_mut().max().filter(|w| **w > NARROWEST) else { break };
        *widest -= 1;
    }
    let mut lines = Vec::new();
    for row in rows {
        let cells: Vec<Vec<String>> = row.iter().zip(&widths).map(|(cell, w)| wrapped(cell, *w)).collect();
        let height = cells.iter().map(Vec::len).max().unwrap_or(0);
        let line = |i: usize| cells.iter().map(|cell| cell.get(i).cloned().unwrap_or_default()).collect();
        lines.extend((0..height).map(line));
    }
    table(&lines, false)
}

/// A text in lines of at most `width` characters, broken between words, and inside one that is longer.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    let mut length = 0;
    for word in text.split(' ') {
        let mut letters: Vec<char> = word.chars().collect();
        if length > 0 && length + 1 + letters.len() > width {
            lines.push(String::new());
            length = 0;
        } else if length > 0 {
            lines.last_mut().into_iter().for_each(|line| line.push(' '));
            length += 1;
        }
        while letters.len() > width.max(1) {
            let rest = letters.split_off(width.max(1));
            lines.last_mut().into_iter().for_each(|line| line.extend(&letters));
            lines.push(String::new());
            letters = rest;
        }
        length += letters.len();
        lines.last_mut().into_iter().for_each(|line| line.extend(&letters));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> Vec<Vec<String>> {
        let row = |cells: [&str; 3]| cells.map(str::to_owned).to_vec();
        vec![
            row(["effect", "term", "what it says"]),
            row([
                "dry-friction",
                "-mu*sign(v)",
                "Friction of a size that does not depend on the speed, against it.",
            ]),
            row(["delay", "delay(a_very_long_name_of_an_input,tau)-a_very_long_name_of_an_input", "Late."]),
        ]
    }

    #[test]
    fn a_table_keeps_within_the_terminal_and_loses_no_letter() {
        let letters = |text: &str| {
            let mut letters: Vec<char> = text.chars().filter(|c| !c.is_whitespace()).collect();
            letters.sort_unstable();
            letters
        };
        let whole = table(&rows(), false);
        for width in [60, 80, 100, 500] {
            let text = within(&rows(), width);
            let longest = text.lines().map(|line| line.chars().count()).max();
            assert!(longest <= Some(width), "{width}:\n{text}");
            assert_eq!(letters(&text), letters(&whole), "{width}");
        }
        assert_eq!(within(&rows(), 500), whole);
    }

    #[test]
    fn words_are_broken_only_where_they_are_longer_than_their_column() {
        assert_eq!(wrapped("a force against it", 9), ["a force", "against", "it"]);
        assert_eq!(wrapped("0123456789 ab", 4), ["0123", "4567", "89", "ab"]);
        assert_eq!(wrapped("", 4), [""]);
    }
}
