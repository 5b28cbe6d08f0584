//! A triangulated surface.
//!
//! On which side of the surface a point lies is decided by the normal at its nearest place: of the triangle inside one, of
//! both triangles on an edge, and at a corner of all around by their angles (Bærentzen & Aanæs 2005). Next file to
//! read: [`super::topology`].

use std::collections::BTreeMap;

use super::Foot;
use super::search::{Nearest, Search};
use super::topology::{Edge, Edges, checked, edge, sides};
use super::triangle::{Part, closest, crossing};
use super::vector::{cross, dot, minus, norm, plus, times, unit};
use crate::SetupError;

/// Triangles with outward normals, counter-clockwise seen from outside.
#[derive(Clone, Debug)]
pub struct Mesh {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[usize; 3]>,
    /// Outward unit normal of each triangle.
    faces: Vec<[f64; 3]>,
    /// Of each edge, its outward unit normal and whether it is on an open end.
    edges: BTreeMap<Edge, ([f64; 3], bool)>,
    /// Of each vertex, the same.
    corners: Vec<([f64; 3], bool)>,
    search: Search<3>,
}

impl Mesh {
    /// A surface of vertices (x, y, z) and triangles of three vertices each, counted from 0, with `open_ends` open ends: 0 for a
    /// closed surface, 2 for a tube.
    ///
    /// # Errors
    /// When there is no triangle, a vertex is unknown or not finite, a triangle has no area, the surface has holes or branches, or
    /// normals point inward or against their neighbours'.
    pub fn new(
        vertices: Vec<[f64; 3]>,
        triangles: Vec<[usize; 3]>,
        open_ends: usize,
    ) -> Result<Self, SetupError> {
        let faces = faces(&vertices, &triangles)?;
        let around = checked(&vertices, &triangles, open_ends)?;
        let edges = edge_normals(&around, &faces);
        let corners = corner_normals(&vertices, &triangles, &faces, &edges);
        let search = Search::new(triangles.iter().map(|t| t.map(|v| vertices[v])))?;
        Ok(Self { vertices, triangles, faces, edges, corners, search })
    }

    /// The place nearest to a point; `None` when the point is not finite.
    pub fn foot(&self, x: [f64; 3]) -> Option<Foot<3>> {
        let corners = |triangle: usize| self.triangles[triangle].map(|v| self.vertices[v]);
        let Nearest { facet: triangle, point, place: part, .. } =
            self.search.nearest(&x, |triangle| closest(&corners(triangle), &x))?;
        let of = self.triangles[triangle];
        let face = (self.faces[triangle], false);
        let (outward, open) = match part {
            Part::Face => face,
            Part::Edge(i) => self.edges.get(&edge(of[i], of[(i + 1) % 3])).copied().unwrap_or(face),
            Part::Corner(i) => self.corners[of[i]],
        };
        Some(Foot::new(&x, point, outward, triangle, open))
    }

    /// Where a line from `x` goes in and comes out, in lengths of `way`, of the stretch inside that is nearest to `x`; `None` where the
    /// line leaves by an open end, or meets nothing.
    pub fn inside(&self, x: [f64; 3], way: [f64; 3]) -> Option<[f64; 2]> {
        let corners = |t: &[usize; 3]| t.map(|v| self.vertices[v]);
        let crossing = |(t, normal): (&[usize; 3], &[f64; 3])| {
            crossing(&corners(t), &x, &way).map(|at| (at, dot(normal, &way) > 0.0))
        };
        let mut found: Vec<(f64, bool)> =
            self.triangles.iter().zip(&self.faces).filter_map(crossing).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Through an edge a line meets two triangles in one way.
        found.dedup_by_key(|(_, outward)| *outward);
        let stretches =
            found.windows(2).filter(|pair| !pair[0].1 && pair[1].1).map(|pair| [pair[0].0, pair[1].0]);
        let away = |[from, to]: &[f64; 2]| f64::max(0.0, f64::max(*from, -to));
        stretches.min_by(|a, b| away(a).total_cmp(&away(b)))
    }
}

/// The unit normal of every triangle.
fn faces(vertices: &[[f64; 3]], triangles: &[[usize; 3]]) -> Result<Vec<[f64; 3]>, SetupError> {
    if triangles.is_empty() {
        return Err(SetupError::Invalid("a surface without triangles".to_owned()));
    }
    let face = |(i, t): (usize, &[usize; 3])| {
        let refuse = |what: &str| Err(SetupError::Invalid(format!("triangle {i} of the surface {what}")));
        if t.iter().any(|v| *v >= vertices.len()) {
            return refuse(&format!(
                "names the vertices {t:?} and there are {}, counted from 0",
                vertices.len()
            ));
        }
        let [a, b, c] = t.map(|v| vertices[v]);
        if [a, b, c].iter().flatten().any(|v| !v.is_finite()) {
            return refuse("has a vertex that is not finite");
        }
        let (ab, ac) = (minus(&b, &a), minus(&c, &a));
        let normal = cross(&ab, &ac);
        if norm(&normal) <= f64::EPSILON * norm(&ab) * norm(&ac) {
            return refuse("has no area: remove it and join its neighbours");
        }
        Ok(unit(&normal))
    };
    triangles.iter().enumerate().map(face).collect()
}

/// The normal of every edge, and whether it is on an open end.
fn edge_normals(around: &Edges, faces: &[[f64; 3]]) -> BTreeMap<Edge, ([f64; 3], bool)> {
    let normal = |at: &Vec<usize>| at.iter().fold([0.0; 3], |sum, t| plus(&sum, &faces[*t]));
    around.iter().map(|(edge, at)| (*edge, (unit(&normal(at)), at.len() == 1))).collect()
}

/// The normal of every vertex, of the triangles around by their angles, and whether it is on an open end.
fn corner_normals(
    vertices: &[[f64; 3]],
    triangles: &[[usize; 3]],
    faces: &[[f64; 3]],
    edges: &BTreeMap<Edge, ([f64; 3], bool)>,
) -> Vec<([f64; 3], bool)> {
    let mut corners = vec![([0.0; 3], false); vertices.len()];
    for (t, face) in triangles.iter().zip(faces) {
        for i in 0..3 {
            let [a, b, c] = [t[i], t[(i + 1) % 3], t[(i + 2) % 3]].map(|v| vertices[v]);
            let cosine = dot(&unit(&minus(&b, &a)), &unit(&minus(&c, &a)));
            let corner = &mut corners[t[i]];
            corner.0 = plus(&corner.0, &times(face, cosine.clamp(-1.0, 1.0).acos()));
        }
        for (a, b) in sides(t) {
            if edges.get(&edge(a, b)).is_some_and(|(_, open)| *open) {
                corners[a].1 = true;
                corners[b].1 = true;
            }
        }
    }
    corners.into_iter().map(|(normal, open)| (unit(&normal), open)).collect()
}
