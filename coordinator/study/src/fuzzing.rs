//! Entrances of the fuzzer, there only for it: readers that are otherwise reached through a study and its files.

/// Reads a mesh in every format (OFF, STL, VTP), and makes a surface of it.
pub fn mesh(bytes: &[u8]) {
    crate::record::fuzzing::mesh(bytes);
}
