//! What the fuzzer reaches.

use starlings_models::surface::Mesh;

use super::mesh::{Triangles, read};

/// Reads a mesh in every format and asks for a place on it.
pub(crate) fn mesh(bytes: &[u8]) {
    for name in ["mesh.off", "mesh.stl", "mesh.vtp"] {
        let Ok(Triangles { vertices, triangles }) = read(name, bytes) else { continue };
        for open_ends in [0, 2] {
            if let Ok(mesh) = Mesh::new(vertices.clone(), triangles.clone(), open_ends) {
                assert!(mesh.foot([0.5, -0.25, 2.0]).is_some());
            }
        }
    }
}
