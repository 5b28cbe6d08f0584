//! Walls that were registered as meshes or profiles: formats of files, what is refused, noise along and across.
// Values that are copied are compared exactly; the helpers of a test file are tests too.
#![allow(clippy::float_cmp, clippy::unwrap_used)]
mod study_kit;
mod wall_kit;

use std::fmt::Write as _;

use study_kit::{Case, csv, grid};
use wall_kit::{NODES, SD, SURFACE, TRUTH, displacements, flow, problem, profiles, rest, study};

/// The wall of the tube at one time: vertices and triangles.
type Wall = (Vec<[f64; 3]>, Vec<[usize; 3]>);

fn wall(displaced: &[f64]) -> Wall {
    let m = 48;
    let ends = [(-1.0, 0), (2.5, 0), (7.5, 1), (12.5, 2), (17.5, 3), (22.5, 4), (26.0, 4)];
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (z, node) in ends {
        // Chords are inside the wall by r (1 − cos(π/m)): the corners stand so far out that the middle of an edge is on it.
        let r = (1.0 + displaced[node]) / (std::f64::consts::PI / m as f64).cos();
        for j in 0..m {
            let angle = std::f64::consts::TAU * (j as f64 + 0.5) / m as f64;
            vertices.push([z, r * angle.cos(), r * angle.sin()]);
        }
    }
    for i in 0..ends.len() - 1 {
        for j in 0..m {
            let (a, b) = (i * m + j, i * m + (j + 1) % m);
            triangles.extend([[a, b, b + m], [a, b + m, a + m]]);
        }
    }
    (vertices, triangles)
}

fn as_off((vertices, triangles): &Wall) -> String {
    let mut off = format!("OFF\n{} {} 0\n", vertices.len(), triangles.len());
    for [x, y, z] in vertices {
        writeln!(off, "{x} {y:?} {z:?}").unwrap();
    }
    for [a, b, c] in triangles {
        writeln!(off, "3 {a} {b} {c}").unwrap();
    }
    off
}

fn as_stl((vertices, triangles): &Wall) -> String {
    let mut stl = "solid\n".to_owned();
    for corners in triangles {
        stl += "facet normal 0 0 0\nouter loop\n";
        corners
            .map(|v| vertices[v])
            .iter()
            .for_each(|[x, y, z]| writeln!(stl, "vertex {x} {y:?} {z:?}").unwrap());
        stl += "endloop\nendfacet\n";
    }
    stl + "endsolid\n"
}

fn as_vtp((vertices, triangles): &Wall) -> String {
    let points: Vec<String> = vertices.iter().map(|[x, y, z]| format!("{x} {y:?} {z:?}")).collect();
    let corners: Vec<String> = triangles.iter().map(|[a, b, c]| format!("{a} {b} {c}")).collect();
    let ends: Vec<String> = (1..=triangles.len()).map(|i| (3 * i).to_string()).collect();
    format!(
        "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPolys=\"{}\"><Points><DataArray type=\"Float64\" format=\"ascii\">{}\
         </DataArray></Points><Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">{}</DataArray><DataArray \
         type=\"Int64\" Name=\"offsets\" format=\"ascii\">{}</DataArray></Polys></Piece></PolyData></VTKFile>",
        triangles.len(),
        points.join(" "),
        corners.join(" "),
        ends.join(" ")
    )
}

const MESHES: &str = r#"surface = "meshes.csv", rest = "nodes.csv", output = "displacement", noise = 0.01"#;

/// The files of a study with meshes of every eighth time, each changed and then written by `write` with this ending.
fn meshes(ending: &str, write: fn(&Wall) -> String, change: impl Fn(&mut Wall)) -> Vec<(String, String)> {
    let (times, columns) = displacements(0.0);
    let mut list = "time,file\n".to_owned();
    let mut files = vec![("flow.csv".to_owned(), flow())];
    for (k, t) in times.iter().enumerate().step_by(8) {
        writeln!(list, "{t},mesh{k}.{ending}").unwrap();
        let mut wall = wall(&columns.iter().map(|column| column[k]).collect::<Vec<_>>());
        change(&mut wall);
        files.push((format!("mesh{k}.{ending}"), write(&wall)));
    }
    files.push(("meshes.csv".to_owned(), list));
    let (one, zero) = ([1.0; 5], [0.0; 5]);
    files.push(("nodes.csv".to_owned(), csv("x,y,z,nx,ny,nz", &[&NODES, &one, &zero, &zero, &one, &zero])));
    files
}

/// A mesh of a wall as the text of a file.
type Writer = fn(&Wall) -> String;

fn borrowed(files: &[(String, String)]) -> Vec<(&str, String)> {
    files.iter().map(|(name, text)| (name.as_str(), text.clone())).collect()
}

#[test]
fn meshes_of_a_tube_are_read_and_compared_along_the_given_normals() {
    let formats: [(&str, Writer); 3] = [("off", as_off), ("stl", as_stl), ("VTP", as_vtp)];
    let estimates = formats.map(|(ending, write)| {
        let files = meshes(ending, write, |_| {});
        let done = Case::new(&study(MESHES), &borrowed(&files)).run();
        // As on a profile; the triangles of a band are not quite in the cone of their corners.
        assert!((done.estimate("E1").estimate / TRUTH - 1.0).abs() < 0.01, "{:?}", done.estimate("E1"));
        done.estimate("E1").estimate
    });
    assert!((estimates[2] / estimates[0] - 1.0).abs() < 1e-9, "{estimates:?}");
    // Numbers of STL have seven digits.
    assert!((estimates[1] / estimates[0] - 1.0).abs() < 1e-5, "{estimates:?}");
}

#[test]
fn meshes_that_are_open_inverted_or_of_another_unit_are_refused_with_their_file() {
    let said = |ending: &str, write: fn(&Wall) -> String, channel: &str, change: fn(&mut Wall)| {
        problem(&study(channel), &borrowed(&meshes(ending, write, change)))
    };
    let closed = format!("{MESHES}, open_ends = 0");
    let open = said("off", as_off, &closed, |_| {});
    assert!(open.starts_with("mesh0.off:1:") && open.contains("open_ends"), "{open}");
    for (ending, write) in [("stl", as_stl as fn(&Wall) -> String), ("vtp", as_vtp)] {
        let hole = said(ending, write, MESHES, |(_, triangles)| {
            triangles.remove(200);
        });
        assert!(hole.starts_with(&format!("mesh0.{ending}:1:")) && hole.contains("one hole"), "{hole}");
        assert!(hole.contains("of 3 edges around (9.167"), "{hole}");
        let inverted =
            said(ending, write, MESHES, |(_, triangles)| triangles.iter_mut().for_each(|t| t.swap(0, 1)));
        assert!(inverted.contains("point inward where triangle 0 is"), "{inverted}");
        let twisted = said(ending, write, MESHES, |(_, triangles)| triangles[7].swap(0, 1));
        assert!(twisted.contains("7 of the surface have opposite normals"), "{twisted}");
        let twice = said(ending, write, MESHES, |(_, triangles)| triangles.push(triangles[7]));
        assert!(twice.contains("triangles 7 and 576 of the surface have the same vertices"), "{twice}");
        let larger = said(ending, write, MESHES, |(vertices, _)| {
            vertices.iter_mut().flatten().for_each(|x| *x *= 1000.0);
        });
        assert!(larger.starts_with("study.toml:") && larger.contains("the same unit"), "{larger}");
        assert!(larger.contains("`meshes.csv` at time 0 has a radius of 1"), "{larger}");
        // The vessel reaches beyond the nodes in either unit: only its width tells millimetres from centimetres.
        let millimetres = said(ending, write, MESHES, |(vertices, _)| {
            vertices.iter_mut().flatten().for_each(|x| *x *= 10.0);
        });
        let told = [
            "nodes at rest of `nodes.csv` have 1.0",
            "are those of mm",
            "is in cm: multiply its points by 0.1",
        ];
        assert!(told.iter().all(|words| millimetres.contains(words)), "{millimetres}");
        let smaller = said(ending, write, MESHES, |(vertices, _)| {
            vertices.iter_mut().flatten().for_each(|x| *x *= 0.001);
        });
        assert!(smaller.contains("the same unit"), "{smaller}");
    }
    let cut = said("stl", |wall| as_stl(wall).replacen("endloop", "", 1), MESHES, |_| {});
    assert!(cut.starts_with("mesh0.stl:") && cut.contains("triangle 0: ") && cut.contains("STL"), "{cut}");
}

#[test]
fn profiles_of_another_unit_are_refused() {
    for (factor, word) in
        [(10.0, "multiply its points by 0.1"), (1000.0, "the same unit"), (0.001, "the same unit")]
    {
        let scaled = |line: &str| {
            let parts: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
            format!("{},{:?},{:?}", parts[0], factor * parts[1], factor * parts[2])
        };
        let text = profiles(0.0, 0.0);
        let (head, rows) = text.split_once('\n').unwrap();
        let rows: Vec<String> = rows.lines().map(scaled).collect();
        let files = [
            ("flow.csv", flow()),
            ("rest.csv", rest()),
            ("profiles.csv", format!("{head}\n{}\n", rows.join("\n"))),
        ];
        let said = problem(&study(SURFACE), &files);
        assert!(
            said.starts_with("study.toml:") && said.contains("`profiles.csv`") && said.contains(word),
            "{said}"
        );
    }
}

#[test]
fn noise_along_the_wall_counts_where_the_wall_leans() {
    // The nodes move along the radius: of a level wall they see the noise across alone, of a cone of 45° half of either variance.
    let sd = |radius: fn(f64) -> f64, extra: &str| {
        let mut text = "time,z,r\n".to_owned();
        for t in grid(41, 0.02) {
            for z in [-1.0, 10.0, 26.0] {
                writeln!(text, "{t},{z},{:?}", radius(z)).unwrap();
            }
        }
        let radii = NODES.map(radius);
        let rest = csv("z,r,nz,nr", &[&NODES, &radii, &[0.0; 5], &[1.0; 5]]);
        let files = [("flow.csv", flow()), ("rest.csv", rest), ("profiles.csv", text)];
        let done = Case::new(&study(&format!("{SURFACE}{extra}")), &files).run();
        done.summary.fit.channels[0].noise
    };
    let level = |_: f64| 1.0;
    let cone = |z: f64| 2.0 + z;
    // Variances are summed as n² σ², so that the sd itself comes back to rounding.
    let near =
        |found: f64, sought: f64| assert!((found / sought - 1.0).abs() < 1e-14, "{found} for {sought}");
    near(sd(level, ", noise_along = 0.07"), SD);
    near(sd(cone, ""), SD);
    // √((0.01² + 0.07²)/2) = 0.05.
    let leaning = sd(cone, ", noise_along = 0.07");
    assert!((leaning - 0.05).abs() < 1e-9, "{leaning}");
    let said = problem(
        &study(&format!("{SURFACE}, noise_along = -1.0")),
        &[("flow.csv", flow()), ("rest.csv", rest()), ("profiles.csv", profiles(0.0, 0.0))],
    );
    assert!(said.contains("`noise_along` must be zero or more, found -1"), "{said}");
}
