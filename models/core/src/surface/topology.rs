//! What makes triangles a surface: every edge between two of them, turned alike, outward, with no holes but the open ends.
//!
//! Whether the surface cuts through itself is not looked at. Next file to read: [`super::mesh`].

use std::collections::BTreeMap;

use super::vector::{cross, dot, mean};
use crate::SetupError;

/// An undirected edge: its vertices, the smaller first.
pub(super) type Edge = (usize, usize);

/// The undirected edge between two vertices.
pub(super) fn edge(a: usize, b: usize) -> Edge {
    (a.min(b), a.max(b))
}

/// The triangles at every edge: one at an open end, else two.
pub(super) type Edges = BTreeMap<Edge, Vec<usize>>;

/// The directed edges of a triangle.
pub(super) fn sides(t: &[usize; 3]) -> [(usize, usize); 3] {
    [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]
}

fn refuse<T>(message: String) -> Result<T, SetupError> {
    Err(SetupError::Invalid(message))
}

/// The edges of triangles that are a surface with `open_ends` open ends, its normals outward.
///
/// # Errors
/// When an edge has more than two triangles, two neighbours are turned against each other, there are other border loops than the
/// open ends, or the normals point inward.
pub(super) fn checked(
    vertices: &[[f64; 3]],
    triangles: &[[usize; 3]],
    open_ends: usize,
) -> Result<Edges, SetupError> {
    let mut directed: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    let mut edges = Edges::new();
    for (i, triangle) in triangles.iter().enumerate() {
        for (a, b) in sides(triangle) {
            let at = edges.entry(edge(a, b)).or_default();
            if let Some(same) = at.iter().find(|t| sorted(triangles[**t]) == sorted(*triangle)) {
                return refuse(format!(
                    "triangles {same} and {i} of the surface have the same vertices, {}, {} and {}: the triangle is listed twice, \
                     remove one",
                    triangle[0], triangle[1], triangle[2]
                ));
            }
            at.push(i);
            if at.len() > 2 {
                return refuse(format!(
                    "triangles {}, {} and {i} share the edge of vertices {a} and {b}: a surface has two at most, \
                     remove what branches off",
                    at[0], at[1]
                ));
            }
            if let Some(other) = directed.insert((a, b), i) {
                return refuse(format!(
                    "triangles {other} and {i} of the surface have opposite normals: list the vertices of one of \
                     them in the opposite order"
                ));
            }
        }
    }
    let loops = border(&directed)?;
    if loops.len() != open_ends {
        return refuse(holes(vertices, &loops, open_ends));
    }
    outward(vertices, triangles, &loops)?;
    Ok(edges)
}

/// The vertices of a triangle whatever its turn.
fn sorted(mut triangle: [usize; 3]) -> [usize; 3] {
    triangle.sort_unstable();
    triangle
}

/// The border of the surface as loops of vertices, each in the direction of its triangles.
fn border(directed: &BTreeMap<(usize, usize), usize>) -> Result<Vec<Vec<usize>>, SetupError> {
    let mut next = BTreeMap::new();
    for (a, b) in directed.keys().filter(|(a, b)| !directed.contains_key(&(*b, *a))) {
        if next.insert(*a, *b).is_some() {
            return refuse(format!("two holes of the surface touch at vertex {a}: close them"));
        }
    }
    let mut loops = Vec::new();
    while let Some((start, mut at)) = next.pop_first() {
        let mut around = vec![start];
        while at != start {
            around.push(at);
            let Some(following) = next.remove(&at) else {
                return refuse(format!(
                    "the border of the surface ends at vertex {at}: close the holes there"
                ));
            };
            at = following;
        }
        loops.push(around);
    }
    Ok(loops)
}

/// What is wrong with the number of border loops.
fn holes(vertices: &[[f64; 3]], loops: &[Vec<usize>], open_ends: usize) -> String {
    let found = loops.len();
    let mut sorted: Vec<&Vec<usize>> = loops.iter().collect();
    sorted.sort_by_key(|around| around.len());
    if found < open_ends {
        return format!(
            "{open_ends} open ends are declared and the surface has {found}: cut it open, or declare {found}"
        );
    }
    let places: Vec<String> = sorted[..found - open_ends]
        .iter()
        .map(|around| {
            let [x, y, z] = mean(&around.iter().map(|v| vertices[*v]).collect::<Vec<_>>());
            format!("of {} edges around ({x:.3}, {y:.3}, {z:.3})", around.len())
        })
        .collect();
    format!(
        "the surface has {} more than the {open_ends} declared open ends, {}: close them, or declare {found} open \
         ends",
        if places.len() == 1 { "one hole".to_owned() } else { format!("{} holes", places.len()) },
        places.join(", ")
    )
}

/// Refuses a part of the surface with nothing or less inside, its open ends closed by fans from their centres.
fn outward(vertices: &[[f64; 3]], triangles: &[[usize; 3]], loops: &[Vec<usize>]) -> Result<(), SetupError> {
    let part = parts(vertices.len(), triangles);
    // Relative to a vertex of the surface, so that a place far from the origin costs no digits.
    let origin = vertices[triangles[0][0]];
    let volume = |[a, b, c]: [[f64; 3]; 3]| {
        let [a, b, c] = [a, b, c].map(|v| super::vector::minus(&v, &origin));
        dot(&a, &cross(&b, &c)) / 6.0
    };
    let mut inside: BTreeMap<usize, (f64, usize)> = BTreeMap::new();
    for (i, t) in triangles.iter().enumerate() {
        inside.entry(part[t[0]]).or_insert((0.0, i)).0 += volume(t.map(|v| vertices[v]));
    }
    for around in loops {
        let centre = mean(&around.iter().map(|v| vertices[*v]).collect::<Vec<_>>());
        let Some((sum, _)) = inside.get_mut(&part[around[0]]) else { continue };
        for (i, v) in around.iter().enumerate() {
            let following = around[(i + 1) % around.len()];
            *sum += volume([vertices[following], vertices[*v], centre]);
        }
    }
    match inside.values().find(|(volume, _)| *volume <= 0.0) {
        None => Ok(()),
        Some((_, triangle)) => refuse(format!(
            "the normals of the surface point inward where triangle {triangle} is: list the vertices of every triangle \
             there in the opposite order"
        )),
    }
}

/// For each vertex, the smallest vertex that it is connected with.
fn parts(n: usize, triangles: &[[usize; 3]]) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..n).collect();
    let root = |parent: &mut Vec<usize>, mut v: usize| {
        while parent[v] != v {
            parent[v] = parent[parent[v]];
            v = parent[v];
        }
        v
    };
    for t in triangles {
        for (a, b) in sides(t) {
            let (a, b) = (root(&mut parent, a), root(&mut parent, b));
            parent[a.max(b)] = a.min(b);
        }
    }
    (0..n).map(|v| root(&mut parent, v)).collect()
}
