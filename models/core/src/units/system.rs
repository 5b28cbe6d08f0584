//! Whether one system of units explains several labels at once.
//!
//! A model that is given in mmHg and mL holds as well in dyn and cm, as long as everything changes together: every base unit
//! may be scaled, and a label then scales by its exponents (dimensional homogeneity, Bridgman 1922, ch. 4). Next file to
//! read: [`super::labels`].

use super::{EXPONENT, FACTOR, Unit};

/// Whether some scaling of the base units turns every second unit of a pair into its first. The two of a pair must have the
/// same dimension.
pub fn consistent(pairs: &[(Unit, Unit)]) -> bool {
    // Σ exponent · log(scale of the base unit) = log(factor), solved by elimination; what is left over must vanish.
    let mut reduced: Vec<(usize, [f64; 8])> = Vec::new();
    for (given, model) in pairs {
        let mut row = [0.0; 8];
        row[..7].copy_from_slice(&model.exponents);
        row[7] = (given.factor / model.factor).ln();
        for (pivot, known) in &reduced {
            let times = row[*pivot];
            for (a, b) in row.iter_mut().zip(known) {
                *a -= times * b;
            }
        }
        let largest = (0..7).max_by(|a, b| row[*a].abs().total_cmp(&row[*b].abs())).unwrap_or(0);
        if row[largest].abs() > EXPONENT {
            let scale = row[largest];
            reduced.push((largest, row.map(|v| v / scale)));
        } else if row[7].abs() > 10.0 * FACTOR {
            return false;
        }
    }
    true
}
