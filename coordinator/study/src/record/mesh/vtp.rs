//! Triangle meshes in VTP, the XML format of VTK for polygons: text, base64 and appended data, plain or compressed by zlib.
//!
//! Points and polygons are read, and no data on them. Source: VTK file formats, "XML file formats", docs.vtk.org. Next file to read:
//! [`mod@array`], one array of numbers.

mod array;

use roxmltree::{Document, Node};

use self::array::{Encoding, array, number};
use super::{Fault, Triangles, welded};

/// Reads a mesh.
///
/// # Errors
/// The first thing that is not as the format has it, and what is not read here: other data sets, strips, polygons of more corners.
pub(super) fn read(bytes: &[u8]) -> Result<Triangles, Fault> {
    let (head, appended) = parted(bytes);
    let text = std::str::from_utf8(&head)
        .map_err(|error| Fault::new(format!("is no text from byte {} on", error.valid_up_to())))?;
    let document = Document::parse(text).map_err(|error| Fault::new(format!("is no XML: {error}")))?;
    let root = document.root_element();
    if !root.has_tag_name("VTKFile") || root.attribute("type") != Some("PolyData") {
        let kind = root.attribute("type").unwrap_or_else(|| root.tag_name().name());
        return Err(fault(
            root,
            &format!("expected a VTKFile of type PolyData, found `{kind}`: extract its surface"),
        ));
    }
    let encoding =
        Encoding::of(root, document.descendants().find(|n| n.has_tag_name("AppendedData")), appended)?;
    let mut corners = Vec::new();
    for piece in document.descendants().filter(|n| n.has_tag_name("Piece")) {
        corners.extend(triangles(piece, &encoding)?);
    }
    Ok(welded(corners))
}

/// The file without its appended data, and these: they may be binary, and then are no text.
fn parted(bytes: &[u8]) -> (Vec<u8>, &[u8]) {
    let find = |what: &[u8], from: usize| {
        bytes[from..].windows(what.len()).position(|w| w == what).map(|at| at + from)
    };
    let begin = find(b"<AppendedData", 0).and_then(|tag| find(b">", tag));
    // The mark before the data is an underscore.
    let Some((tag_end, mark)) = begin.and_then(|end| Some((end, find(b"_", end)?))) else {
        return (bytes.to_vec(), &[]);
    };
    let end =
        bytes.windows(b"</AppendedData".len()).rposition(|w| w == b"</AppendedData").unwrap_or(bytes.len());
    let head = [&bytes[..=tag_end], b"</AppendedData></VTKFile>"].concat();
    (head, bytes.get(mark + 1..end).unwrap_or_default())
}

/// The corners of the triangles of a piece.
fn triangles(piece: Node<'_, '_>, encoding: &Encoding<'_>) -> Result<Vec<[[f64; 3]; 3]>, Fault> {
    if number(piece, "NumberOfStrips")?.unwrap_or(0) > 0 {
        return Err(fault(piece, "has strips of triangles: cut them into triangles (vtkTriangleFilter)"));
    }
    let points = array(named(piece, "Points", None)?, encoding)?;
    if points.len() % 3 != 0 {
        return Err(fault(piece, &format!("{} coordinates of points are no multiple of 3", points.len())));
    }
    let points: Vec<[f64; 3]> = points.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    if number(piece, "NumberOfPolys")?.unwrap_or(0) == 0 {
        return Err(fault(piece, "has no polygons: a surface is made of triangles"));
    }
    let connectivity = array(named(piece, "Polys", Some("connectivity"))?, encoding)?;
    let offsets = array(named(piece, "Polys", Some("offsets"))?, encoding)?;
    let ends = offsets.iter().map(|end| *end as i64);
    let corners =
        std::iter::once(0).chain(ends.clone()).zip(ends).map(|(begin, end)| end.saturating_sub(begin));
    if let Some((i, n)) = corners.enumerate().find(|(_, n)| *n != 3) {
        return Err(fault(piece, &format!("polygon {i} has {n} corners: cut it into triangles")));
    }
    if connectivity.len() != 3 * offsets.len() {
        let message = format!("{} corners for {} triangles", connectivity.len(), offsets.len());
        return Err(fault(piece, &message));
    }
    let corner = |(at, index): (usize, &f64)| {
        points.get(*index as usize).filter(|_| *index >= 0.0).copied().ok_or_else(|| {
            let message = format!(
                "triangle {} names the point {index} and there are {}, counted from 0",
                at / 3,
                points.len()
            );
            fault(piece, &message)
        })
    };
    let corners = connectivity.iter().enumerate().map(corner).collect::<Result<Vec<_>, _>>()?;
    Ok(corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect())
}

/// The array of numbers in the part `part` of a piece: its first, or the one of this name.
fn named<'a, 'b>(piece: Node<'a, 'b>, part: &str, name: Option<&str>) -> Result<Node<'a, 'b>, Fault> {
    let is = |n: &Node<'_, '_>| {
        n.has_tag_name("DataArray") && name.is_none_or(|name| n.attribute("Name") == Some(name))
    };
    let part_of = piece.children().find(|n| n.has_tag_name(part));
    part_of.and_then(|of| of.children().find(is)).ok_or_else(|| {
        fault(
            piece,
            &format!("has no DataArray {}in `{part}`", name.map_or(String::new(), |n| format!("`{n}` "))),
        )
    })
}

/// A fault at a node.
pub(super) fn fault(node: Node<'_, '_>, message: &str) -> Fault {
    let start = node.range().start;
    Fault { span: Some(start..start + 1 + node.tag_name().name().len()), message: message.to_owned() }
}

#[cfg(test)]
mod tests;
