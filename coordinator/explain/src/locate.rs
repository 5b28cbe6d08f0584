//! Where simulation and data disagree: residuals by channel, span, operating region and frequency, and the signals that they
//! correlate with.
//!
//! Nothing here decides what is missing, and except for [`unknown_inputs`] nothing is run: the residuals of finished runs are
//! described in several ways. Next files to read: [`result`] for what comes out, [`places`] for how a place is found.

mod bootstrap;
mod channels;
mod correlate;
mod maps;
mod places;
mod region;
mod residuals;
pub(crate) mod result;
mod scan;
mod sentence;
mod signal;
mod spectra;
pub(crate) mod unknown_input;

pub use maps::map_again;
pub use result::{
    ChannelGap, Correlated, Located, MisfitPlace, RegionMap, ResidualSpectrum, Track, UnknownInput,
};
use starlings_study::Study;
pub use unknown_input::{MOST_RUNS, unknown_inputs};

use crate::rows::Rows;

/// Finished runs of one model, whose residuals are to be described.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The study.
    pub study: &'a Study,
    /// Its measured values.
    pub rows: &'a Rows,
    /// What was simulated, one per row, in the channel's unit.
    pub predicted: &'a [f64],
    /// Standard deviation of the prediction by the uncertainty of the fit, one per row.
    pub prediction_sd: Option<&'a [f64]>,
    /// Signals of the simulation along the records.
    pub tracks: &'a [Track],
    /// Seed of the bootstrap.
    pub seed: u64,
}

/// Everything that can be said of the residuals without another run; [`Located::forces`] stays empty.
pub fn locate(view: &View<'_>) -> Located {
    let groups = residuals::groups(view);
    Located {
        places: places::places(view, &groups),
        channels: channels::channels(view),
        maps: maps::maps(view, &groups),
        correlations: correlate::correlations(view, &groups),
        spectra: spectra::spectra(view),
        forces: Vec::new(),
    }
}
