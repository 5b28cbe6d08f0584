//! Vectors of two or three components. Next file to read: [`super::triangle`].

/// a − b.
pub(super) fn minus<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|i| a[i] - b[i])
}

/// a + b.
pub(super) fn plus<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// s a.
pub(super) fn times<const D: usize>(a: &[f64; D], s: f64) -> [f64; D] {
    a.map(|a| a * s)
}

/// a · b.
pub(super) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// |a|.
pub(super) fn norm<const D: usize>(a: &[f64; D]) -> f64 {
    dot(a, a).sqrt()
}

/// a/|a|; not-a-number for zero.
pub(super) fn unit<const D: usize>(a: &[f64; D]) -> [f64; D] {
    times(a, 1.0 / norm(a))
}

/// a × b.
pub(super) fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The mean of some points.
pub(super) fn mean<const D: usize>(points: &[[f64; D]]) -> [f64; D] {
    let sum = points.iter().fold([0.0; D], |sum, p| plus(&sum, p));
    times(&sum, 1.0 / points.len().max(1) as f64)
}
