//! Files of triangle meshes: OFF, STL (text and binary) and VTP, told apart by the end of their name.
//!
//! Here is what the formats share; whether triangles make a surface is checked by the mesh itself. Next files to read:
//! [`off`], [`stl`], [`vtp`].

mod off;
mod stl;
mod vtp;

use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

/// Vertices and triangles as they are written; triangles name their vertices, counted from 0.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Triangles {
    pub(super) vertices: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[usize; 3]>,
}

/// What is wrong with a file, and where in its text, if it has one.
#[derive(Debug, PartialEq)]
pub(super) struct Fault {
    pub(super) span: Option<Range<usize>>,
    pub(super) message: String,
}

impl Fault {
    /// A fault of the whole file.
    pub(super) fn new(message: impl Into<String>) -> Self {
        Self { span: None, message: message.into() }
    }
}

/// Reads a mesh; a name that ends with neither `.stl` nor `.vtp` is one in OFF.
///
/// # Errors
/// The first thing that is not as the format has it.
pub(super) fn read(name: &str, bytes: &[u8]) -> Result<Triangles, Fault> {
    match Path::new(name).extension().and_then(|end| end.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("stl") => stl::read(bytes),
        Some("vtp") => vtp::read(bytes),
        _ => {
            let text = std::str::from_utf8(bytes)
                .map_err(|error| Fault::new(format!("is no text from byte {} on", error.valid_up_to())))?;
            off::read(text)
        }
    }
}

/// Triangles in whose place points that are equal to the last bit are one vertex: writers of surfaces give each triangle corners of
/// its own, or points on both sides of a crease.
pub(super) fn welded(corners: impl IntoIterator<Item = [[f64; 3]; 3]>) -> Triangles {
    let mut known = HashMap::new();
    let mut welded = Triangles::default();
    for triangle in corners {
        let indices = triangle.map(|point| {
            // Minus zero is zero.
            let point = point.map(|x| x + 0.0);
            *known.entry(point.map(f64::to_bits)).or_insert_with(|| {
                welded.vertices.push(point);
                welded.vertices.len() - 1
            })
        });
        welded.triangles.push(indices);
    }
    welded
}
