//! The report of a run: one self-contained HTML page and one overview picture, made from plain data.
//!
//! [`reader`] fills [`ReportData`] from the store; [`render`] and [`overview_svg`] turn it into text and know neither the
//! store nor the study. The page reads without script and needs no network and no font, works on a phone and in print, and states
//! warnings before numbers; a script inside it shows values under the pointer. Deliberately absent: computing anything that was not stored. Next file to read: [`data`].

mod compare;
mod correlation;
mod data;
mod diagnose;
mod explain;
mod explained;
mod files;
mod forecast;
mod hangs_on;
mod headline;
mod identify;
mod infer;
mod layout;
pub mod locus;
mod number;
mod overview;
mod page;
mod plot;
pub mod reader;
#[cfg(test)]
mod sample;
#[cfg(test)]
mod tests;
mod why;

pub use compare::{CompareError, Comparison, compare, compare_page};
pub use data::ReportData;
pub use diagnose::{diagnosis_page, write_diagnosis};
pub use explained::{state_names, write_explanation};
pub use files::{FilesError, write_files, write_page};
pub use forecast::forecast_page;
pub use identify::identify_page;
pub use infer::{coefficients_csv, infer_page, write_inference};
pub use overview::overview_svg;
pub use why::{Answer, WhyError, why};

/// Why a report could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A figure could not be drawn.
    #[error("a figure of the report could not be drawn: {0}")]
    Drawing(String),
    /// The page could not be put together.
    #[error("the page of the report could not be put together: {0}")]
    Template(#[from] minijinja::Error),
}

impl ReportError {
    fn drawing(cause: impl std::fmt::Display) -> Self {
        Self::Drawing(cause.to_string())
    }
}

/// Makes the page: one HTML document that refers to nothing outside itself.
///
/// # Errors
///
/// [`ReportError`] when a figure or the page cannot be made; data that are missing are shown as missing.
pub fn render(data: &ReportData) -> Result<String, ReportError> {
    layout::document(include_str!("report.html"), page::Page::new(data)?)
}

impl ReportData {
    /// What the horizontal axis of a course over the run says.
    fn x_label(&self) -> &str {
        if self.x_label.is_empty() { "step" } else { &self.x_label }
    }

    /// Whether the values of a parameter belong on a logarithmic axis.
    fn log_axis(&self, parameter: &str) -> bool {
        self.tracks.iter().any(|track| track.name == parameter && track.log_axis)
    }
}
