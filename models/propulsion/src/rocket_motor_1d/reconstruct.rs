//! Values at the two ends of every cell from the means of cells: linear with limited slopes (van Leer 1979).
//!
//! Next file to read: [`super::exit`].

use super::gas::Gas;

/// States at the lower and upper end of every cell. A wall stands before the first cell; beyond the last one its slope goes on.
pub(super) fn ends(cells: &[Gas], ends: &mut [[Gas; 2]]) {
    let n = cells.len();
    for (i, end) in ends.iter_mut().enumerate() {
        let own = cells[i];
        let before = if i == 0 { own.mirrored() } else { cells[i - 1] };
        let after = if i + 1 < n { cells[i + 1] } else { beyond(cells) };
        let slope = |part: fn(Gas) -> f64| 0.5 * limited(part(own) - part(before), part(after) - part(own));
        let half = Gas { rho: slope(|g| g.rho), u: slope(|g| g.u), p: slope(|g| g.p) };
        let moved = |sign: f64| Gas {
            rho: own.rho + sign * half.rho,
            u: own.u + sign * half.u,
            p: own.p + sign * half.p,
        };
        let both = [moved(-1.0), moved(1.0)];
        *end = if both.iter().all(|gas| gas.is_sound()) { both } else { [own, own] };
    }
}

/// The last cell's neighbour on the line through the last two.
fn beyond(cells: &[Gas]) -> Gas {
    let (last, other) = (cells[cells.len() - 1], cells[cells.len() - 2]);
    Gas { rho: 2.0 * last.rho - other.rho, u: 2.0 * last.u - other.u, p: 2.0 * last.p - other.p }
}

/// Harmonic mean of two differences, zero at an extremum (van Leer 1979, "Towards the ultimate conservative difference scheme", V).
fn limited(a: f64, b: f64) -> f64 {
    if a * b > 0.0 { 2.0 * a * b / (a + b) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_course_is_kept_and_an_extremum_makes_no_new_values() {
        let gas = |v: f64| Gas { rho: 1.0 + v, u: v, p: 2.0 + v };
        let cells: Vec<Gas> = [0.1, 0.3, 0.5, 0.2, 0.1].map(gas).into();
        let mut found = vec![[Gas::default(); 2]; 5];
        ends(&cells, &mut found);
        assert!((found[1][0].p - 2.2).abs() < 1e-15 && (found[1][1].p - 2.4).abs() < 1e-15);
        assert!(found[2][0] == cells[2] && found[2][1] == cells[2], "the highest cell is flat");
        assert!((found[4][1].rho - 1.05).abs() < 1e-15, "the last slope goes on");
    }
}
