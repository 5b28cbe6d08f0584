//! The linear system of a chain of cells: symmetric, tridiagonal, positive definite.
//!
//! Unknown k is the flow through the downstream face of cell k. A face opposes the flow through it, and a cell's wall opposes
//! the difference of the flows through its two faces: diagonal `face + wall[k] + wall[k + 1]`, off the diagonal
//! `−wall[k + 1]`. The last face is half as long and feeds the outlet. Next file to read: [`super::midpoint`].

/// The factors of one such matrix, L D Lᵀ (Golub & Van Loan 2013, section 4.3.6).
pub(super) struct Chain<'a> {
    /// 1/D.
    inverse: &'a mut [f64],
    /// −L below the diagonal: positive, and below one.
    ratio: &'a mut [f64],
}

impl<'a> Chain<'a> {
    /// Factors the matrix into the two slices, as long as `wall`, which has at least one entry.
    pub(super) fn factor(
        face: f64,
        wall: &[f64],
        outlet: f64,
        inverse: &'a mut [f64],
        ratio: &'a mut [f64],
    ) -> Self {
        let last = wall.len() - 1;
        let mut pivot = face + wall[0];
        for k in 0..last {
            let next = wall[k + 1];
            inverse[k] = 1.0 / (pivot + next);
            ratio[k] = next * inverse[k];
            // What is left of `next` after elimination, next − next²/D, without the cancellation.
            pivot = face + pivot * ratio[k];
        }
        inverse[last] = 1.0 / (pivot - 0.5 * face + outlet);
        ratio[last] = 0.0;
        Self { inverse, ratio }
    }

    /// Solves in place.
    pub(super) fn solve(&self, r: &mut [f64]) {
        let mut below = 0.0;
        let mut ratio = 0.0;
        for (r, next) in r.iter_mut().zip(&*self.ratio) {
            below = *r + ratio * below;
            ratio = *next;
            *r = below;
        }
        let mut above = 0.0;
        for ((r, inverse), ratio) in r.iter_mut().zip(&*self.inverse).zip(&*self.ratio).rev() {
            above = *r * inverse + ratio * above;
            *r = above;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solution_satisfies_the_equations_of_every_face() {
        let (face, wall, outlet) = (0.7, [3.0, 0.2, 50.0, 1.0], 4.0);
        for n in 1..=wall.len() {
            let wall = &wall[..n];
            let (mut inverse, mut ratio) = (vec![0.0; n], vec![0.0; n]);
            let chain = Chain::factor(face, wall, outlet, &mut inverse, &mut ratio);
            let r: Vec<f64> = (0..n).map(|k| (k as f64).cos()).collect();
            let mut q = r.clone();
            chain.solve(&mut q);
            for k in 0..n {
                let own = if k + 1 == n { 0.5 * face + outlet } else { face + wall[k + 1] };
                let mut left = (own + wall[k]) * q[k];
                left -= if k > 0 { wall[k] * q[k - 1] } else { 0.0 };
                left -= if k + 1 < n { wall[k + 1] * q[k + 1] } else { 0.0 };
                // Rounding of terms of about 50.
                assert!((left - r[k]).abs() < 1e-13, "face {k} of {n}: {left} against {}", r[k]);
            }
        }
    }
}
