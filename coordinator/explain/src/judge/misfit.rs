//! The misfit of a fit on training rows, held-out rows and held-out channels, which the gates compare.
//!
//! Next file to read: [`super::gates`].

use crate::fit::fitted_variant::FittedVariant;
use crate::rows::Usage;
use crate::run_cache::RunCache;

/// Squares of the whitened residuals of one variant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Misfit {
    /// χ² of the training rows plus prior.
    pub train: f64,
    /// χ² of the held-out rows of the fitted channels.
    pub held_out: f64,
    /// Number of the held-out rows of the fitted channels.
    pub n_held_out: usize,
    /// χ² of the channels that are never fitted.
    pub channels: f64,
}

impl Misfit {
    /// The misfit of a fit.
    pub(crate) fn of(cache: &RunCache<'_>, fit: &FittedVariant<'_>) -> Self {
        let whitened = cache.rows.whitened(&fit.predicted);
        let sum = |usage| {
            let rows = cache.rows.rows.iter().zip(&whitened).filter(|(row, _)| row.usage == usage);
            rows.fold((0, 0.0), |(n, sum), (_, e)| (n + 1, sum + e * e))
        };
        let (n_held_out, held_out) = sum(Usage::HeldOut);
        Self { train: fit.cost(), held_out, n_held_out, channels: sum(Usage::HeldOutChannel).1 }
    }
}
