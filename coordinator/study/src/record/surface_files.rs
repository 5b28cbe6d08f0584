//! The files behind a channel that was measured as surfaces, each read once.
//!
//! Next file to read: [`super::surface`].

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::rc::Rc;

use super::{Csv, Recordings};
use crate::file::{RecordSection, SurfaceSection};

/// The files of one surface channel.
pub(super) struct SurfaceFiles {
    pub(super) surface: Rc<Csv>,
    pub(super) rest: Rc<Csv>,
    /// Meshes that the surface file names, as they stand in their files, by name.
    pub(super) meshes: BTreeMap<String, (PathBuf, Vec<u8>)>,
}

impl Recordings<'_> {
    /// The files of every channel of a record, none where it is no surface; `None` when a problem was reported.
    pub(super) fn surfaces(&mut self, section: &RecordSection) -> Option<Vec<Option<SurfaceFiles>>> {
        let found: Vec<Option<Option<SurfaceFiles>>> = section
            .channels
            .iter()
            .map(|channel| channel.surface.as_ref().map_or(Some(None), |s| self.files(s).map(Some)))
            .collect();
        found.into_iter().collect()
    }

    fn files(&mut self, section: &SurfaceSection) -> Option<SurfaceFiles> {
        let surface = self.open(section.file.get_ref(), &section.file);
        let rest = self.open(section.rest.get_ref(), &section.rest);
        let (surface, rest) = (surface?, rest?);
        let mut meshes = BTreeMap::new();
        let before = self.source.count();
        if let Ok(column) = surface.index("file") {
            for (row, name) in surface.texts(column).enumerate() {
                let path = self.folder.join(name);
                match std::fs::read(&path) {
                    Ok(bytes) => {
                        meshes.insert(name.to_owned(), (path, bytes));
                    }
                    Err(error) => {
                        let message = format!("cannot read `{}`: {}", path.display(), super::plain(&error));
                        let help = "name a mesh in OFF, STL or VTP, relative to the study file";
                        self.source.adopt(surface.problem(row, column, message, help));
                    }
                }
            }
        }
        (self.source.count() == before).then_some(SurfaceFiles { surface, rest, meshes })
    }
}
