//! A matrix as independent blocks: the connected components of its sparsity.
//!
//! The modes of a symmetric structure do not couple; taken one by one, their poles are found faster and more accurately than in
//! one large matrix. Next file to read: [`super::pole`].

use nalgebra::DMatrix;

/// What rounding leaves between two modes of a matrix in orthogonal coordinates, relative to its largest entry. An entry
/// between two blocks moves a pole by its square over the distance of the poles, far less than the rounding of the poles
/// themselves (Golub & Van Loan 2013, §7.2).
pub const ROUNDING: f64 = 1e-12;

/// Rows of every block, in ascending order, such that no entry between two blocks of any matrix is larger than `negligible`
/// times the matrix's largest.
pub(crate) fn components(matrices: &[&DMatrix<f64>], negligible: f64) -> Vec<Vec<usize>> {
    let n = matrices.first().map_or(0, |a| a.nrows());
    let mut root: Vec<usize> = (0..n).collect();
    for a in matrices {
        let least = negligible * a.amax();
        for (j, column) in a.column_iter().enumerate() {
            for i in (0..n).filter(|&i| column[i].abs() > least) {
                let (p, q) = (find(&mut root, i), find(&mut root, j));
                root[p.max(q)] = p.min(q);
            }
        }
    }
    let mut blocks: Vec<Vec<usize>> = vec![Vec::new(); n];
    for i in 0..n {
        let block = find(&mut root, i);
        blocks[block].push(i);
    }
    blocks.retain(|block| !block.is_empty());
    blocks
}

/// The representative of `i`, with the way to it shortened.
fn find(root: &mut [usize], mut i: usize) -> usize {
    while root[i] != i {
        root[i] = root[root[i]];
        i = root[i];
    }
    i
}

/// The entries of a matrix between the rows of one block.
pub(crate) fn block(a: &DMatrix<f64>, rows: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows.len(), |i, j| a[(rows[i], rows[j])])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_joined_by_an_entry_of_any_of_the_matrices() {
        let mut a = DMatrix::identity(5, 5);
        a[(0, 3)] = 1e-300;
        let mut b = DMatrix::zeros(5, 5);
        b[(4, 1)] = -1.0;
        assert_eq!(components(&[&a, &b], 0.0), [vec![0, 3], vec![1, 4], vec![2]]);
        assert_eq!(components(&[&a], 1e-12).len(), 5, "the entry is rounding beside one");
        assert_eq!(components(&[&a], 0.0), [vec![0, 3], vec![1], vec![2], vec![4]]);
    }
}
