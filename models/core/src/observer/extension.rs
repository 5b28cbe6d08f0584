//! The K-harmonic extension of a displacement from the observed nodes to the whole wall.
//!
//! Of all displacements with the given values on the observed nodes it has the least elastic energy ½ dᵀ K d, so the
//! unobserved part carries no force (Moireau, Chapelle & Le Tallec 2009, §3). Next file to read: [`super::sdf`].

use nalgebra::DMatrix;

use super::wall::solve;

/// P, n × n_observed: the extension of each observed node's unit displacement; Ext = P H.
///
/// The identity on observed nodes and −K_uu⁻¹ K_uo on the others; not-a-number where K_uu is not positive definite.
pub(super) fn extension(stiffness: &DMatrix<f64>, observed: &[bool]) -> DMatrix<f64> {
    let of = |seen: bool| observed.iter().enumerate().filter(move |(_, s)| **s == seen).map(|(node, _)| node);
    let (known, unknown): (Vec<usize>, Vec<usize>) = (of(true).collect(), of(false).collect());
    let mut extension = DMatrix::zeros(observed.len(), known.len());
    for (column, node) in known.iter().enumerate() {
        extension[(*node, column)] = 1.0;
    }
    if unknown.is_empty() {
        return extension;
    }
    let free = stiffness.select_rows(&unknown);
    let rest = solve(free.select_columns(&unknown), -free.select_columns(&known));
    for (row, node) in unknown.iter().enumerate() {
        extension.row_mut(*node).copy_from(&rest.row(row));
    }
    extension
}

/// H w: the entries of observed nodes alone.
pub(super) fn seen(value: &[f64], observed: &[bool]) -> Vec<f64> {
    value.iter().zip(observed).filter(|(_, seen)| **seen).map(|(value, _)| *value).collect()
}

/// P H, n × n: columns of unobserved nodes are zero.
pub(super) fn onto_all(columns: &DMatrix<f64>, observed: &[bool]) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(columns.nrows(), observed.len());
    let nodes = observed.iter().enumerate().filter(|(_, seen)| **seen);
    for (column, (node, _)) in nodes.enumerate() {
        all.column_mut(node).copy_from(&columns.column(column));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_of_springs_is_extended_along_a_straight_line() {
        // Springs of stiffness 1 between four nodes and a fixed wall on the right; nodes 0 and 3 are observed.
        let stiffness = DMatrix::from_row_slice(
            4,
            4,
            &[1., -1., 0., 0., -1., 2., -1., 0., 0., -1., 2., -1., 0., 0., -1., 2.],
        );
        let observed = [true, false, false, true];
        let extended = extension(&stiffness, &observed) * DMatrix::from_column_slice(2, 1, &[0.0, 3.0]);
        // Two solves of order one: rounding.
        assert!((extended - DMatrix::from_column_slice(4, 1, &[0.0, 1.0, 2.0, 3.0])).amax() < 1e-14);
    }
}
