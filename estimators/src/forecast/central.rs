//! The central interval of an ensemble that holds another draw as often as it says.

/// Lower end of the central 95 % interval, median and upper end of draws, in this order; NaN without any.
///
/// Quantiles are those of the expected position, (n + 1)p among the order statistics (Hyndman and Fan 1996, definition 6), so that one
/// more draw lies within the interval with probability 0.95 whatever the number of draws from 39 on; fewer give their extremes.
pub fn central95(mut draws: Vec<f64>) -> [f64; 3] {
    draws.sort_by(f64::total_cmp);
    [0.025, 0.5, 0.975].map(|p| expected(&draws, p))
}

fn expected(sorted: &[f64], p: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = (p * (sorted.len() + 1) as f64 - 1.0).clamp(0.0, last as f64);
    let k = at.floor() as usize;
    let next = sorted[(k + 1).min(last)];
    (at - k as f64).mul_add(next - sorted[k], sorted[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_equally_likely_places_leaves_out_one_in_twenty() {
        // Of n draws from the uniform distribution the k-th is k/(n + 1) on average: the ends are at 0.025 and 0.975 of it.
        for n in [39_u32, 200, 999] {
            let draws: Vec<f64> = (1..=n).rev().map(|k| f64::from(k) / f64::from(n + 1)).collect();
            let [lo, median, hi] = central95(draws);
            assert!((lo - 0.025).abs() < 1e-14 && (median - 0.5).abs() < 1e-14 && (hi - 0.975).abs() < 1e-14);
        }
        assert!(central95(Vec::new())[1].is_nan());
        assert!(central95(vec![3.0]).iter().all(|v| (v - 3.0).abs() < 1e-15));
    }
}
