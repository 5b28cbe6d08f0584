//! Triangle meshes in STL, as text or binary, by `stl_io`.
//!
//! Normals are not read: the order of a triangle's corners says which side is out. Only the first solid of a file is read. Next file to
//! read: [`super`].

use std::io::Cursor;

use stl_io::create_stl_reader;

use super::{Fault, Triangles, welded};

/// Bytes before the triangles of a binary file: a free header and the number of triangles.
const HEADER: usize = 80;
const START: usize = HEADER + 4;

/// Bytes of a triangle in a binary file.
const FACET: usize = 50;

/// Reads a mesh.
///
/// # Errors
/// The first triangle that cannot be read, or a binary file of another length than its number of triangles makes.
pub(super) fn read(bytes: &[u8]) -> Result<Triangles, Fault> {
    let bytes = if is_text(bytes) { named(bytes) } else { binary(bytes)? };
    let mut reader = Cursor::new(bytes);
    let facets =
        create_stl_reader(&mut reader).map_err(|error| Fault::new(format!("is no STL file: {error}")))?;
    let mut corners = Vec::new();
    for (i, facet) in facets.enumerate() {
        let facet = facet.map_err(|error| Fault::new(format!("triangle {i}: {error}")))?;
        corners.push(facet.vertices.map(|v| v.0.map(f64::from)));
    }
    Ok(welded(corners))
}

/// Whether the file is text. Its first word does not decide: headers of binary files begin with it as well.
fn is_text(bytes: &[u8]) -> bool {
    bytes.starts_with(b"solid") && declared(bytes) != Some(bytes.len())
}

/// The length that a binary file should have.
fn declared(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER..START)?;
    let count = u32::from_le_bytes([count[0], count[1], count[2], count[3]]);
    usize::try_from(count).ok()?.checked_mul(FACET)?.checked_add(START)
}

/// The text with a first line as the library knows it: the word and a name.
fn named(bytes: &[u8]) -> Vec<u8> {
    let rest = bytes.iter().position(|b| *b == b'\n').map_or(&bytes[bytes.len()..], |end| &bytes[end..]);
    [b"solid surface".as_slice(), rest].concat()
}

/// The file with an empty header, so that no word in it makes it text.
fn binary(bytes: &[u8]) -> Result<Vec<u8>, Fault> {
    match declared(bytes) {
        Some(length) if length == bytes.len() => Ok([[0; HEADER].as_slice(), &bytes[HEADER..]].concat()),
        Some(length) => Err(Fault::new(format!(
            "has {} bytes, and the number of its triangles, {}, makes {length}: it is cut off, or no STL file",
            bytes.len(),
            (length - START) / FACET
        ))),
        None => Err(Fault::new(format!(
            "has {} bytes, fewer than an STL file has before its first triangle",
            bytes.len()
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron, counter-clockwise seen from outside.
    const FACES: [[[f32; 3]; 3]; 4] = [
        [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
        [[0.0, -0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    ];

    fn text(first: &str) -> Vec<u8> {
        let mut text = format!("{first}\n");
        for [a, b, c] in FACES {
            let line = |[x, y, z]: [f32; 3]| format!("vertex {x:?} {y:?} {z:?}\n");
            let [a, b, c] = [a, b, c].map(line);
            text.extend(["facet normal 0 0 0\nouter loop\n", &a, &b, &c, "endloop\nendfacet\n"]);
        }
        (text + "endsolid\n").into_bytes()
    }

    fn binary_with(header: &[u8]) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(HEADER, b' ');
        bytes.extend(4_u32.to_le_bytes());
        for face in FACES {
            bytes.extend([0; 12]);
            bytes.extend(face.iter().flatten().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    #[test]
    fn text_and_binary_files_are_one_mesh_whatever_their_first_words() {
        let mesh = read(&text("solid wall")).unwrap();
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (4, 4));
        for other in
            [text("solid"), text("solid\r"), binary_with(b"made somewhere"), binary_with(b"solid wall")]
        {
            assert_eq!(read(&other).unwrap(), mesh);
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_its_triangle() {
        let said = |bytes: &[u8]| read(bytes).unwrap_err().message;
        let cut = binary_with(b"");
        assert_eq!(
            said(&cut[..cut.len() - 1]),
            "has 283 bytes, and the number of its triangles, 4, makes 284: it is cut off, or no STL file"
        );
        assert_eq!(said(b"PK"), "has 2 bytes, fewer than an STL file has before its first triangle");
        let broken =
            String::from_utf8(text("solid")).unwrap().replacen("vertex 1.0 0.0 0.0", "vertex 1.0 x 0.0", 1);
        assert!(said(broken.as_bytes()).starts_with("triangle 0: "), "{}", said(broken.as_bytes()));
        let open = String::from_utf8(text("solid")).unwrap().replace("endsolid\n", "");
        assert!(said(open.as_bytes()).starts_with("triangle 4: "), "{}", said(open.as_bytes()));
    }
}
