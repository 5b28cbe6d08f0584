//! Signed distances to profiles and meshes, what is refused as a surface, and what a distance sees of a sliding wall.
#![allow(clippy::float_cmp, clippy::unwrap_used, reason = "exact comparisons and helpers of tests")]

use std::f64::consts::PI;

use nalgebra::{Matrix2, Vector2};
use starlings_models_core::surface::{Mesh, Profile};

/// A tube around the x axis with `n` × `m` squares of two triangles, of radius `r(x)` over [0, 4].
fn tube(n: usize, m: usize, r: impl Fn(f64) -> f64) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let mut vertices = Vec::new();
    for i in 0..=n {
        for k in 0..m {
            let (x, angle) = (4.0 * i as f64 / n as f64, 2.0 * PI * k as f64 / m as f64);
            vertices.push([x, r(x) * angle.cos(), r(x) * angle.sin()]);
        }
    }
    let mut triangles = Vec::new();
    for i in 0..n {
        for k in 0..m {
            let [a, b] = [i * m + k, i * m + (k + 1) % m];
            triangles.extend([[a, b, b + m], [a, b + m, a + m]]);
        }
    }
    (vertices, triangles)
}

/// A cube of side 2 around the origin.
fn cube() -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let bit = |v: usize, i: usize| if v >> i & 1 == 1 { 1.0 } else { -1.0 };
    let vertices = (0..8).map(|v| [bit(v, 0), bit(v, 1), bit(v, 2)]).collect();
    let squares = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = squares.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    (vertices, triangles)
}

/// Numbers in (−1, 1) that look random (Lehmer's generator).
fn random(n: usize, seed: u64) -> Vec<f64> {
    let mut s = seed * 2 + 1;
    let mut next = || {
        s = s * 48_271 % 2_147_483_647;
        s as f64 / 1_073_741_823.5 - 1.0
    };
    (0..n).map(|_| next()).collect()
}

#[test]
fn the_distance_to_a_cube_is_that_of_its_closed_form_on_every_side_edge_and_corner() {
    let (vertices, triangles) = cube();
    let mesh = Mesh::new(vertices, triangles, 0).unwrap();
    for p in random(3000, 3).chunks(3) {
        let x = [2.5 * p[0], 2.5 * p[1], 2.5 * p[2]];
        let over = x.map(|v| v.abs() - 1.0);
        let outside = over.iter().map(|v| v.max(0.0).powi(2)).sum::<f64>().sqrt();
        let want = outside + over.into_iter().fold(f64::NEG_INFINITY, f64::max).min(0.0);
        let foot = mesh.foot(x).unwrap();
        // Coordinates of order one: rounding.
        assert!((foot.distance - want).abs() < 1e-14, "{x:?}: {} {want}", foot.distance);
        let moved = std::array::from_fn(|i| x[i] - foot.distance * foot.normal[i]);
        let back = mesh.foot(moved).unwrap();
        assert!(back.distance.abs() < 1e-14, "{x:?}: the foot is on the surface, {}", back.distance);
    }
    assert!(mesh.foot([f64::NAN, 0.0, 0.0]).is_none());
}

#[test]
fn the_tree_finds_the_facet_that_a_search_of_all_finds() {
    // Facets of very different sizes, where the nearest centre is often of another facet.
    let mut z = -0.3;
    let points: Vec<[f64; 2]> = random(60, 8)
        .chunks(2)
        .map(|p| {
            z += 0.001 + (p[0] + 1.0).powi(4) * 0.1;
            [z, 1.0 + 0.4 * p[1]]
        })
        .collect();
    let profile = Profile::new(points.clone()).unwrap();
    for p in random(800, 9).chunks(2) {
        let x = [z * (0.5 + 0.6 * p[0]), 1.0 + p[1]];
        let nearest = points.windows(2).map(|pair| {
            let line = Vector2::from(pair[1]) - Vector2::from(pair[0]);
            let from = Vector2::from(x) - Vector2::from(pair[0]);
            (from - line * (from.dot(&line) / line.norm_squared()).clamp(0.0, 1.0)).norm()
        });
        let want = nearest.fold(f64::INFINITY, f64::min);
        let foot = profile.foot(x).unwrap();
        let got = foot.distance.hypot(foot.past_end);
        assert!((got - want).abs() < 1e-14, "{x:?}: {got} {want}");
    }
}

#[test]
fn a_profile_and_the_mesh_of_its_revolution_give_the_same_distance() {
    let r = |x: f64| 1.0 + 0.2 * (x - 1.0).sin();
    let profile = Profile::new((0..=400).map(|i| f64::from(i) / 100.0).map(|x| [x, r(x)]).collect()).unwrap();
    let error = |m: usize| {
        let (vertices, triangles) = tube(m, m, r);
        let mesh = Mesh::new(vertices, triangles, 2).unwrap();
        let of = |p: &[f64]| {
            let (x, radius, angle) = (2.0 + 1.5 * p[0], 1.0 + 0.4 * p[1], PI * p[2]);
            let flat = profile.foot([x, radius]).unwrap();
            let full = mesh.foot([x, radius * angle.cos(), radius * angle.sin()]).unwrap();
            (flat.distance - full.distance).abs()
        };
        random(600, 4).chunks(3).map(of).fold(0.0, f64::max)
    };
    let (coarse, fine) = (error(50), error(100));
    // Chords of a circle, second order: r (1 − cos(π/m)) = 2e-3 at m = 50.
    assert!(coarse < 4e-3 && fine < coarse / 3.5, "{coarse:e} {fine:e}");
}

#[test]
fn past_an_open_end_the_distance_is_along_the_normal_and_the_overhang_is_told() {
    let profile = Profile::new(vec![[0.0, 1.0], [1.0, 1.0], [2.0, 1.0]]).unwrap();
    let foot = profile.foot([2.3, 1.4]).unwrap();
    assert!((foot.distance - 0.4).abs() < 1e-15 && (foot.past_end - 0.3).abs() < 1e-15, "{foot:?}");
    let (vertices, triangles) = tube(8, 6, |_| 1.0);
    let mesh = Mesh::new(vertices, triangles, 2).unwrap();
    // Over the middle of a flat side of the hexagon and past the end at 4.
    let side = (PI / 6.0).cos();
    let at = |radius: f64| [4.5, radius * (PI / 6.0).cos(), radius * (PI / 6.0).sin()];
    for radius in [side - 0.2, side + 0.2] {
        let foot = mesh.foot(at(radius)).unwrap();
        assert!((foot.distance - (radius - side)).abs() < 1e-14, "{foot:?}");
        assert!((foot.past_end - 0.5).abs() < 1e-14, "{foot:?}");
    }
}

#[test]
fn holes_branches_and_flipped_normals_are_refused_with_the_remedy() {
    let error = |vertices: &[[f64; 3]], triangles: &[[usize; 3]], ends: usize| {
        Mesh::new(vertices.to_vec(), triangles.to_vec(), ends).err().map(|e| e.to_string()).unwrap()
    };
    let (v, t) = tube(5, 8, |_| 1.0);
    assert!(Mesh::new(v.clone(), t.clone(), 2).is_ok());
    let text = error(&v, &t, 0);
    assert!(text.contains("2 holes more than the 0 declared") && text.contains("declare 2"), "{text}");
    let mut holed = t.clone();
    holed.remove(31);
    let text = error(&v, &holed, 2);
    assert!(text.contains("one hole more") && text.contains("of 3 edges around ("), "{text}");
    let text = error(&v, &t, 3);
    assert!(text.contains("3 open ends are declared and the surface has 2"), "{text}");
    let mut flipped = t.clone();
    flipped[20].swap(0, 1);
    let text = error(&v, &flipped, 2);
    assert!(text.contains("opposite normals") && text.contains("20"), "{text}");
    let inward: Vec<[usize; 3]> = t.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    let text = error(&v, &inward, 2);
    assert!(text.contains("point inward"), "{text}");
    let mut branched = t.clone();
    branched.push([t[0][1], t[0][2], v.len()]);
    let mut more = v.clone();
    more.push([0.3, 0.0, 3.0]);
    let text = error(&more, &branched, 2);
    assert!(text.contains("branches off"), "{text}");
    assert!(error(&v, &[[0, 1, 999]], 1).contains("999") && error(&v, &[], 0).contains("without triangles"));
    assert!(error(&v, &[[0, 1, 1]], 1).contains("no area"));
    // A cube inside out beside a right one.
    let (mut v, mut t) = cube();
    v.extend(v.clone().iter().map(|p| [p[0] * 0.5 + 9.0, p[1] * 0.5, p[2] * 0.5]));
    t.extend(t.clone().iter().map(|t| [t[0] + 8, t[2] + 8, t[1] + 8]));
    assert!(error(&v, &t, 0).contains("point inward where triangle 12"), "{}", error(&v, &t, 0));
}

#[test]
fn a_profile_that_runs_backwards_touches_the_axis_or_repeats_a_point_is_refused() {
    let error = |points: &[[f64; 2]]| Profile::new(points.to_vec()).err().map(|e| e.to_string()).unwrap();
    assert!(error(&[[1.0, 1.0], [0.0, 1.0]]).contains("reverse the order"));
    assert!(error(&[[0.0, 1.0], [1.0, 0.0]]).contains("r above zero"));
    assert!(error(&[[0.0, 1.0], [0.0, 1.0], [1.0, 1.0]]).contains("points 0 and 1"));
    assert!(
        error(&[[0.0, 1.0]]).contains("two or more")
            && error(&[[0.0, f64::NAN], [1.0, 1.0]]).contains("point 0")
    );
}

/// A tapered tube of length 10 whose wall is E = 2^(θ₀ + (θ₁ − θ₀) z/10), and the slide of its image.
mod sliding {
    pub(crate) const TAPER: f64 = 0.04;
    pub(crate) const TRUTH: [f64; 2] = [0.5, -0.5];

    pub(crate) fn radius(z: f64) -> f64 {
        1.2 - TAPER * z
    }

    /// Radial displacement of a thin ring under pressure p, in units of E h/(1 − ν²).
    pub(crate) fn eta(z: f64, p: f64, theta: [f64; 2]) -> f64 {
        p * radius(z).powi(2) / (theta[0] + (theta[1] - theta[0]) * z / 10.0).exp2()
    }

    /// How far the image's points have slid along the wall under pressure p: one centimetre for the largest.
    pub(crate) fn slide(p: f64) -> f64 {
        p / PRESSURES[3]
    }

    pub(crate) const PRESSURES: [f64; 4] = [0.02, 0.05, 0.09, 0.12];
}

/// Least squares in two parameters by Gauss–Newton with central differences.
fn fitted(residuals: impl Fn([f64; 2]) -> Vec<f64>) -> [f64; 2] {
    let mut theta = [0.0, 0.0];
    for _ in 0..20 {
        let at = residuals(theta);
        let slope = [0, 1].map(|j| {
            let moved = |by: f64| {
                let mut theta = theta;
                theta[j] += by;
                residuals(theta)
            };
            let pairs = moved(1e-4).into_iter().zip(moved(-1e-4));
            pairs.map(|(a, b)| (a - b) / 2e-4).collect::<Vec<_>>()
        });
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let normal = Matrix2::from_fn(|i, j| dot(&slope[i], &slope[j]));
        let step = normal.try_inverse().unwrap() * Vector2::new(dot(&slope[0], &at), dot(&slope[1], &at));
        theta = [theta[0] - step[0], theta[1] - step[1]];
    }
    theta
}

#[test]
fn a_signed_distance_finds_the_stiffness_that_displacements_of_a_sliding_image_overrate() {
    use sliding::{PRESSURES, TAPER, TRUTH, eta, radius, slide};
    let nodes: Vec<f64> = (0..20).map(|j| 0.25 + 0.45 * f64::from(j)).collect();
    // Each image: the deformed wall, shown by points that have slid along it by an unknown way.
    let images = PRESSURES.map(|p| {
        let shown = (0..=220).map(|k| -0.5 + 0.05 * f64::from(k) + slide(p));
        Profile::new(shown.map(|z| [z, radius(z) + eta(z, p, TRUTH)]).collect()).unwrap()
    });
    let distances = fitted(|theta| {
        let mut all = Vec::new();
        for (image, p) in images.iter().zip(PRESSURES) {
            all.extend(nodes.iter().map(|z| {
                let foot = image.foot([*z, radius(*z) + eta(*z, p, theta)]).unwrap();
                if foot.past_end > 0.0 { 0.0 } else { foot.distance }
            }));
        }
        all
    });
    for (got, truth) in distances.iter().zip(TRUTH) {
        // Chords of 0.05 cm on a curvature below 0.02/cm are 6e-6 cm off, of displacements of 0.1 cm.
        assert!((got - truth).abs() < 5e-4, "{distances:?}");
    }
    // The displacement of the image's point of the same name: the slide down the taper passes for a smaller one.
    let displacements = fitted(|theta| {
        let mut all = Vec::new();
        for p in PRESSURES {
            all.extend(nodes.iter().map(|z| {
                let named = z + slide(p);
                eta(*z, p, theta) - (radius(named) + eta(named, p, TRUTH) - radius(*z))
            }));
        }
        all
    });
    for (z, got, truth) in [(0.25, displacements[0], TRUTH[0]), (8.8, displacements[1], TRUTH[1])] {
        // η/(η − taper × slide), which is the same at every pressure; two parameters fit it all along but for 4 %.
        let stated =
            eta(z, PRESSURES[3], TRUTH) / (eta(z, PRESSURES[3], TRUTH) - TAPER * slide(PRESSURES[3]));
        let found = (got - truth).exp2();
        assert!((found / stated - 1.0).abs() < 0.05 && found > 1.4, "at {z}: {found} against {stated}");
    }
}
