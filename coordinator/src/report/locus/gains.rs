//! The gains at which the page shows the poles, and the poles there.
//!
//! Next file to read: [`super::plane`].

use nalgebra::Complex;
use starlings_models::spectrum::{ObserverSpectrum, SpectrumError};

/// Positions of the slider; the first is gain zero.
const FRAMES: usize = 121;
/// Poles shown, those of conjugate pairs in the upper half plane only.
const SHOWN: usize = 12;

/// The poles of one observer at every gain of the page.
pub(super) struct Ways {
    /// `[pole][gain]`, upper half plane.
    pub(super) poles: Vec<Vec<Complex<f64>>>,
    /// Largest real part of all poles at each gain.
    pub(super) max_re: Vec<f64>,
}

/// Poles without observer that are shown: the slowest, upper half plane.
pub(super) fn shown(poles: &[Complex<f64>], listed: usize) -> Vec<Complex<f64>> {
    poles.iter().take(listed).filter(|pole| pole.im >= 0.0).take(SHOWN).copied().collect()
}

/// Gain zero, then equal steps on a logarithmic scale, from gains that move no pole to see to gains beyond the best of every
/// observer.
pub(super) fn frames(shown: &[Complex<f64>], observers: &[ObserverSpectrum]) -> Vec<f64> {
    let moduli = shown.iter().map(|pole| pole.norm()).filter(|m| *m > 0.0);
    let (slow, fast) = moduli.fold((f64::INFINITY, 0.0_f64), |(lo, hi), m| (lo.min(m), hi.max(m)));
    let fast = if fast > 0.0 { fast } else { 1.0 };
    let best = observers.iter().map(|o| o.best.gain).fold(0.0, f64::max);
    let (lo, hi) = (0.02 * slow.clamp(1e-2 * fast, fast), (20.0 * fast).max((2.0 * best).min(1e3 * fast)));
    let steps = (FRAMES - 2) as f64;
    let at = |k: usize| lo * (hi / lo).powf(k as f64 / steps);
    std::iter::once(0.0).chain((0..FRAMES - 1).map(at)).collect()
}

/// The shown poles of an observer at every gain.
///
/// # Errors
///
/// The poles are not found.
pub(super) fn ways(
    observer: &ObserverSpectrum,
    shown: &[Complex<f64>],
    gains: &[f64],
) -> Result<Ways, SpectrumError> {
    let all = observer.locus(gains, observer.slopes.len())?;
    let upper = all.into_iter().filter(|way| way[0].im >= 0.0).take(shown.len());
    Ok(Ways {
        poles: upper.collect(),
        max_re: gains.iter().map(|&gain| observer.system.max_re(gain)).collect::<Result<_, _>>()?,
    })
}
