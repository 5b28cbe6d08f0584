//! What the fuzzer reaches.

use starlings_models::surface::Mesh;

use super::off::{Off, read};

/// Reads a mesh and asks for a place on it.
pub(crate) fn mesh(text: &str) {
    let Ok(Off { vertices, triangles }) = read(text) else { return };
    for open_ends in [0, 2] {
        if let Ok(mesh) = Mesh::new(vertices.clone(), triangles.clone(), open_ends) {
            assert!(mesh.foot([0.5, -0.25, 2.0]).is_some());
        }
    }
}
