//! Matrices and vectors as they are written: shape and values, columns one after the other.
//!
//! What is read may come from another machine, so a shape that its values do not fill is an error; nalgebra's own reader multiplies
//! whatever rows and columns it is told. Used by `#[serde(with = ...)]`. Read next: `sums.rs`.

/// n x m: rows, columns, values.
pub(crate) mod matrix {
    use nalgebra::DMatrix;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(matrix: &DMatrix<f64>, to: S) -> Result<S::Ok, S::Error> {
        (matrix.nrows(), matrix.ncols(), matrix.as_slice()).serialize(to)
    }

    pub(crate) fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<DMatrix<f64>, D::Error> {
        let (rows, columns, values) = <(usize, usize, Vec<f64>)>::deserialize(from)?;
        if rows.checked_mul(columns) != Some(values.len()) {
            return Err(D::Error::custom(format!("{} values are no {rows} x {columns}", values.len())));
        }
        Ok(DMatrix::from_vec(rows, columns, values))
    }
}

/// n values.
pub(crate) mod vector {
    use nalgebra::DVector;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(vector: &DVector<f64>, to: S) -> Result<S::Ok, S::Error> {
        vector.as_slice().serialize(to)
    }

    pub(crate) fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<DVector<f64>, D::Error> {
        Vec::deserialize(from).map(DVector::from_vec)
    }
}
