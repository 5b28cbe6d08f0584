//! What the numbers of a table themselves say of its layout: rows of outputs one per time, each a 64-bit float.
//!
//! Where times and outputs are as many, a table cannot be told from its transpose by its length; a run over other times tells
//! them apart. Next file to read: [`crate::external`].

/// Difference of two runs that counts as none, relative to their largest value.
const SAME: f64 = 1e-9;

/// Whether two runs over the same first times agree as transposes of each other's layout and not as they are. `whole` and
/// `part` are the tables of `n` outputs with their numbers of times, `part` the shorter one.
pub fn is_transposed((whole, n_whole): (&[f64], usize), (part, n_part): (&[f64], usize), n: usize) -> bool {
    if whole.len() != n * n_whole || part.len() != n * n_part || n_part > n_whole {
        return false;
    }
    let largest = whole.iter().fold(f64::MIN_POSITIVE, |most, v| most.max(v.abs()));
    let transposed = (0..n).flat_map(|i| &whole[i * n_whole..i * n_whole + n_part]);
    let near = |(a, b): (&f64, &f64)| (a - b).abs() <= SAME * largest;
    part.iter().zip(transposed).all(near) && !part.iter().zip(whole).all(near)
}

/// A value of the table where all that are not zero lie below the smallest normal number: no computation gives such a table, but
/// the bytes of integers, or of floats in another byte order, read so.
pub fn foreign_bytes(values: &[f64]) -> Option<f64> {
    let mut some = values.iter().filter(|v| v.abs() > 0.0).peekable();
    let first = some.peek().copied().copied()?;
    some.all(|v| v.is_subnormal()).then_some(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transpose_is_told_from_a_table_by_another_number_of_times() {
        // Two outputs: t and 10 + t.
        let rows = |n: usize| (0..n).flat_map(|j| [j as f64, 10.0 + j as f64]).collect::<Vec<_>>();
        let columns = |n: usize| {
            let each = |from: f64| (0..n).map(move |j| from + j as f64);
            each(0.0).chain(each(10.0)).collect::<Vec<_>>()
        };
        for k in [1, 2, 3] {
            assert!(!is_transposed((&rows(5), 5), (&rows(k), k), 2), "{k}");
            assert!(is_transposed((&columns(5), 5), (&columns(k), k), 2), "{k}");
        }
        // A constant table is its own transpose.
        assert!(!is_transposed((&[1.0; 10], 5), (&[1.0; 4], 2), 2));
    }

    #[test]
    fn the_bytes_of_integers_and_of_another_order_are_no_numbers_of_a_computation() {
        let integers: Vec<f64> = [0_u64, 3, 41].map(f64::from_bits).to_vec();
        assert!(foreign_bytes(&integers).is_some());
        let swapped: Vec<f64> =
            [1.0, 2.5, 20.0].map(|v: f64| f64::from_bits(v.to_bits().swap_bytes())).to_vec();
        assert!(foreign_bytes(&swapped).is_some());
        assert!(foreign_bytes(&[0.0, 1e-310, 1.0]).is_none() && foreign_bytes(&[0.0]).is_none());
    }
}
