//! Residuals by frequency, against white noise of the channel's standard deviation.
//!
//! Next file to read: `alarm.rs`.

use starlings_explain::Figures;
use starlings_explain::locate::ResidualSpectrum;
use starlings_explain::result::Explanation;

use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{GREEN, VERMILION};
use crate::plot::scene::Scene;

/// Spectra drawn at most.
const SPECTRA: usize = 6;

/// The first spectra that have anything to show.
pub(super) fn figures(_: &Explanation, data: &Figures) -> Vec<Figure> {
    let spectra = data.before.spectra.iter().take(SPECTRA);
    spectra.filter_map(|s| figure(s, &data.time_unit)).collect()
}

/// Draws one spectrum; `None` when it has no positive frequency with power.
fn figure(spectrum: &ResidualSpectrum, time_unit: &str) -> Option<Figure> {
    let pairs = spectrum.frequency.iter().zip(&spectrum.power_over_noise);
    let (frequency, power): (Vec<f64>, Vec<f64>) =
        pairs.filter(|(f, p)| **f > 0.0 && **p > 0.0 && f.is_finite() && p.is_finite()).unzip();
    if frequency.is_empty() {
        return None;
    }
    let per = if time_unit.is_empty() { String::new() } else { format!("1/{time_unit}") };
    let x = Axis::log_around(&with_unit("frequency", &per), frequency.iter().copied());
    let y = Axis::log_around("power over that of the noise", power.iter().copied().chain([1.0]));
    let mut marks = vec![Mark::dashed_level((x.lo, x.hi), 1.0, GREEN)];
    marks.extend(Mark::curve(&frequency, &power, VERMILION, 1.75));
    let largest = power.iter().copied().fold(0.0, f64::max);
    let caption = format!(
        "Largest at {} {per}: {} times the noise. Noise alone stays around the dashed line; a narrow peak is a period that the \
         model lacks, a rise to the left is a slow drift.",
        number::significant(spectrum.peak, 3),
        number::significant(largest, 3)
    );
    let title = format!("{}, record {}: residuals by frequency", spectrum.channel, spectrum.record);
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    Some(Figure::new(&scene, &[("line vermilion", "residuals before"), ("dash green", "noise")], caption))
}
