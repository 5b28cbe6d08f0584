//! Triangle meshes in the Object File Format: `OFF`, the numbers of vertices and faces, coordinates, then faces `3 a b c`.
//!
//! Colours and polygons are not read; whether the triangles make a surface is checked by the mesh itself. Next file to read:
//! [`super`].

use std::ops::Range;

use super::{Fault, Triangles};

/// Reads a mesh.
///
/// # Errors
/// The first thing that is not as the format has it.
pub(super) fn read(text: &str) -> Result<Triangles, Fault> {
    let mut words = Words { rest: words(text), end: text.len() };
    let (span, magic) = words.next("the word `OFF`")?;
    if magic != "OFF" {
        return Err(fault(span, format!("expected `OFF` as the first word, found `{magic}`")));
    }
    let n_vertex: usize = words.number("the number of vertices")?;
    let n_face: usize = words.number("the number of faces")?;
    let _edges: usize = words.number("the number of edges")?;
    let mut off = Triangles::default();
    for _ in 0..n_vertex {
        off.vertices.push([
            words.number("x of a vertex")?,
            words.number("y of a vertex")?,
            words.number("z of a vertex")?,
        ]);
    }
    for face in 0..n_face {
        let span = words.span();
        let corners: usize = words.number("the number of a face's vertices")?;
        if corners != 3 {
            let message = format!("face {face} has {corners} vertices: cut it into triangles");
            return Err(fault(span, message));
        }
        off.triangles.push([
            words.number("a vertex of a face")?,
            words.number("a vertex of a face")?,
            words.number("a vertex of a face")?,
        ]);
    }
    match words.rest.last() {
        None => Ok(off),
        Some((span, word)) => {
            let message = format!("`{word}` follows the last of {n_face} faces: colours are not read");
            Err(fault(span.clone(), message))
        }
    }
}

fn fault(span: Range<usize>, message: String) -> Fault {
    Fault { span: Some(span), message }
}

/// The words of a text with their places, last first; `#` begins a comment.
fn words(text: &str) -> Vec<(Range<usize>, &str)> {
    let mut found = Vec::new();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let code = line.split('#').next().unwrap_or_default();
        for word in code.split_whitespace() {
            let at = start + (word.as_ptr() as usize - line.as_ptr() as usize);
            found.push((at..at + word.len(), word));
        }
        start += line.len();
    }
    found.reverse();
    found
}

/// The words still to read.
struct Words<'a> {
    rest: Vec<(Range<usize>, &'a str)>,
    end: usize,
}

impl<'a> Words<'a> {
    fn span(&self) -> Range<usize> {
        self.rest.last().map_or(self.end..self.end, |(span, _)| span.clone())
    }

    fn next(&mut self, what: &str) -> Result<(Range<usize>, &'a str), Fault> {
        let span = self.span();
        self.rest.pop().ok_or_else(|| fault(span, format!("the file ends before {what}")))
    }

    fn number<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, Fault> {
        let (span, word) = self.next(what)?;
        word.parse().map_err(|_| fault(span, format!("`{word}` is not {what}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_is_read_with_comments_between() {
        let text = "OFF # four faces\n4 4 6\n0 0 0\n1 0 0 # along x\n0 1 0\n0 0 1e0\n\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
        let off = read(text).unwrap();
        assert_eq!((off.vertices.len(), off.triangles[3]), (4, [1, 2, 3]));
        assert_eq!(format!("{:?}", off.vertices[3]), "[0.0, 0.0, 1.0]");
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        let fault = |text: &str| {
            let fault = read(text).unwrap_err();
            format!("{} at {}", fault.message, fault.span.unwrap().start)
        };
        assert_eq!(fault("ply\n"), "expected `OFF` as the first word, found `ply` at 0");
        assert_eq!(fault("OFF\n1 1 0\n0 0 x\n"), "`x` is not z of a vertex at 14");
        assert_eq!(fault("OFF\n0 1 0\n4 0 1 2 3\n"), "face 0 has 4 vertices: cut it into triangles at 10");
        assert_eq!(fault("OFF\n1 0 0\n0 0\n"), "the file ends before z of a vertex at 14");
        assert_eq!(fault("OFF\n0 0 0\n7\n"), "`7` follows the last of 0 faces: colours are not read at 10");
    }
}
