//! Sample autocorrelation of the residuals of one channel.

use crate::data::{Autocorrelation, ChannelPlot, ReportData};
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, GREEN, MUTED};
use crate::plot::scene::Scene;
use crate::plot::thin;

/// More lags than this are drawn as a curve.
const STEMS: usize = 120;

/// The autocorrelation of one channel of one record, where it was stored.
pub(super) fn figure(channel: &ChannelPlot, data: &ReportData) -> Option<Figure> {
    let same = |a: &&Autocorrelation| a.record == channel.record && a.channel == channel.channel;
    let found = data.autocorrelation.iter().find(same).filter(|a| !a.value.is_empty());
    found.map(|series| draw(series, &data.time_unit))
}

/// Draws one autocorrelation with the band of white noise.
fn draw(series: &Autocorrelation, time_unit: &str) -> Figure {
    let x = Axis::tight(&with_unit("lag", time_unit), series.lag_time.iter().copied());
    let lowest = series.value.iter().copied().filter(|v| v.is_finite()).fold(-series.band.abs(), f64::min);
    let y = Axis::around("autocorrelation of the residuals", [lowest.min(-0.1), 1.0]);
    let ends = (x.lo, x.hi);
    let band = if series.band.is_finite() { series.band } else { 0.0 };
    let mut marks = vec![Mark::flat_band(ends, (-band, band), GREEN, 0.2), Mark::level(ends, 0.0, MUTED)];
    let points: Vec<_> = series.lag_time.iter().copied().zip(series.value.iter().copied()).collect();
    if points.len() <= STEMS {
        let width = (200.0 / points.len().max(1) as f64).clamp(1.5, 3.0);
        marks.push(Mark::Stems {
            points: points.iter().copied().filter(|p| p.1.is_finite()).collect(),
            colour: BLUE,
            width,
        });
    } else {
        let parts = thin::parts(&series.lag_time, &series.value, &series.value);
        marks.extend(parts.iter().map(|p| Mark::Line { points: thin::curve(p), colour: BLUE, width: 1.75 }));
    }
    let beyond: Vec<_> = points.iter().filter(|p| p.0 > 0.0 && p.1.is_finite()).collect();
    let outside = beyond.iter().filter(|p| p.1.abs() > band).count();
    let caption = format!(
        "{outside} of {} lags lie outside the band; white residuals leave about 5\u{a0}% there. What stays outside is structure that the model does not explain.",
        beyond.len()
    );
    let title = format!("{}, record {}: autocorrelation of the residuals", series.channel, series.record);
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    Figure::new(
        &scene,
        &[("line blue", "autocorrelation"), ("area green", "95\u{a0}% band of white noise")],
        caption,
    )
}
