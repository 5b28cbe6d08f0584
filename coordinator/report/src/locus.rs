//! The page of the spectral laboratory: how poles move with the gain of each observer, and which gain is best.
//!
//! One self-contained HTML document. The loci stand in it as drawings and print as they are; a few lines of script move the
//! poles along them. Next file to read: [`plane`], then [`decay`].

mod decay;
mod gains;
mod plane;
mod view;

use starlings_models::spectrum::{Decay, ObserverSpectrum};

use super::{ReportError, layout};
use nalgebra::Complex;

/// What the page shows.
#[derive(Clone, Copy, Debug)]
pub struct Locus<'a> {
    /// Name of the study.
    pub study: &'a str,
    /// What it is about.
    pub says: &'a str,
    /// Kind of the model.
    pub model: &'a str,
    /// Unit label of every time.
    pub time_unit: &'a str,
    /// The observed outputs.
    pub outputs: &'a [String],
    /// Poles without observer, sorted by modulus.
    pub poles: &'a [Complex<f64>],
    /// How many of them are listed.
    pub listed: usize,
    /// The decay that is wanted.
    pub decay: Option<Decay>,
    /// What each observer does.
    pub observers: &'a [ObserverSpectrum],
    /// Observers that the model cannot host, and why.
    pub refused: &'a [(String, String)],
}

/// Makes the page: one HTML document that refers to nothing outside itself.
///
/// # Errors
///
/// [`ReportError`] when a pole cannot be followed, or a figure or the page cannot be made.
pub fn render(locus: &Locus<'_>) -> Result<String, ReportError> {
    layout::document(include_str!("locus/locus.html"), view::View::new(locus)?)
}

#[cfg(test)]
mod tests;
