//! From files to surfaces and nodes: profiles `time,z,r`, or meshes named by `time,file`.
//!
//! Next file to read: [`super::mesh`] for meshes; what makes a surface is in `starlings_models::surface`.

use starlings_models::quoted_list;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use starlings_models::surface::{Mesh, Profile};

use super::mesh::{Triangles, read};
use super::{Csv, Table};
use crate::problem::{Problem, Source};
use crate::surfaces::{Shape, Shapes, length};

/// Times closer than this, relative to their size, are one.
const SAME: f64 = 1e-9;

/// Where a node is without displacement and the unit vector along which it is displaced.
pub(super) type NodeAtRest = ([f64; 3], [f64; 3]);

/// Reads the surfaces of one channel.
pub(super) struct Surfaces<'a> {
    pub(super) csv: &'a Csv,
    /// Files of meshes by name.
    pub(super) meshes: &'a BTreeMap<String, (PathBuf, Vec<u8>)>,
    /// Open ends of every mesh.
    pub(super) open_ends: usize,
    pub(super) source: &'a Source,
    pub(super) table: &'a Table,
}

impl Surfaces<'_> {
    /// The surfaces; `None` when a problem was reported.
    pub(super) fn read(&self) -> Option<Shapes> {
        let shapes = match (columns(self.csv, ["time", "file"]), columns(self.csv, ["time", "z", "r"])) {
            (Some([time, file]), _) => self.listed(time, file),
            (None, Some([time, z, r])) => self.profiles(time, z, r),
            (None, None) => {
                let (message, help) =
                    lacks(self.csv, "`time`, `z`, `r` of profiles, or `time`, `file` of meshes");
                Err(self.csv.problem(0, 0, message, &help))
            }
        };
        shapes.map_err(|problem| self.source.adopt(problem)).ok()
    }

    /// Rows of one time stand together and are the points of a profile, inlet to outlet.
    fn profiles(&self, time: usize, z: usize, r: usize) -> Result<Shapes, Problem> {
        let times = self.times(time)?;
        let points = self.full(z)?.into_iter().zip(self.full(r)?).map(|(z, r)| [z, r]).collect::<Vec<_>>();
        let mut shapes = Shapes { numbers: points.concat(), ..Shapes::default() };
        let mut first = 0;
        for group in times.chunk_by(|a, b| a.total_cmp(b).is_eq()) {
            let at = self.row_time(first, time, group[0])?;
            let line = &points[first..first + group.len()];
            let profile = Profile::new(line.to_vec()).map_err(|error| {
                let message = format!("the surface at time {}: {error}", group[0]);
                self.csv.problem(
                    first,
                    z,
                    message,
                    "every time needs the points of one wall, inlet to outlet",
                )
            })?;
            shapes.times.push(at);
            shapes.shapes.push(Shape::Profile(profile));
            shapes.lengths.push(length(line.iter().copied()));
            first += group.len();
        }
        Ok(shapes)
    }

    /// A row per time names its mesh.
    fn listed(&self, time: usize, file: usize) -> Result<Shapes, Problem> {
        let times = self.csv.times(time)?;
        let mut shapes = Shapes::default();
        for (row, (t, name)) in times.into_iter().zip(self.csv.texts(file)).enumerate() {
            shapes.times.push(self.row_time(row, time, t)?);
            let shape = self.mesh(name, &mut shapes)?;
            shapes.shapes.push(Shape::Mesh(shape));
        }
        Ok(shapes)
    }

    /// The mesh of this name; its numbers and its length are added to those known.
    fn mesh(&self, name: &str, known: &mut Shapes) -> Result<Mesh, Problem> {
        let Some((path, bytes)) = self.meshes.get(name) else {
            unreachable!("every mesh that the surface file names was read");
        };
        let problem = |message: String, span: Option<std::ops::Range<usize>>, help: &str| Problem {
            message,
            help: Some(help.to_owned()),
            file: path.clone(),
            source_text: std::str::from_utf8(bytes).ok().filter(|_| span.is_some()).map(Arc::from),
            span,
        };
        let Triangles { vertices, triangles } = read(name, bytes).map_err(|fault| {
            problem(fault.message, fault.span, "write triangles as OFF (*.off), STL (*.stl) or VTP (*.vtp)")
        })?;
        known.lengths.push(length(vertices.iter().copied()));
        known.numbers.extend(vertices.as_flattened());
        known.numbers.extend(triangles.as_flattened().iter().map(|v| *v as f64));
        Mesh::new(vertices, triangles, self.open_ends).map_err(|error| {
            let help = "repair the mesh, or say how many open ends it has by `open_ends` (2 for a tube, 0 for a closed surface)";
            problem(error.to_string(), Some(0..3), help)
        })
    }

    /// The times of all rows: those of one time together, increasing.
    fn times(&self, column: usize) -> Result<Vec<f64>, Problem> {
        let times = self.full(column)?;
        match times.windows(2).position(|pair| pair[1] < pair[0]) {
            None => Ok(times),
            Some(before) => Err(self.csv.problem(
                before + 1,
                column,
                format!("time goes back from {} to {}", times[before], times[before + 1]),
                "the rows of one time stand together, and times increase",
            )),
        }
    }

    /// The numbers of a column that has no gap.
    fn full(&self, column: usize) -> Result<Vec<f64>, Problem> {
        full(self.csv, column, "a point of a surface needs all its numbers: remove the row")
    }

    /// The record's own time that a surface's is, since predictions are made at those.
    fn row_time(&self, row: usize, column: usize, time: f64) -> Result<f64, Problem> {
        let near = |t: &&f64| (**t - time).abs() <= SAME * time.abs().max(1.0);
        self.table.times.iter().find(near).copied().ok_or_else(|| {
            let record = self.table.csv.path.display();
            self.csv.problem(
                row,
                column,
                format!("`{record}` has no row at time {time}, for which there is a surface"),
                "predictions are made at the times of the record's file: add a row with this time there, other cells may be empty",
            )
        })
    }

    /// Where the `n` nodes of an output are at rest; `None` when a problem was reported.
    pub(super) fn rest(&self, csv: &Csv, n: usize, output: &str) -> Option<Vec<NodeAtRest>> {
        let places = match columns(self.csv, ["time", "file"]) {
            Some(_) => mesh_places(csv),
            None => profile_places(csv),
        };
        let counted = places.and_then(|places| {
            if places.len() == n {
                return Ok(places);
            }
            let message =
                format!("{} nodes at rest for the {n} components of output `{output}`", places.len());
            Err(csv.problem(0, 0, message, "give one row per component of the output, in their order"))
        });
        counted.map_err(|problem| self.source.adopt(problem)).ok()
    }
}

fn full(csv: &Csv, column: usize, help: &str) -> Result<Vec<f64>, Problem> {
    let values = csv.numbers(column)?;
    match values.iter().position(|v| v.is_nan()) {
        None => Ok(values),
        Some(row) => {
            let message = format!("column `{}` has no value here", csv.headers[column]);
            Err(csv.problem(row, column, message, help))
        }
    }
}

/// The columns of these names, row by row; nothing where one is missing.
fn vectors<const N: usize>(csv: &Csv, names: [&str; N]) -> Result<Option<Vec<[f64; N]>>, Problem> {
    let Some(at) = columns(csv, names) else { return Ok(None) };
    let mut rows = Vec::new();
    for (i, column) in at.into_iter().enumerate() {
        let values = full(csv, column, "every node needs its place and, if given, its direction")?;
        rows.resize(values.len(), [0.0; N]);
        rows.iter_mut().zip(values).for_each(|(row, value)| row[i] = value);
    }
    Ok(Some(rows))
}

/// Nodes (x, y, z) that move along (nx, ny, nz).
fn mesh_places(csv: &Csv) -> Result<Vec<NodeAtRest>, Problem> {
    let (Some(rest), Some(normals)) = (vectors(csv, ["x", "y", "z"])?, vectors(csv, ["nx", "ny", "nz"])?)
    else {
        let (message, help) = lacks(csv, "`x`, `y`, `z` and `nx`, `ny`, `nz`, needed beside meshes");
        return Err(csv.problem(0, 0, message, &help));
    };
    rest.into_iter().zip(normals).enumerate().map(|(row, (x, n))| Ok((x, unit(csv, row, n)?))).collect()
}

/// Nodes (z, r) that move along (nz, nr), or else along the outward normal of the line through them.
fn profile_places(csv: &Csv) -> Result<Vec<NodeAtRest>, Problem> {
    let Some(rest) = vectors(csv, ["z", "r"])? else {
        let (message, help) = lacks(csv, "`z` and `r`, needed beside profiles");
        return Err(csv.problem(0, 0, message, &help));
    };
    let normals = if let Some(normals) = vectors(csv, ["nz", "nr"])? {
        normals
    } else {
        // The check of a profile refuses a line against z, for which normals would point inward and displacements have the
        // wrong sign.
        Profile::new(rest.clone()).map_err(|error| {
            let help = "order the nodes from inlet to outlet, or give their directions in columns `nz`, `nr`";
            csv.problem(0, 0, format!("the wall at rest: {error}"), help)
        })?;
        bisectors(&rest)
    };
    let place = |(row, ([z, r], [nz, nr])): (usize, ([f64; 2], [f64; 2]))| {
        Ok(([z, r, 0.0], unit(csv, row, [nz, nr, 0.0])?))
    };
    rest.into_iter().zip(normals).enumerate().map(place).collect()
}

/// Outward at every point of a line: the sum of the unit normals of the segments at it.
fn bisectors(line: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 2]; line.len()];
    for (i, pair) in line.windows(2).enumerate() {
        let [dz, dr] = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let length = dz.hypot(dr);
        for sum in &mut sums[i..i + 2] {
            *sum = [sum[0] - dr / length, sum[1] + dz / length];
        }
    }
    sums
}

/// The direction of length one.
fn unit(csv: &Csv, row: usize, n: [f64; 3]) -> Result<[f64; 3], Problem> {
    let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
    if length > 0.0 {
        return Ok(n.map(|v| v / length));
    }
    Err(csv.problem(
        row,
        0,
        "a node without a direction".to_owned(),
        "give the outward normal of the wall there",
    ))
}

/// Position of each of these columns; nothing where one is missing.
fn columns<const N: usize>(csv: &Csv, names: [&str; N]) -> Option<[usize; N]> {
    let mut found = [0; N];
    for (at, name) in found.iter_mut().zip(names) {
        *at = csv.index(name).ok()?;
    }
    Some(found)
}

/// The message about a file without the columns that were looked for, and the columns that it has.
fn lacks(csv: &Csv, wanted: &str) -> (String, String) {
    (
        format!("`{}` has not the columns {wanted}", csv.path.display()),
        format!("its columns are {}", quoted_list(&csv.headers)),
    )
}
